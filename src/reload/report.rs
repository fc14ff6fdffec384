//! The difference report: the facts of a plan in words, with what the old memory held.

use super::{Difference, Plan, State};
use crate::isa::duration;
use crate::resolve::program::Value;

/// The most lines of a report; the rest is counted.
const LINES_MAX: usize = 400;

impl Plan {
    /// A line a difference, with the old program's bits and words as they are (or were, in the last
    /// scan before the swap).
    pub fn report(&self, bits: &[u8], words: &[i32]) -> Vec<String> {
        let lines = self.differences.iter().filter_map(|d| line(d, bits, words));
        let mut lines: Vec<String> = lines.collect();
        if lines.len() > LINES_MAX {
            let more = lines.len() - LINES_MAX;
            lines.truncate(LINES_MAX);
            lines.push(format!("and {more} more"));
        }
        lines
    }
}

fn line(difference: &Difference, bits: &[u8], words: &[i32]) -> Option<String> {
    let text = &difference.text;
    let is_on = |cell: u32| bits.get(cell as usize).is_some_and(|bit| *bit != 0);
    let word = |cell: u32| words.get(cell as usize).copied();
    Some(match difference.state {
        None => text.clone(),
        Some(State::Ran { cell }) if is_on(cell) => format!("{text} and was terminated"),
        Some(State::Ran { .. }) => format!("{text}; it did not run"),
        Some(State::Stays { cell }) => return is_on(cell).then(|| text.clone()),
        Some(State::Keeps { timer, acc, preset, preset_word }) => {
            let acc = word(acc).filter(|acc| *acc != 0)?;
            let of = match (preset_word.and_then(word), preset) {
                (Some(value), _) | (None, Some(Value::Const(value, _))) => {
                    format!(" of {}", say(value, timer))
                }
                _ => String::new(),
            };
            format!("{text} keeps {}{of}", say(acc, timer))
        }
    })
}

/// Whether two presets are the same, however they are written.
pub(super) fn same(a: Value, b: Value) -> bool {
    match (a, b) {
        (Value::Const(a, _), Value::Const(b, _)) => a == b,
        (a, b) => a == b,
    }
}

/// A preset as people read it.
pub(super) fn preset(value: Value, is_time: bool) -> String {
    match value {
        Value::Const(value, _) => say(value, is_time),
        Value::Word(word) => word.to_string(),
    }
}

/// A count, or a time: `250 ms`, `4.2 s`, `1m30s`.
fn say(value: i32, is_time: bool) -> String {
    match value {
        _ if !is_time => value.to_string(),
        0..1000 => format!("{value} ms"),
        1000..60_000 => format!("{} s", f64::from(value) / 1000.0),
        _ => duration::print(value),
    }
}
