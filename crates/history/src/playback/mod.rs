//! Plays recordings: executes the recorded calls of a program again, on the program that its
//! recorded files make.
//!
//! `record` reads sections and knows no ladders; `load` makes programs and knows no recordings.
//! This module joins the two, and hands the past to `observe`. Used by `cli`, `editor` and `live`.

mod alarm_follower;
mod alarm_history;
mod alarm_log;
mod alarm_playback;
mod compared;
mod followed_alarm;
mod moment;
mod programs;
mod recorded;
mod replay;
mod twin_run;

pub use alarm_history::{AlarmFigures, AlarmHistory, AlarmSpan, SpanBegin, SpanEnd};
pub use alarm_log::{AlarmLog, AlarmStretch};
pub use compared::{ComparedAs, ComparedOperand, FirstDifference, ProgramComparison};
pub use followed_alarm::{LineJudge, MakeJudge};
pub use moment::{MomentScan, RecordedMoment, moment};
pub use programs::{PlacedProgram, PlayableProgram, RecordedPrograms};
pub use recorded::{RecordedQuestion, loaded, subject, subject_and_settings, whole_program, why};
pub use replay::{
    MakeEngine, Playback, PlayedEngine, PlayedScan, PlayedStep, Unplayable, Verified,
};
pub use twin_run::{TwinRun, TwinScan};
