//! PLCopen XML (TC6 2.01): ladders and charts, as OpenPLC, Beremiz and CODESYS write them.
//!
//! [`read`] makes a project of the text of a file. `document` has what the file says, `graph` the
//! parts of a ladder body and in which order they act, `memory` where the variables lie, `passes`
//! what a body does, `sfc` what a chart does, `project` puts the parts together. What is exact and
//! what differs stands in `docs/import/plcopen.md`.

mod addresses;
mod block_calls;
mod body;
mod calculations;
mod conversions;
mod dispatch;
mod document;
mod elements;
mod feedback;
mod finish;
mod formula;
mod functions;
mod graph;
mod initial;
mod literals;
mod memory;
mod networks;
mod passes;
mod power;
mod project;
mod rung_names;
mod sfc;
mod sfc_actions;
mod sfc_condition;
mod sfc_elements;
mod sfc_links;
mod sfc_qualifiers;
mod sfc_steps;
mod sfc_text;
mod sfc_transitions;
mod sfc_work;
mod statements;
mod tasks;
mod types;
mod unit_calls;
mod units;
mod xml;

use crate::model::ForeignProject;

/// Whether a text is a PLCopen file.
pub fn is_plcopen(text: &str) -> bool {
    let head: String = text.chars().take(4096).collect();
    head.contains("plcopen.org/xml/tc6")
}

/// The project of a PLCopen file.
///
/// # Errors
/// The text is no XML, or no PLCopen project; the reason has the place.
pub fn read(text: &str) -> Result<ForeignProject, String> {
    let file = document::read(text.trim_start_matches('\u{feff}'))?;
    Ok(project::project(&file))
}
