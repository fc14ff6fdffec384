//! CLICK ladders: the CSV form of a ladder, as ClickNick and laddercodec write it.
//!
//! [`read`] makes a project of the text of a file. `sheet` has its rungs, `grid` the power at each
//! row, `operand` the addresses, `calls` and `timers` what the instructions mean; `project` puts
//! the parts together. What is exact and what differs stands in `docs/import/click.md`.

mod calls;
mod dispatch;
mod grid;
mod operand;
mod project;
mod sheet;
mod timers;
mod work;

use crate::model::ForeignProject;

/// The project of a CLICK ladder.
///
/// # Errors
/// The text is no CLICK ladder; the reason has the line.
pub fn read(text: &str) -> Result<ForeignProject, String> {
    let rungs = sheet::rungs(text.trim_start_matches('\u{feff}'))?;
    Ok(project::project(&rungs))
}
