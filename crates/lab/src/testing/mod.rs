//! Tests of ladders: runs test files and their scenarios in virtual time, and makes a test from a
//! recording.
//!
//! `cli` passes paths of test files, or sections of a recording. `reading` makes a [`Suite`] from a
//! file; `runner` runs it; `mutation` measures its quality. Nothing here reads a clock.

mod asked;
mod change_schedule;
mod condition;
mod condition_sides;
#[cfg(test)]
mod condition_tests;
mod coverage;
mod device_names;
mod failure;
mod formats;
mod given;
mod happened;
mod history;
mod interlock;
mod joint;
mod judge;
mod lowered_suite;
mod mutants;
mod mutation;
mod names;
#[cfg(test)]
mod observer_tests;
mod operand_access;
mod pasted;
mod pin;
mod player;
mod programs;
mod proof_run;
mod proving;
mod random;
mod random_run;
mod random_world;
mod reading;
#[cfg(test)]
mod reading_tests;
mod reasons;
#[cfg(test)]
mod reasons_tests;
mod report;
mod runner;
mod scenario;
mod shrink;
mod step_forms;
mod step_text;
mod step_words;
mod steps;
#[cfg(test)]
mod stored_stages_tests;
mod suite;
mod touches;
mod traced;
mod unmoved;
mod view;
#[cfg(test)]
mod was_tests;
mod watched;
#[cfg(test)]
mod watched_tests;
mod written;
mod written_prove;

pub use asked::{AskedCondition, asked_suite, ladders_text};
pub use condition::Condition;
pub use coverage::{Coverage, CoverageOptions};
pub use failure::{Failure, SeenChange, SeenOperand};
pub use formats::{FileVerdicts, json, junit};
pub use joint::{FailingTest, JudgedMutant, of_one_ladder};
pub use mutants::{MutantKind, RungIndex};
pub use mutation::{
    JudgedLadder, MutateOptions, MutationProgress, UnnoticedMutant, first_failure, mutate,
};
pub use pin::{Pin, pinned};
pub use proof_run::{FoundRun, TriedRun, run_text, try_end, try_run, try_violation};
pub use reading::{ReadSuite, read_among, read_suite, read_text};
pub use report::time_text;
pub use runner::{RunOptions, TestVerdict, programs, run};
pub use scenario::{ScenarioOf, scenario};
pub use step_forms::{FORMS as STEP_FORMS, StepForm, StepNames, step_form};
pub use suite::{
    Chance, FreeOperand, Incident, ProgramId, ProofSettings, RandomChange, RandomIncident,
    RandomMotion, RandomTest, Reload, Scenario, Suite, TestOperand, TestProgram, TestStep,
    TestTime,
};
pub use touches::{TestTouch, touches};
pub use traced::{TracedScan, trace};
pub use unmoved::UnmovedNames;
pub use view::View;
pub use watched::{DecidingOperand, WatchedLines, line_judge};
pub use written::shape;
pub use written_prove::ProofEvent;
