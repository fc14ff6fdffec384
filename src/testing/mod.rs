//! Tests of ladders: test files and their scenarios in virtual time; and a test made of a
//! recording.
//!
//! `cli` hands over paths of test files, or sections of a recording. No clock.

mod condition;
mod coverage;
mod failure;
mod formats;
mod happened;
mod history;
mod mutants;
mod mutation;
mod pasted;
mod player;
mod random_run;
mod report;
mod runner;
mod scenario;
mod shrink;
mod suite;
mod traced;

pub use condition::Condition;
pub use coverage::Coverage;
pub use failure::{Failure, SeenChange, SeenOperand};
pub use formats::{FileVerdicts, json, junit};
pub use mutants::{Mutant, MutantKind, mutants};
pub use mutation::{JudgedMutant, MutateOptions, first_failure, mutate};
pub use runner::{RunOptions, Verdict, programs, run};
pub use scenario::{ScenarioOf, scenario};
pub use suite::{
    Chance, Operand, ProgramId, RandomChange, RandomMotion, RandomTest, Reload, Scenario, Step,
    Suite, TestProgram, TestTime,
};
pub use traced::trace;
