//! Plays recordings: executes the recorded calls of a program again, on the program that its
//! recorded files make.
//!
//! `record` reads sections and knows no ladders; `load` makes programs and knows no recordings.
//! This module joins the two, and hands the past to `observe`. Used by `cli`, `editor` and `live`.

mod programs;
mod recorded;
mod replay;
mod twin_run;

pub use programs::{PlayableProgram, RecordedPrograms};
pub use recorded::{RecordedPast, loaded, subject, subject_and_settings, whole_program};
pub use replay::{MakeEngine, Playback, PlayedScan, PlayedStep, Unplayable, Verified};
pub use twin_run::{TwinRun, TwinScan};
