//! The language server: editor support for ladders, controller files and tests.
//!
//! `cli::lsp` calls [`serve`]. Every text, even a broken one, is read into an `outline` and
//! `words`; the words of a project's files are resolved to `names`. Requests are answered from
//! these at once. `judge` produces the findings on its own thread, with the same functions as
//! `rungd check`. Only `live_poller` reads a clock.
//!
//! # The way of an edit
//!
//! ```text
//!  editor ─► server ─► edits ─► text ─► judge (a thread): load, testing ─► diagnostics
//!               │                 │
//!               │                 └─► outline ─► words ─► names of the project ─► complete,
//!               │                     (none of them can fail)        hover, navigate, rename, …
//!               └─► jobs (threads): test, simulate, why, how
//!                   live (a thread): the operator's socket, read only
//! ```
//!
//! While somebody types, the text is mostly not TOML. So answers about names are made from an
//! outline of tables and strings and from the words in them, which every text has; only findings
//! need a whole load, the one of `rungd check`. Before a change (a rename, a correction) is
//! offered, it is tried on the texts and checked again. `correction` does the same without an
//! editor, for `rungd check --fix`.

mod actions;
mod capabilities;
mod commands;
mod compared;
mod complete;
mod correction;
mod device_sides;
mod diagnostics;
mod disk;
mod edits;
mod file;
mod fixes;
mod formatting;
mod hints;
mod hover;
#[cfg(feature = "prove")]
mod how_job;
mod jobs;
mod judge;
mod lenses;
mod lines;
mod live_poller;
mod live_targets;
mod live_view;
mod names;
mod navigate;
mod operands;
mod outbox;
mod outline;
mod outline_reader;
mod project;
mod rename;
mod requests;
mod scratch;
mod server;
mod simulate_job;
mod slots;
#[cfg(feature = "prove")]
mod survey_hints;
#[cfg(feature = "prove")]
mod survey_job;
mod symbols;
mod tag_facts;
mod test_job;
mod test_results;
mod tokens;
mod uri;
mod why_job;
mod wire;
mod words;
mod workspace;

pub use correction::{Corrected, CorrectedFile, correct};
pub use server::{EditorEnd, serve};
pub use wire::EditorConnection;
