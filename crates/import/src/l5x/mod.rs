//! Rockwell's L5X: controllers, programs, routines and Add-On Instructions of Logix.
//!
//! [`read`] makes a project of the text of a file. `document` has what the file says, `memory`
//! where its tags lie, `translate` what its instructions mean, and `project` puts the parts
//! together. What is exact and what differs stands in `docs/import/l5x.md`.

mod call_book;
mod calls;
mod coils;
mod contacts;
mod data;
mod document;
mod expression;
mod files;
mod formula;
mod initial;
mod inputs;
mod learned;
mod locate;
mod memory;
mod numbers;
mod operators;
mod own_instruction;
mod path;
mod pid;
mod prescan;
mod project;
mod rll;
mod routine;
mod structures;
mod system_values;
mod tasks;
mod texts;
mod translate;
mod types;
mod undeclared;
mod walk;

use crate::model::ForeignProject;

/// Whether a text is an L5X file.
pub fn is_l5x(text: &str) -> bool {
    let head: String = text.chars().take(4096).collect();
    head.contains("<RSLogix5000Content")
}

/// The project of an L5X file.
///
/// # Errors
/// The text is no XML, or no L5X; the reason has the place.
pub fn read(text: &str) -> Result<ForeignProject, String> {
    let file = document::read(text.trim_start_matches('\u{feff}'))?;
    Ok(project::project(&file))
}
