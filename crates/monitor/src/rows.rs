//! The rows of the panes: the texts that `paint` draws, and the operands that the keys act on.
//!
//! Made from the state for each picture. States are written in words; a mark repeats them.

use super::state::{MonitorPane, MonitorState};
use rungd_base::duration_text::duration_text;
pub use rungd_client::operator::protocol::{
    AlarmState, AlarmStatus, BlockStatus, ControllerStatus, FieldDevice, ShownValue,
};

/// The marks for ON and for OFF.
const ON: char = '●';
const OFF: char = '○';

/// A row of a pane.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct PaneRow {
    pub text: String,
    /// The number of a watched operand; its trend is drawn after the text.
    pub watched: Option<usize>,
    /// The operand that the keys act on.
    pub operand: Option<String>,
    /// The block or Stage whose ladder is opened from this row.
    pub element: Option<String>,
    /// Whether it is drawn bold: it is ON, forced, or wrong.
    pub is_marked: bool,
}

impl MonitorState {
    /// The rows of a pane.
    pub fn rows(&self, pane: MonitorPane) -> Vec<PaneRow> {
        let Some(status) = &self.status else { return Vec::new() };
        match pane {
            MonitorPane::Watch => self.watch_rows(),
            MonitorPane::Blocks => {
                status.blocks.iter().flat_map(|block| self.block_rows(block)).collect()
            }
            MonitorPane::Alarms => alarm_rows(status),
            MonitorPane::Forces => status.forces.iter().map(force_row).collect(),
            MonitorPane::Devices => device_rows(status),
        }
    }

    /// The number of the chosen row of a pane.
    pub fn chosen_row(&self, pane: usize) -> usize {
        let count = self.rows(MonitorPane::ALL[pane]).len();
        self.chosen[pane].min(count.saturating_sub(1))
    }

    /// The chosen row of the pane with the focus.
    pub fn row(&self) -> Option<PaneRow> {
        self.rows(self.focus()).into_iter().nth(self.chosen_row(self.pane))
    }

    fn watch_rows(&self) -> Vec<PaneRow> {
        let named = self.watch.rows.iter().map(|row| match &row.shown {
            Some(shown) => shown.tag.clone().unwrap_or_else(|| row.operand.clone()),
            None => row.operand.clone(),
        });
        let named: Vec<String> = named.collect();
        let wide = named.iter().map(|name| name.chars().count().min(18)).max().unwrap_or(0);
        let rows = self.watch.rows.iter().zip(named).enumerate().map(|(at, (row, name))| {
            let value = match &row.shown {
                Some(shown) => value_text(shown),
                None if row.is_unknown => "not in this program".to_owned(),
                None => "no value yet".to_owned(),
            };
            PaneRow {
                text: format!("{name:wide$}  {value}"),
                watched: Some(at),
                operand: Some(row.operand.clone()),
                is_marked: row.shown.as_ref().is_some_and(|shown| shown.forced),
                ..PaneRow::default()
            }
        });
        rows.collect()
    }

    /// The rows of a block and its Stages: all Stages if the ladder is known, otherwise those that
    /// are ON.
    fn block_rows(&self, block: &BlockStatus) -> Vec<PaneRow> {
        let state = match (block.running, block.done) {
            (true, _) => "running",
            (false, Some(true)) => "done",
            (false, Some(false) | None) => "not running",
        };
        let kind = if block.kind == "task" { "Task" } else { "Program" };
        let sign = if block.running { ON } else { OFF };
        let mut rows = vec![PaneRow {
            text: format!("{sign} {kind} {}: {state}", block.name),
            operand: Some(format!("{}.Running", block.name)),
            element: Some(block.name.clone()),
            is_marked: block.running,
            ..PaneRow::default()
        }];
        let drawn = self.ladder.picture().and_then(|picture| {
            picture.blocks.iter().find(|drawn_block| drawn_block.name == block.name)
        });
        let stages: Vec<String> = match drawn {
            Some(drawn) => drawn.stages.iter().map(|stage| stage.name.clone()).collect(),
            None => block.stages.clone(),
        };
        for stage in stages {
            let is_on = block.stages.contains(&stage);
            let (sign, word) = if is_on { (ON, "ON") } else { (OFF, "OFF") };
            let whole = format!("{}.{stage}", block.name);
            rows.push(PaneRow {
                text: format!("    {sign} Stage {stage}: {word}"),
                operand: Some(whole.clone()),
                element: Some(whole),
                is_marked: is_on,
                ..PaneRow::default()
            });
        }
        rows
    }
}

/// `12, forced`. For an output outside RUN, also the value that is at the output.
pub(super) fn value_text(shown: &ShownValue) -> String {
    let forced = if shown.forced { ", forced" } else { "" };
    format!("{}{forced}{}", shown.value_text(), shown.driven_text(", "))
}

fn alarm_rows(status: &ControllerStatus) -> Vec<PaneRow> {
    status.alarms.iter().flat_map(of_alarm).collect()
}

/// The two rows of an alarm: its text, and its details.
fn of_alarm(alarm: &AlarmStatus) -> [PaneRow; 2] {
    let row = |text, is_marked| PaneRow {
        text,
        operand: Some(alarm.tag.clone()),
        is_marked,
        ..PaneRow::default()
    };
    let stands = alarm.state.is_active();
    let sign = if stands { ON } else { OFF };
    let lasted = duration_text(alarm.lasted_ms.saturating_mul(1_000_000));
    let ack = match (&alarm.shelved, alarm.state) {
        (Some(shelf), _) => format!("{} by {}: {}", shelf.words(), shelf.who, shelf.why),
        (None, AlarmState::Acknowledged) => "acknowledged".to_owned(),
        (None, AlarmState::Returned) => "returned, NOT ACKNOWLEDGED".to_owned(),
        (None, AlarmState::Unacknowledged) => "NOT ACKNOWLEDGED".to_owned(),
        (None, AlarmState::Normal) => "over".to_owned(),
    };
    let group = alarm.group.iter().map(|group| format!("{group}, ")).collect::<String>();
    let times = if alarm.day > 1 { format!(", {} a day", alarm.day) } else { String::new() };
    let facts = format!("  {}, {group}{ack}, {lasted}{times}", alarm.priority.name());
    let head = format!("{sign} {}: {}", alarm.tag, alarm.text);
    [row(head, alarm.shelved.is_none()), row(facts, false)]
}

fn force_row(shown: &ShownValue) -> PaneRow {
    let operand = shown.tag.clone().unwrap_or_else(|| shown.operand.clone());
    PaneRow {
        text: format!("{shown}: {}{}", shown.value_text(), shown.driven_text(", ")),
        operand: Some(operand),
        is_marked: true,
        ..PaneRow::default()
    }
}

fn device_rows(status: &ControllerStatus) -> Vec<PaneRow> {
    let plain = |text: String| PaneRow { text, ..PaneRow::default() };
    let mut rows = Vec::new();
    if let Some(modbus) = &status.devices.modbus {
        let (clients, most) = (modbus.clients, modbus.connections_max);
        let at = &modbus.address;
        rows.push(plain(format!("{ON} Modbus server at {at}: {clients} of {most} clients")));
    }
    if let Some(rules) = status.devices.simulated_rules {
        rows.push(plain(format!("{ON} simulated inputs: {rules} rules")));
    }
    rows.extend(status.devices.field.iter().flat_map(field_rows));
    rows
}

fn field_rows(device: &FieldDevice) -> Vec<PaneRow> {
    let (state, is_well) = match (&device.trouble, device.ok, device.stale) {
        (_, _, true) => ("STALE", false),
        (Some(_), _, false) => ("in trouble", false),
        (None, true, false) => ("ok", true),
        (None, false, false) => ("not seen by a scan yet", false),
    };
    let sign = if is_well { ON } else { OFF };
    let (name, peer) = (&device.name, &device.peer);
    let operand = Some(format!("{name}.Ok"));
    let row = |text, is_marked| PaneRow {
        text,
        operand: operand.clone(),
        is_marked,
        ..PaneRow::default()
    };
    let mut rows =
        vec![row(format!("{sign} {name} ({}, {peer}): {state}", device.driver), !is_well)];
    rows.extend(device.trouble.iter().map(|why| row(format!("    {why}"), true)));
    rows
}
