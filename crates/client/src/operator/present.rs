//! What a controller does at present, beside its scan log: the mode, and the outputs whose state
//! their bits in memory do not show.
//!
//! Part of [`super::protocol`]. A scan that hangs, a device that is lost: the log does not have
//! them, the daemon does.

use serde::{Deserialize, Serialize};

use super::value::UnknownOutput;
use rungd_config::controller::OutputState;
use rungd_history::observe::{Explanation, Subject};

/// The mode, and the outputs.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PresentOutputs {
    /// `RUN`, `STOP` or `FAULT`.
    pub mode: String,
    /// The reason for the mode; `None` in RUN.
    pub reason: Option<String>,
    /// The present time, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// Outside RUN: the numbers of the outputs that are ON; all others are OFF. `None` in RUN,
    /// where outputs have the values of their bits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on: Option<Vec<u32>>,
    /// The outputs whose device is lost.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unknown: Vec<(u32, UnknownOutput)>,
}

impl PresentOutputs {
    /// Completes an answer about the end of the log: the log does not have a scan that hangs, nor
    /// what a lost device has accepted last.
    pub fn complete(&self, answer: &mut Explanation, subject: &Subject) {
        if let Some(number) = subject.output_rules().number(answer.root.operand.cell) {
            answer.output = self.output(number);
        }
    }

    /// The state of an output, by its number.
    pub fn output(&self, number: u32) -> OutputState {
        let unknown = self.unknown.iter().find(|(output_number, _)| *output_number == number);
        match (unknown, &self.on) {
            (Some((_, unknown)), _) => OutputState::Unknown(unknown.last),
            (None, Some(on)) => OutputState::Safe(on.contains(&number)),
            (None, None) => OutputState::AsMemory,
        }
    }
}
