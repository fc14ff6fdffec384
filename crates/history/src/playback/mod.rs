//! Plays recordings: executes the recorded calls of a program again, on the program that its
//! recorded files make.
//!
//! `record` reads sections and knows no ladders; `load` makes programs and knows no recordings.
//! This module joins the two, and hands the past to `observe`. Used by `cli`, `editor` and `live`.

mod recorded;

pub use recorded::{RecordedPast, RecordedRun, loaded, run_of, subject};
