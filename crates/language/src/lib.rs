//! The language of ladders: from a file's text to a checked program, and on to the operations of
//! the engine.
//!
//! [`source`] reads TOML with the place of every value, [`resolve`] turns names into addresses,
//! [`check`] judges the whole program, [`lower`] makes the engine's program and the names for
//! people. [`mod@format`] is the one layout of files. All of it is pure: no file is read, nothing
//! is logged, and no text from outside causes a panic. Mistakes of authors are findings
//! ([`source::finding`]).

pub mod check;
pub mod format;
pub mod lower;
pub mod resolve;
pub mod source;
