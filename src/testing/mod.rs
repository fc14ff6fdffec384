//! Tests of ladders: test files and their scenarios in virtual time; and a test made of a
//! recording.
//!
//! `cli` hands over paths of test files, or sections of a recording. No clock.

mod condition;
mod happened;
mod mutants;
mod scenario;
mod suite;

pub use condition::Condition;
pub use mutants::{Mutant, MutantKind, mutants};
pub use scenario::{ScenarioOf, scenario};
pub use suite::{
    Chance, Operand, ProgramId, RandomChange, RandomMotion, RandomTest, Reload, Scenario, Step,
    Suite, TestProgram, TestTime,
};
