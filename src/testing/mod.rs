//! Tests of ladders: test files and their scenarios in virtual time; and a test made of a
//! recording.
//!
//! `cli` hands over paths of test files, or sections of a recording. No clock.

mod condition;
#[cfg(test)]
mod condition_tests;
mod given;
mod happened;
mod names;
mod programs;
mod quantity;
mod random;
mod reading;
#[cfg(test)]
mod reading_tests;
mod scenario;
mod step_text;
mod step_words;
mod steps;
mod suite;
mod written;

pub use condition::Condition;
pub use reading::{ReadSuite, read_suite};
pub use scenario::{ScenarioOf, scenario};

pub use suite::{
    Chance, Operand, ProgramId, RandomChange, RandomMotion, RandomTest, Reload, Scenario, Step,
    Suite, TestProgram, TestTime,
};
pub(crate) use written::shape;
