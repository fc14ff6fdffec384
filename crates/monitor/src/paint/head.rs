//! The head of every page: the program, the mode, the scan, and whether the controller answers.

use ratatui_core::layout::Rect;

use super::pen::{Accent, ScreenPen};
use crate::state::MonitorState;
use rungd_base::duration_text::{duration_text, period_text};
use rungd_client::operator::protocol::{AlarmStatus, ControllerStatus, is_run};

/// Draws the head.
pub(super) fn head(pen: &mut ScreenPen, area: Rect, state: &MonitorState) {
    if let Some(status) = &state.status {
        mode(pen, area, status);
        pen.put(area, 1, &scan(status), Accent::Plain);
    }
    let Some(silence) = &state.silence else {
        let text = match &state.status {
            Some(status) => counts(status),
            None => "waiting for the controller".to_owned(),
        };
        pen.put(area, 2, &text, Accent::Plain);
        return;
    };
    let since = duration_text(state.now_ms.saturating_sub(silence.since_ms) * 1_000_000);
    let old = if state.status.is_some() { "; the values shown are old" } else { "" };
    let text = format!("NO ANSWER for {since}{old}: {}", silence.why);
    pen.row(area, 2, &text, Accent::Alarming);
}

fn mode(pen: &mut ScreenPen, area: Rect, status: &ControllerStatus) {
    let runs = is_run(&status.mode);
    let why = status.reason.as_ref().map_or(String::new(), |why| format!(" ({why})"));
    let since = duration_text(status.mode_ms * 1_000_000);
    let took = pen.put(area, 0, &format!("{}  ", status.ladder.name), Accent::Plain);
    let rest = Rect { x: area.x + took, width: area.width - took, ..area };
    let accent = if runs { Accent::Strong } else { Accent::Alarming };
    pen.put(rest, 0, &format!("{}{why} for {since}", status.mode), accent);
    pen.put_right(area, 0, &format!("scan {}", status.scans));
}

fn scan(status: &ControllerStatus) -> String {
    let execution = &status.scan.execution;
    format!(
        "every {}  last {:.1} us  p99 {:.1} us  max {:.1} us  overruns {}",
        period_text(status.period_us * 1000),
        execution.last_us,
        execution.p99_us,
        execution.max_us,
        status.scan.overruns
    )
}

fn counts(status: &ControllerStatus) -> String {
    let alarms = status.alarms.iter().filter(|alarm| AlarmStatus::is_standing(alarm)).count();
    let troubled =
        status.devices.field.iter().filter(|device| device.stale || device.trouble.is_some());
    let devices = match troubled.count() {
        0 => String::new(),
        count => format!("  devices in trouble: {count}"),
    };
    format!("alarms: {alarms}  forces: {}{devices}", status.forces.len())
}
