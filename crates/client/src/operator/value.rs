//! Values in the protocol: given by a client, and held by an operand.
//!
//! Part of [`super::protocol`], which describes the rest.

use std::fmt;

use serde::{Deserialize, Serialize};

use rungd_config::controller::OutputState;
use rungd_engine::isa::Real;
use rungd_language::resolve::value_texts::with_text;

/// A value in the form that a client sends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a value is true or false, a number, or a string")]
pub enum GivenValue {
    /// `true`, `false`.
    Bit(bool),
    /// A whole number.
    Number(i64),
    /// A number with a point or an exponent.
    Real(f64),
    /// A text as people write it: `ON`, `12`, `0x1F`, `1m30s`.
    Text(String),
}

/// One of the writes of a change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GivenWrite {
    /// Tag, address or member.
    pub operand: String,
    /// The value to write.
    pub value: GivenValue,
}

/// The value of one operand.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShownValue {
    /// The text of the request; if it named a structure, with the member.
    pub operand: String,
    /// Its tag, if it has one; for a member, with the member: `parts.Acc`.
    pub tag: Option<String>,
    /// Its address: `CT0.Acc`; for Stages and blocks, their name: `Drain.Open`.
    pub address: String,
    /// Its value.
    pub value: BitOrNumber,
    /// The unit of its tag, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// The text of the value, if its tag gives one: `dosing`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// Whether it is forced.
    pub forced: bool,
    /// For a Y outside RUN: the state of the output, its safe value. In RUN the state is `value`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub driven: Option<bool>,
    /// For a Y whose device is lost: what is known of its state. `driven` is then what would be
    /// written to the device.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unknown: Option<UnknownOutput>,
}

/// The answer to a write, force or unforce.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChangedOperand {
    /// The value before.
    pub before: BitOrNumber,
    /// Its text, if the tag gives one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub before_text: Option<String>,
    /// Whether it was forced before.
    pub was_forced: bool,
    /// The current value; after a write, the value after the scan that saw the write.
    pub now: ShownValue,
    /// Whether the ladder took the written ON as a command: it turned the bit OFF again.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub taken: bool,
    /// A note about the change: for example, that something else writes the operand too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// The answer to several writes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChangedOperands {
    /// In the order of the request.
    pub changes: Vec<ChangedOperand>,
}

/// An output whose device is lost.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnknownOutput {
    /// The name of the device.
    pub device: String,
    /// The last value that the device has accepted; `None`: it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last: Option<bool>,
}

impl ShownValue {
    /// The value, followed by its unit and its text: `4.2 bar`, `1 (dosing)`.
    pub fn value_text(&self) -> String {
        match &self.unit {
            Some(unit) => with_text(format_args!("{} {unit}", self.value), self.text.as_deref()),
            None => self.say_value(),
        }
    }

    /// The value, followed by its text: `1 (dosing)`.
    pub fn say_value(&self) -> String {
        with_text(self.value, self.text.as_deref())
    }

    /// The state of the output.
    pub fn output(&self) -> OutputState {
        match (&self.unknown, self.driven) {
            (Some(unknown), _) => OutputState::Unknown(unknown.last),
            (None, Some(driven)) => OutputState::Safe(driven),
            (None, None) => OutputState::AsMemory,
        }
    }

    /// What the machine has: the value, or the state of the output where it is a different thing.
    /// `None`: it is not known.
    pub fn present(&self) -> Option<BitOrNumber> {
        match self.output() {
            OutputState::AsMemory => Some(self.value),
            OutputState::Safe(on) => Some(BitOrNumber::Bit(on)),
            OutputState::Unknown(_) => None,
        }
    }

    /// The state of the output in words, after a separator; empty if the value shows it.
    pub fn driven_text(&self, separator: &str) -> String {
        self.output().text(separator)
    }
}

/// The answer to a request for values that can be written back: all are from one complete scan.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WritableValues {
    /// `RUN`, `STOP` or `FAULT`.
    pub mode: String,
    /// Complete scans since the process started.
    pub scans: u64,
    /// Each place once, in the order of the request; the `operand` is the name to write.
    pub values: Vec<ShownValue>,
    /// The number of structures whose members are left out.
    pub structures: usize,
    /// The number of other bits and words that are left out: read-only ones, and inputs that a
    /// device moves.
    pub read_only: usize,
    /// The names of the tags of records whose fields are among the values.
    #[serde(default)]
    pub records: Vec<String>,
}

/// A bit or a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
#[allow(missing_docs)]
pub enum BitOrNumber {
    Bit(bool),
    Word(i32),
    Real(Real),
}

impl fmt::Display for BitOrNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BitOrNumber::Bit(true) => f.write_str("ON"),
            BitOrNumber::Bit(false) => f.write_str("OFF"),
            BitOrNumber::Word(value) => write!(f, "{value}"),
            BitOrNumber::Real(value) => write!(f, "{value}"),
        }
    }
}

impl fmt::Display for ShownValue {
    /// The form `parts.Acc (CT0.Acc)`, or only the address.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_name(f, self.tag.as_deref(), &self.address)
    }
}

/// Writes the names of an operand: `parts.Acc (CT0.Acc)`, or only the address.
pub(super) fn write_name(
    f: &mut fmt::Formatter<'_>,
    tag: Option<&str>,
    address: &str,
) -> fmt::Result {
    match tag {
        Some(tag) if tag != address => write!(f, "{tag} ({address})"),
        Some(_) | None => f.write_str(address),
    }
}
