//! The cross-reference as data. Its JSON has the same names.

use serde::Serialize;

use rungd_history::observe::Place;

/// All uses of an operand. Lists are in the order of files and places.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct CrossReference {
    /// Its tag, or the requested name.
    pub name: String,
    /// Its address, if it has a tag with an address; for a constant its value, such as `3`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub address: Option<String>,
    /// The tag's `doc`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub doc: Option<String>,
    /// The line that declares its name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub declared: Option<FileLine>,
    /// The lines of the ladder that name a constant.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub constants: Vec<FileLine>,
    /// The instructions that write it.
    pub written: Vec<WritePlace>,
    /// The blocks whose start and end write it, if it is a bit of a Stage or block.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub turned: Vec<String>,
    /// The contacts and instructions that read it.
    pub read: Vec<ReadPlace>,
    /// The CALLs of a subroutine.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub called: Vec<ReadPlace>,
    /// Its uses in the controller file.
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

/// An instruction that writes the operand.
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
    /// Its place; for a rung of a template, in the template.
    #[serde(flatten)]
    pub place: FileLine,
    /// The block or Stage whose termination pass resets what the instruction has driven.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reset_at_end_of: Option<String>,
}

/// A contact or an instruction that reads the operand.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ReadPlace {
    /// The contact or instruction as it is written.
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
    /// The part and its use of the operand: `device line1 moves it`.
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
    /// The test; `None`: `always`, or the observer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub test: Option<String>,
    /// Whether it is a rung of the observer.
    #[serde(skip)]
    pub is_of_observer: bool,
    /// The step or condition as it is written.
    pub text: String,
    /// Its place.
    #[serde(flatten)]
    pub place: FileLine,
}
