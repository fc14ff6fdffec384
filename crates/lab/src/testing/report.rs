//! Verdicts as text for people.
//!
//! A failure shows the step with its place, the operands of its condition, their last changes as a
//! timing diagram, and the reasons of their values.

use std::fmt::Write as _;

use super::failure::{Failure, SeenOperand};
use super::runner::TestVerdict;
use rungd_language::source::wording::counted;

/// The maximum number of columns of a timing diagram.
const COLUMNS_MAX: usize = 9;

/// The minimum width of a column.
const COLUMN_WIDTH: usize = 8;

impl TestVerdict {
    /// One line: the result, the name, the number of scans and the time.
    pub fn line_text(&self) -> String {
        let word = if self.failure.is_some() { "FAILED" } else { "ok" };
        let runs = if self.runs > 1 { format!("{} runs, ", self.runs) } else { String::new() };
        let scans = counted(self.scans, "scan");
        format!("{word:<6}  {}  ({runs}{scans}, {})", self.name, time_text(self.virtual_ns))
    }

    /// What never moved in a random test, as a line; empty if everything did.
    pub fn unmoved_text(&self) -> String {
        match self.unmoved.text() {
            text if text.is_empty() => text,
            text => format!("  {}: {text}", self.name),
        }
    }
}

impl Failure {
    /// The complete failure, without the name of the test; `file`: the displayed name of the test
    /// file.
    pub fn text(&self, file: &str) -> String {
        let mut text = String::new();
        let (line, column) = self.place;
        let step = match self.step {
            Some((step, steps)) => format!("step {step} of {steps}: "),
            None => String::new(),
        };
        let _ = writeln!(text, "  {file}:{line}:{column}");
        let _ = writeln!(text, "  {step}{}", self.text);
        let when = match self.scan {
            0 => "before the first scan".to_owned(),
            scan => format!("at scan {scan} ({})", time_text(self.now_ns)),
        };
        let _ = writeln!(text, "  {when}: {}", self.what);
        if let Some(findings) = &self.findings {
            text.push('\n');
            text += &indented(findings, 4);
        }
        text += &self.reasons_text();
        if let Some(scenario) = &self.scenario {
            text += "\n  the shortest run that was found, to paste:\n\n";
            text += &indented(scenario, 4);
        }
        text
    }

    /// The operands of the condition with their last changes, and the reasons of their values.
    pub fn reasons_text(&self) -> String {
        let mut text = self.operands_text();
        text += &diagram(&self.operands, self.now_ns);
        for trouble in &self.troubles {
            let _ = write!(text, "\n    device {trouble}\n");
        }
        for why in &self.why {
            text.push('\n');
            text += &indented(why, 4);
        }
        text
    }

    fn operands_text(&self) -> String {
        let width =
            self.operands.iter().map(|operand| operand.name.chars().count()).max().unwrap_or(0);
        let is_hex = self.text.contains("0x");
        let shown = |operand: &SeenOperand| match is_hex {
            true => with_hex(&operand.value),
            false => operand.value.clone(),
        };
        let values: Vec<String> = self.operands.iter().map(shown).collect();
        let length = values.iter().map(|value| value.chars().count()).max().unwrap_or(0);
        let mut text = String::new();
        for (operand, value) in self.operands.iter().zip(values) {
            let mut since = since_text(operand, self.now_ns);
            if let Some(scan) = operand.on_within {
                let comma = if since.is_empty() { "" } else { ", but " };
                since += &format!("{comma}it was ON within scan {scan}");
            }
            let name = &operand.name;
            let line = format!("    {name:<width$}  {value:<length$}  {since}");
            let _ = writeln!(text, "{}", line.trim_end());
        }
        text
    }
}

/// A whole number with its hexadecimal digits, for a condition that has some. Up to 9 both are the
/// same.
fn with_hex(value: &str) -> String {
    match value.parse::<i32>() {
        Ok(number) if !(0..10).contains(&number) => format!("{value} (0x{number:X})"),
        Ok(_) | Err(_) => value.to_owned(),
    }
}

/// The age of an operand's value.
fn since_text(operand: &SeenOperand, now_ns: u64) -> String {
    match operand.changes.as_slice() {
        [] => String::new(),
        [first] if first.scan == 1 => "since the first scan".to_owned(),
        [.., last] => {
            let ago = time_text(now_ns.saturating_sub(last.now_ns));
            match now_ns == last.now_ns {
                true => format!("since this scan, {}", last.scan),
                false => format!("since scan {}, for {ago}", last.scan),
            }
        }
    }
}

/// The last changes of the operands as a timing diagram, with a column from each change to the
/// next.
fn diagram(operands: &[SeenOperand], now_ns: u64) -> String {
    let mut moments: Vec<u64> = operands
        .iter()
        .flat_map(|operand| operand.changes.iter().map(|change| change.now_ns))
        .collect();
    moments.push(now_ns);
    moments.sort_unstable();
    moments.dedup();
    if moments.len() < 2 {
        return String::new();
    }
    let moments = &moments[moments.len().saturating_sub(COLUMNS_MAX)..];
    let names =
        operands.iter().map(|operand| operand.name.chars().count()).max().unwrap_or(0).max(4);
    let heads = heads(moments);
    let cells: Vec<Vec<String>> = operands.iter().map(|operand| cells(operand, moments)).collect();
    let width = |column: usize| {
        let texts = cells.iter().map(|row| row[column].chars().count());
        texts.chain([heads[column].chars().count(), COLUMN_WIDTH - 1]).max().unwrap_or(0) + 1
    };
    let mut text = format!("\n    {:<names$}  ", "time");
    for (column, head) in heads.iter().enumerate() {
        let _ = write!(text, "{head:<0$}", width(column));
    }
    text.truncate(text.trim_end().len());
    text.push('\n');
    for (operand, row) in operands.iter().zip(&cells) {
        let _ = write!(text, "    {:<names$}  ", operand.name);
        for (column, cell) in row.iter().enumerate() {
            let width = width(column);
            // A number is written only in the column in which it changes.
            let is_new = column == 0 || row[column - 1] != *cell;
            match (operand.is_bit, cell.as_str()) {
                (true, "ON") => text += &"#".repeat(width),
                (true, "OFF") => text += &"_".repeat(width),
                _ if is_new => drop(write!(text, "{cell:<width$}")),
                _ => text += &" ".repeat(width),
            }
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
    text
}

/// The times of the columns, in the short form if all of them differ.
fn heads(moments: &[u64]) -> Vec<String> {
    let short: Vec<String> = moments.iter().map(|ns| time_text(*ns)).collect();
    if short.windows(2).all(|two| two[0] != two[1]) {
        return short;
    }
    let long = |ns: &u64| {
        let (s, ms) = (ns / 1_000_000_000, ns / 1_000_000 % 1000);
        format!("{:02}:{:02}:{:02}.{ms:03}", s / 3600, s / 60 % 60, s % 60)
    };
    moments.iter().map(long).collect()
}

/// The value of an operand at each of these moments; empty before its first known value.
fn cells(operand: &SeenOperand, moments: &[u64]) -> Vec<String> {
    let value = |at: &u64| {
        let known = operand.changes.iter().rev().find(|change| change.now_ns <= *at);
        known.map_or_else(String::new, |change| change.value.clone())
    };
    moments.iter().map(value).collect()
}

/// A time: `0 s`, `1.25 s`, `3 min 20 s`, `2 h 5 min`.
pub fn time_text(ns: u64) -> String {
    let ms = ns / 1_000_000;
    let (s, rest_ms) = (ms / 1000, ms % 1000);
    if s < 60 {
        let text = format!("{s}.{rest_ms:03}");
        return format!("{} s", text.trim_end_matches('0').trim_end_matches('.'));
    }
    if s < 3600 {
        return match s % 60 {
            0 => format!("{} min", s / 60),
            rest => format!("{} min {rest} s", s / 60),
        };
    }
    match s % 3600 / 60 {
        0 => format!("{} h", s / 3600),
        rest => format!("{} h {rest} min", s / 3600),
    }
}

fn indented(text: &str, by: usize) -> String {
    let line = |line: &str| match line.is_empty() {
        true => "\n".to_owned(),
        false => format!("{}{line}\n", " ".repeat(by)),
    };
    text.lines().map(line).collect()
}
