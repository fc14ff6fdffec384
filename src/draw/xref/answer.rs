//! The cross-reference as data; its JSON has the same names.

use serde::Serialize;

use crate::observe::Place;

/// All that touches an operand. Lists are in the order of files and places.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct CrossReference {
    /// Its tag, or its name as it was asked for.
    pub name: String,
    /// Its address, if it has a tag with one; `3` of a constant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub address: Option<String>,
    /// The tag's `doc`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub doc: Option<String>,
    /// Where its name is declared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub declared: Option<FileLine>,
    /// Of a constant: where the ladder names it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub constants: Vec<FileLine>,
    /// The instructions that write it.
    pub written: Vec<WritePlace>,
    /// The blocks whose start and end write it: the bits of Stages and blocks.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub turned: Vec<String>,
    /// The contacts and instructions that read it.
    pub read: Vec<ReadPlace>,
    /// What the controller file does with it.
    pub outside: Vec<OutsideUse>,
    /// Whether retentive memory keeps it.
    pub retained: bool,
    /// The steps and conditions of tests that name it.
    pub tests: Vec<TestPlace>,
}

/// A line of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FileLine {
    /// The file, as it was named.
    pub file: String,
    /// The line, from 1.
    pub line: u32,
}

impl FileLine {
    /// The line of a place.
    pub(super) fn of(place: &Place) -> FileLine {
        FileLine { file: place.file.clone(), line: place.line }
    }
}

/// An instruction that writes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct WritePlace {
    /// The instruction as it is written.
    pub text: String,
    /// Its rung: `Main, rung fill`.
    pub rung: String,
    /// The rung in a page: its block or Stage, and its number.
    #[serde(skip)]
    pub anchor: String,
    /// Its place; of a rung of a template, in the template.
    #[serde(flatten)]
    pub place: FileLine,
    /// The block or Stage at whose end the termination pass resets what it drove.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reset_at_end_of: Option<String>,
}

/// A contact or an instruction that reads.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ReadPlace {
    /// It, as it is written.
    pub text: String,
    /// Its rung.
    pub rung: String,
    /// The rung in a page: its block or Stage, and its number.
    #[serde(skip)]
    pub anchor: String,
    /// Its place.
    #[serde(flatten)]
    pub place: FileLine,
}

/// A part of the controller file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct OutsideUse {
    /// What it is and does: `device line1 moves it`.
    pub text: String,
    /// Whether it may write the operand.
    pub writes: bool,
    /// Its place.
    #[serde(flatten)]
    pub place: Option<FileLine>,
}

/// A part of a test file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TestPlace {
    /// The test; `None`: `always`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub test: Option<String>,
    /// The step or condition as it is written.
    pub text: String,
    /// Its place.
    #[serde(flatten)]
    pub place: FileLine,
}
