//! The element documentation of Do-more Designer: nicknames, extra info and descriptions of its
//! elements, as it exports and imports them.
//!
//! [`read`] makes a project of such a file, whose ladder has its tags; [`documentation`] makes the
//! file of the tags of a ladder. A Do-more's elements have the addresses of rungd.

mod export;
mod form;
mod import;

pub use export::{ElementDocumentation, documentation};
pub use form::is_documentation;
pub use import::read;
