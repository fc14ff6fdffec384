//! Where and when: the operands, places, rungs and scans that an answer to `why` names.
//!
//! Types only, with their forms as JSON; part of [`super::answer`].

use std::sync::Arc;

use serde::{Serialize, Serializer};

use rungd_engine::Cell;
use rungd_language::resolve::value_texts::ValueTexts;

/// A scan and its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct When {
    /// Its number; the first of a process is 1. `None` before the first scan.
    pub scan: Option<u64>,
    /// Its timestamp, monotonic.
    #[serde(skip)]
    pub now_ns: u64,
    /// The same as ns since 1970 (UTC).
    pub unix_ns: i64,
}

/// When something happened last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Since {
    /// In this scan.
    At(When),
    /// Before this scan, or never: the tape begins there, or the search ended there.
    Before(When),
}

/// A bit or word.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct OperandName {
    /// Its cell.
    #[serde(skip)]
    pub cell: Cell,
    /// Its tag, or else its address, nickname, Stage or block.
    pub name: String,
    /// Its address, if it has a tag.
    pub address: Option<String>,
    /// The tag's `doc`.
    pub doc: Option<String>,
    /// Whether it is a bit.
    #[serde(skip)]
    pub is_bit: bool,
    /// Whether it holds a real.
    #[serde(skip)]
    pub is_real: bool,
    /// Whether it is a time in ms.
    #[serde(skip)]
    pub is_time: bool,
    /// The texts of its values.
    #[serde(skip)]
    pub texts: Option<Arc<ValueTexts>>,
}

/// A place in a file, with its text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Place {
    /// The file as it was given.
    pub file: String,
    /// The line, from 1.
    pub line: u32,
    /// The first byte.
    pub start: u32,
    /// The byte after the last one.
    pub end: u32,
    /// The text.
    pub text: String,
}

/// A block or Stage.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct BlockPlace {
    /// Its name; for a Stage, with the name of its Program.
    pub name: String,
    /// The place of its name.
    pub place: Place,
}

/// Writes the name of a block or Stage alone.
fn element_name<S: Serializer>(element: &BlockPlace, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(&element.name)
}

/// A rung, or a branch of one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RungName {
    /// Its block or Stage.
    #[serde(rename = "in", serialize_with = "element_name")]
    pub element: BlockPlace,
    /// The rung for people: its name, or its number and the use that it belongs to.
    #[serde(skip)]
    pub label: String,
    /// Its name.
    pub name: Option<String>,
    /// Its number in the block or Stage, from 1.
    pub number: u32,
    /// The number of the branch, from 1.
    pub branch: Option<u32>,
}

/// A CALL that executed a subroutine.
#[derive(Clone, Debug, PartialEq)]
pub struct CallPlace {
    /// Its rung.
    pub rung: RungName,
    /// Its place and text.
    pub place: Place,
}
