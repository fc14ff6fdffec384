//! Exploring: visits every state that a model can reach, breadth first, on the engine itself.
//!
//! `rungd prove` calls [`explore`] for each line. It makes the line's cone, and from each state of
//! a depth executes one scan with each combination of the inputs that matter there (`branches`). So the first scan that meets the
//! target is at the end of a shortest path; and where no new state is found, every state was seen.
//! What counts as one state is said in `form`, and there and in its parts stands why states that
//! count as one have the same future.

mod branches;
mod bytes;
mod caps;
mod effects;
mod elements;
mod form;
mod keys;
mod live;
mod search;
mod trace;

use std::time::Instant;

use crate::cone::{cone, split};
use crate::model::{Model, Path, Target};
use branches::Inputs;
use search::Search;

/// When to stop without an answer.
#[derive(Clone, Copy)]
pub struct ExploreLimits<'s> {
    /// The memory that all states may take together, bytes.
    pub memory: usize,
    /// The greatest number of combinations of inputs that a state may need.
    pub combinations: u64,
    /// The number of threads.
    pub threads: usize,
    /// The time to stop at.
    pub deadline: Option<Instant>,
    /// Whether the answer is no longer wanted.
    pub stop: &'s (dyn Fn() -> bool + Sync),
    /// The greatest number of states.
    pub states: Option<u64>,
    /// The greatest number of scans.
    pub depth: Option<u64>,
}

/// The number of combinations from which on the inputs that matter are found by tracing scans: a
/// traced scan takes several times as long, and saves others.
const TRACED_MIN: u64 = 16;

/// What exploring found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Explored {
    /// Every state that can be reached was visited. No scan meets the target.
    All {
        /// The number of states, at the ends of scans.
        states: u64,
        /// The number of scans after which the last new one was reached.
        depth: u64,
    },
    /// A shortest path to the target. Of all shortest ones, the threads do not decide which.
    Found(Path),
    /// Not all states were visited. No scan up to `depth` meets the target.
    Stopped {
        /// The number of states that were found.
        states: u64,
        /// The number of scans that every path was followed.
        depth: u64,
        /// Why.
        cause: StopCause,
    },
}

/// Why a search stopped without an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopCause {
    /// A state needs more combinations of inputs than allowed.
    Combinations,
    /// The states take more memory than allowed.
    Memory,
    /// The time is over.
    Time,
    /// There are more states, or more scans, than allowed.
    Limit,
    /// Another thread has asked for it.
    Asked,
}

impl StopCause {
    /// The cause for people.
    pub fn text(self) -> &'static str {
        match self {
            StopCause::Combinations => "the inputs have too many values to try all",
            StopCause::Memory => "the states take more memory than allowed",
            StopCause::Time => "the time is over",
            StopCause::Limit => "`states` or `depth` of `[prove]` is reached",
            StopCause::Asked => "the answer was no longer wanted",
        }
    }
}

/// Looks for a scan that meets the target. The path is one of `model`.
pub fn explore(model: &Model, target: Target, limits: &ExploreLimits) -> Explored {
    explore_traced(model, target, limits, TRACED_MIN)
}

/// Does the same; traces scans from a number of combinations on.
pub fn explore_traced(
    model: &Model,
    target: Target,
    limits: &ExploreLimits,
    traced_min: u64,
) -> Explored {
    let mut cone = cone(model, &[target.bit]);
    let Some(inputs) = Inputs::new(&cone.model, target) else {
        let cause = StopCause::Combinations;
        return Explored::Stopped { states: 0, depth: 0, cause };
    };
    let traces = inputs.usual() >= traced_min;
    if traces {
        cone.model.code = split(&cone.model.code);
    }
    match Search::new(&cone.model, target, inputs, traces).run(limits) {
        Explored::Found(path) => Explored::Found(cone.widened(&path)),
        ended @ (Explored::All { .. } | Explored::Stopped { .. }) => ended,
    }
}
