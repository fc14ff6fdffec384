//! The names of the own ladders of field devices: `tank.level` in the map of a plant, and in the
//! steps and conditions of a test.
//!
//! A plant (`driver = "ladder"`) and the own side of a Modbus device (`[[simulated]]`) are no part
//! of the controller's program, so each is a project of its own. `project` makes them;
//! `navigate` and `hover` look the name at a cursor up here.

use std::ops::Range;

use super::names::{Meaning, NameScope};
use super::project::Project;
use super::workspace::Cursor;

/// The declaration in the own ladder of a device that a part of a word means.
pub(super) struct SideName<'p> {
    /// The place of the part.
    pub span: Range<usize>,
    /// The ladder.
    pub project: &'p Project,
    /// The number of the declaration there.
    pub at: usize,
}

/// The declaration in the own ladder of a device that the word at the cursor means.
pub(super) fn at_cursor(cursor: &Cursor) -> Option<SideName<'_>> {
    let word = cursor.word()?;
    let text = cursor.file().slice(word.span.clone());
    let (side, rest) = cursor.project.side(cursor.number, text)?;
    let project = &side.project;
    let scope = NameScope { file: usize::MAX, block: None };
    let parts = project.names.dotted(rest, word.span.end - rest.len(), scope);
    let part = parts
        .into_iter()
        .find(|part| (part.span.start..=part.span.end).contains(&cursor.offset))?;
    let Meaning::Declared(at) = part.meaning else { return None };
    Some(SideName { span: part.span, project, at })
}
