//! The question whether two ladders are equal, its parts, and its answer; plain data.
//!
//! `equal` asks and answers, `equal_difference` tries what was found.

use crate::answer::Way;
use crate::decide::DecideLimits;
use crate::events::DownTime;
use crate::model::FreeInput;
use crate::named_input::NamedInput;
use rungd_engine::isa::Address;
use rungd_lab::testing::{Failure, ProofEvent, Suite};

/// Two ladders, and which of their names belong together.
pub struct EqualQuestion<'a> {
    /// The ladder that is known.
    pub old: &'a Suite,
    /// The ladder that should do the same.
    pub new: &'a Suite,
    /// Names of the old ladder that the new one calls differently.
    pub map: &'a [(String, String)],
    /// More bits and words that must be equal, by their names in the old ladder.
    pub also: &'a [String],
    /// Outputs that are not compared.
    pub except: &'a [String],
    /// What may happen to both controllers at once: power cuts, restarts and stops.
    pub events: &'a [ProofEvent],
    /// The limits of the answer.
    pub limits: DecideLimits,
}

/// Whether two ladders are equal.
#[derive(Clone, Debug)]
pub enum EqualAnswer {
    /// They are, for every sequence of inputs: how it was proved, and what was compared.
    Equal(Way, Vec<String>),
    /// They are not.
    Different(Box<LadderDifference>),
    /// Neither: what stood in the way, and what was looked at.
    NotDecided(Vec<String>, Vec<String>),
}

/// Two ladders that are different.
#[derive(Clone, Debug)]
pub struct LadderDifference {
    /// The scan, from 1.
    pub scan: u64,
    /// The outputs that differ: the name, the old and the new value.
    pub outputs: Vec<DifferentOutput>,
    /// The scenario: it passes on the old ladder and fails on the new one.
    pub scenario: String,
    /// Why it fails on the new one.
    pub failure: Option<Box<Failure>>,
}

/// An output that differs.
#[derive(Clone, Debug)]
pub struct DifferentOutput {
    /// Its name in the old ladder.
    pub name: String,
    /// The value that the old ladder gives it.
    pub old: String,
    /// The value that the new ladder gives it.
    pub new: String,
}

/// An output of both ladders.
pub(crate) struct OutputPair {
    pub name: String,
    pub old: Address,
    /// In the memory of both.
    pub new: Address,
    /// In the new ladder by itself.
    pub alone: Address,
}

/// An input of both ladders, or of one.
pub(crate) struct SharedInput {
    pub input: FreeInput,
    /// How a test of the old ladder sets it, and one of the new ladder.
    pub named: [Option<NamedInput>; 2],
}

impl SharedInput {
    /// The time without a process: the step of its event says it.
    pub fn down(down: DownTime) -> SharedInput {
        SharedInput { input: down.input(), named: [None, None] }
    }
}
