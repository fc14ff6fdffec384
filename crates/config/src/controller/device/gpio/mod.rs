//! The keys of local lines, resolved: the lines of a chip and their settings.
//!
//! ```toml
//! # passes
//! [[device]]
//! name = "panel"
//! driver = "gpio"
//! chip = "/dev/gpiochip0"
//! map = [{ from = "line 4..5", to = "X0..X1", debounce = "5ms", bias = "pull-up" }]
//! # fails with { from = "Y0", to = "line 5" } beside it: line 5 is in two rows
//! ```

pub(crate) mod keys;

use std::collections::HashMap;

use keys::{GpioKeys, GpioRowKeys};

use super::driver::{
    DriverKeys, PointBeginning, ResolvedRow, ResolvedRows, RowDirection, WrittenDevice,
};
use super::settings::DriverSettings;
use rungd_io::gpio::settings::{GpioLine, GpioSettings, LineDrive, LineId, LineSetting};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, advise, pair, possible, proposed};
use rungd_language::source::reader::Table;
use rungd_language::source::span::Span;

/// The longest debounce.
const DEBOUNCE_MS_MAX: u32 = 10_000;
/// The most lines that a chip has.
const LINES_MAX: u32 = 65_536;

/// The beginning of points, for editors.
pub(super) fn beginnings() -> Vec<PointBeginning> {
    let (text, about) = ("line ".to_owned(), "a line of the chip".to_owned());
    vec![PointBeginning { text, about, is_written: true }]
}

impl DriverKeys for GpioKeys {
    fn read_row(&mut self, row: &mut Table<'_>) {
        self.rows.push(GpioRowKeys::read(row));
    }

    fn read(&mut self, table: &mut Table<'_>) {
        self.read_device(table);
    }

    fn is_point(&self, text: &str, _device: &str) -> bool {
        text.split_once(' ').is_some_and(|(word, _)| matches!(word, "line" | "lines"))
    }

    fn example(&self, _device: &str) -> String {
        "line 17".to_owned()
    }

    fn resolve(
        &self,
        device: &WrittenDevice,
        rows: ResolvedRows<'_>,
        findings: &mut Vec<Finding>,
    ) -> Option<DriverSettings> {
        lines_of(self, device, rows, findings).map(DriverSettings::Gpio)
    }

    fn is_polled(&self) -> bool {
        false
    }
}

fn lines_of(
    keys: &GpioKeys,
    device: &WrittenDevice,
    rows: ResolvedRows<'_>,
    findings: &mut Vec<Finding>,
) -> Option<GpioSettings> {
    let before = findings.len();
    if let Some(poll) = &device.poll {
        let message = "lines of a chip are read and written by every scan";
        let finding = Finding::new(Code::Controller, poll.span, message);
        let help = "remove `poll`; `[scan] period` sets the rate";
        findings.push(finding.help(help).fix(FixEdit::Remove("poll")));
    }
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    let mut seen: HashMap<LineId, Span> = HashMap::new();
    for row in rows.each() {
        let lines = match lines(row) {
            Ok(lines) => lines,
            Err(finding) => {
                findings.push(finding);
                continue;
            }
        };
        let setting = setting(row, &keys.rows[row.at], findings);
        for at in lines {
            enter(&at, row.points.span, &mut seen, findings);
            let line_name = match row.direction {
                RowDirection::In => &mut inputs,
                RowDirection::Out => &mut outputs,
            };
            line_name.push(GpioLine { at, setting });
        }
    }
    let chip = keys.chip.clone().filter(|_| findings.len() == before)?;
    Some(GpioSettings { chip, budget_us: keys.budget_us, inputs, outputs })
}

/// The lines of a row: one for each of its addresses.
fn lines(row: &ResolvedRow<'_>) -> Result<Vec<LineId>, Finding> {
    if row.is_words() {
        let message = format!("a line is ON or OFF, and `{}` is a word", row.text.text);
        let bits = ["C", if row.direction == RowDirection::In { "X" } else { "Y" }];
        let bits = bits.map(|block| row.placed_in(block));
        return Err(row.find(message).help("take a bit: X, Y, C, MC or MI").fixes(bits));
    }
    let text = row.points.text.split_once(' ').map_or("", |(_, rest)| rest.trim());
    let (low, high) = match text.split_once("..") {
        Some((low, high)) => (number(low, row)?, number(high, row)?),
        None if text.starts_with(|c: char| c.is_ascii_digit()) => {
            let offset = number(text, row)?;
            (offset, offset)
        }
        None => return named(text, row),
    };
    if high < low {
        let message = "a range goes from low to high".to_owned();
        return Err(row.find(message).write(format!("line {high}..{low}")));
    }
    fits((high - low + 1) as usize, row).map_err(|finding| {
        let last = low.saturating_add(row.addresses.len() as u32).saturating_sub(1);
        let range = if last == low { low.to_string() } else { format!("{low}..{last}") };
        finding.fix(possible(format!("line {range}")))
    })?;
    Ok((low..=high).map(LineId::Offset).collect())
}

fn named(text: &str, row: &ResolvedRow<'_>) -> Result<Vec<LineId>, Finding> {
    if text.is_empty() {
        let finding = row.find(format!("`{}` names no line", row.points.text));
        return Err(finding.help(advise("as `{}`", [possible("line 17")])));
    }
    fits(1, row)?;
    Ok(vec![LineId::Name(text.to_owned())])
}

fn fits(lines: usize, row: &ResolvedRow<'_>) -> Result<(), Finding> {
    if lines == row.addresses.len() {
        return Ok(());
    }
    let (points, text) = (&row.points.text, &row.text.text);
    let message = format!("`{points}` and `{text}` differ in number");
    let addresses = row.addresses.len();
    let counts = format!("they are {lines} and {addresses}: write the same number of both");
    Err(row.find(message).help(counts).fixes(row.of_count(lines)))
}

fn number(text: &str, row: &ResolvedRow<'_>) -> Result<u32, Finding> {
    let number = text.trim().parse().ok().filter(|number| *number < LINES_MAX);
    number.ok_or_else(|| {
        let message = format!("`{}` is no line's number", text.trim());
        let lines = [proposed("line 17"), possible("line 4..7")];
        row.find(message).help(advise("write `{}`, or `{}`", lines))
    })
}

fn enter(at: &LineId, span: Span, seen: &mut HashMap<LineId, Span>, findings: &mut Vec<Finding>) {
    let Some(first) = seen.get(at) else {
        seen.insert(at.clone(), span);
        return;
    };
    // Only one finding per row, which is then the last.
    if findings.last().is_none_or(|finding| finding.span != span) {
        let finding = Finding::new(Code::Controller, span, format!("{at} is in two rows"));
        findings.push(finding.label("again here").related(*first, "first here").or_delete_row());
    }
}

fn setting(row: &ResolvedRow<'_>, keys: &GpioRowKeys, findings: &mut Vec<Finding>) -> LineSetting {
    let is_output = row.direction == RowDirection::Out;
    if let Some(debounce) = &keys.debounce_ms {
        if is_output {
            let finding =
                Finding::new(Code::Controller, debounce.span, "an output has no debounce");
            findings.push(finding.help("take it out").fix(FixEdit::Delete));
        } else if debounce.value > DEBOUNCE_MS_MAX {
            let message = "a debounce lasts 10s at most";
            let longest = pair("debounce = \"10s\"");
            findings.push(Finding::new(Code::OutOfRange, debounce.span, message).fix(longest));
        }
    }
    if let Some(drive) = keys.drive.as_ref().filter(|_| !is_output) {
        let message = "an input drives nothing: it has no `drive`";
        let help = "take it out; `bias` holds an open input";
        let finding = Finding::new(Code::Controller, drive.span, message).help(help);
        findings.push(finding.fix(FixEdit::Delete));
    }
    LineSetting {
        active_low: keys.active_low,
        bias: keys.bias,
        drive: keys.drive.as_ref().map_or_else(LineDrive::default, |drive| drive.value),
        debounce_ms: keys.debounce_ms.as_ref().map_or(0, |ms| ms.value),
    }
}
