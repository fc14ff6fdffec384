//! CLICK ladders: the CSV form of a ladder, as ClickNick and laddercodec write it.
//!
//! [`read`] makes a project of the text of a file. `sheet` has its rungs, `grid` the power at each
//! row, `operand` the addresses, `nicknames` their names, `calls` and `timers` what the
//! instructions mean; `project` puts the parts together. What is exact and what differs stands in
//! `docs/import/click.md`.

mod address;
mod calls;
mod dispatch;
mod grid;
mod nicknames;
mod operand;
mod project;
mod sheet;
mod timers;
mod work;

use crate::model::ForeignProject;
use nicknames::ClickNicknames;

/// The project of a CLICK ladder.
///
/// # Errors
/// The text is no CLICK ladder; the reason has the line.
pub fn read(text: &str) -> Result<ForeignProject, String> {
    let rungs = sheet::rungs(text.trim_start_matches('\u{feff}'))?;
    Ok(project::project(&rungs, ClickNicknames::default()))
}

/// The project of a CLICK ladder, with the names, comments and initial values of a nickname file.
///
/// # Errors
/// The text is no CLICK ladder, or the other one no nickname file; the reason has the line.
pub fn read_named(text: &str, nicknames: &str) -> Result<ForeignProject, String> {
    let rungs = sheet::rungs(text.trim_start_matches('\u{feff}'))?;
    let nicknames = ClickNicknames::read(nicknames).map_err(|why| format!("nicknames: {why}"))?;
    Ok(project::project(&rungs, nicknames))
}
