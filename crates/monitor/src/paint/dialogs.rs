//! Draws the dialogs, in a box over the page.

use ratatui_core::layout::Rect;

use super::pen::{Accent, ScreenPen};
use crate::dialog::{Dialog, TypedName, TypedShelf, WantedChange};
use crate::rows::value_text;
use crate::state::MonitorState;

/// The width of the box, if there is room.
const WIDE: u16 = 64;

/// Draws a dialog.
pub(super) fn dialog(pen: &mut ScreenPen, area: Rect, state: &MonitorState, dialog: &Dialog) {
    let lines = match dialog {
        Dialog::Add(typed) => add(typed),
        Dialog::Shelve(typed) => shelve(typed),
        Dialog::NewValue { wanted, operand, text, .. } => {
            let (now, what) = (present(state, operand), wanted.heading());
            vec![
                format!("{what} {operand}"),
                format!("present value: {now}"),
                String::new(),
                format!("new value: {text}_"),
                "ON, OFF, 12, 0x1F, 2.5 or 1m30s; Enter: accept, Esc: cancel".to_owned(),
            ]
        }
        Dialog::Confirm { wanted, operand, text } => {
            let now = present(state, operand);
            let new = match wanted {
                WantedChange::Force => format!("new value: {text}, forced until it is released"),
                WantedChange::Write => format!("new value: {text}"),
                WantedChange::Release => {
                    "the force ends; the next write decides its value".to_owned()
                }
                WantedChange::Acknowledge => {
                    "the log says that you have seen this alarm; its value stays".to_owned()
                }
                WantedChange::Unshelve => "if it stands, somebody has to acknowledge it".to_owned(),
            };
            vec![
                format!("{} {operand}?", wanted.heading()),
                format!("present value: {now}"),
                new,
                String::new(),
                "y: yes, do it   n: no".to_owned(),
            ]
        }
    };
    boxed(pen, area, &lines);
}

fn present(state: &MonitorState, operand: &str) -> String {
    state.value(operand).map_or_else(|| "not known yet".to_owned(), value_text)
}

fn add(typed: &TypedName) -> Vec<String> {
    let mut lines = vec![format!("Watch which operand? {}_", typed.shown())];
    for (at, name) in typed.names.iter().enumerate() {
        let sign = if typed.chosen == Some(at) { '▶' } else { ' ' };
        lines.push(format!("{sign} {}  {}", name.name, name.about));
    }
    lines.push("arrows: choose, Enter: watch it, Esc: cancel".to_owned());
    lines
}

fn shelve(typed: &TypedShelf) -> Vec<String> {
    let TypedShelf { alarm, time, why } = typed;
    let mut lines = vec![format!("Shelve {alarm}")];
    match why {
        None => {
            lines.push(format!("for how long: {time}_"));
            lines.push("30m, 8h, at most 168h; nothing: out of service".to_owned());
        }
        Some(why) => {
            let time = if time.trim().is_empty() { "out of service" } else { time };
            lines.push(format!("for how long: {time}"));
            lines.push(format!("why: {why}_"));
        }
    }
    lines.push("Enter: accept, Esc: cancel".to_owned());
    lines
}

/// Draws a box in the middle of an area.
fn boxed(pen: &mut ScreenPen, area: Rect, lines: &[String]) {
    let width = WIDE.min(area.width);
    let height = u16::try_from(lines.len() + 2).unwrap_or(u16::MAX).min(area.height);
    let (x, y) = (area.x + (area.width - width) / 2, area.y + (area.height - height) / 2);
    let frame = Rect { x, y, width, height };
    pen.clear(frame);
    let along = "━".repeat(usize::from(width.saturating_sub(2)));
    pen.put(frame, 0, &format!("┏{along}┓"), Accent::Plain);
    let inner = Rect { x: x + 2, width: width.saturating_sub(4), ..frame };
    for row in 1..height.saturating_sub(1) {
        pen.put(frame, row, "┃", Accent::Plain);
        pen.put(Rect { x: x + width - 1, width: 1, ..frame }, row, "┃", Accent::Plain);
        let accent = if row == 1 { Accent::Strong } else { Accent::Plain };
        let line = lines.get(usize::from(row) - 1).map_or("", |line| line);
        pen.put(inner, row, line, accent);
    }
    pen.put(frame, height.saturating_sub(1), &format!("┗{along}┛"), Accent::Plain);
}
