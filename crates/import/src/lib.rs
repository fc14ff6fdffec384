//! Other people's programs as ladders: a reader of each foreign form makes one
//! [`model::ForeignProject`], and one writer makes the files of a rungd project of it.
//!
//! Called by `rungd import`, and by the commands that take a foreign file in place of a ladder.
//! A reader decides what a foreign instruction means, and says so in steps: contacts and
//! instructions of rungd. [`rungs`] makes rungs of steps, [`mod@write`] the text. Nothing here
//! reads or writes files, and nothing executes.

pub mod click;
pub mod condition;
mod csv;
pub mod domore;
pub mod l5x;
pub mod model;
pub mod names;
pub mod plcopen;
pub mod report;
pub mod rungs;
pub mod write;
mod xml_document;
