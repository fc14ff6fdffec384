//! The language server: what an editor shows and changes in ladders, controller files and tests.
//!
//! `cli::lsp` calls [`serve`]. A text becomes an `outline` and `words`, however broken it is; the
//! words of a project's files become `names`; answers are made of these at once. Findings are made
//! beside, by `judge`, from the same functions as `rungd check`. No clock.

mod capabilities;
mod complete;
mod diagnostics;
mod edits;
mod file;
mod formatting;
mod judge;
mod lines;
mod names;
mod navigate;
mod outline;
mod outline_reader;
mod project;
mod rename;
mod requests;
mod server;
mod slots;
mod symbols;
mod uri;
mod words;
mod workspace;

pub use server::serve;
