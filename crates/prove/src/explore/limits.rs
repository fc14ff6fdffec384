//! When exploring stops, and what it has found by then.
//!
//! The callers of `explore` give and read these; `search` obeys them.

use std::time::Instant;

use crate::model::{Path, UNEVEN_PERIOD};

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
    /// The greatest number of scans of a path.
    pub depth: Option<u64>,
    /// The greatest number of scans that are executed; obeyed by one thread alone.
    pub scans: Option<u64>,
}

impl ExploreLimits<'_> {
    /// The cause to stop after this number of states, which take this memory.
    pub(super) fn reached(&self, states: usize, memory: usize) -> Option<StopCause> {
        if self.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            return Some(StopCause::Time);
        }
        if memory > self.memory {
            return Some(StopCause::Memory);
        }
        if self.states.is_some_and(|most| states as u64 > most) {
            return Some(StopCause::Limit);
        }
        (self.stop)().then_some(StopCause::Asked)
    }
}

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
    /// The period is no number of whole milliseconds.
    Period,
    /// A state needs more combinations of inputs than allowed.
    Combinations,
    /// The states take more memory than allowed.
    Memory,
    /// The time is over.
    Time,
    /// There are more states, or more scans, than allowed.
    Limit,
    /// As many scans were executed as allowed.
    Scans,
    /// Another thread has asked for it.
    Asked,
}

impl StopCause {
    /// The cause for people.
    pub fn text(self) -> &'static str {
        match self {
            StopCause::Period => UNEVEN_PERIOD,
            StopCause::Combinations => "the inputs have too many values to try all",
            StopCause::Memory => "the states take more memory than allowed",
            StopCause::Time => "the time is over",
            StopCause::Limit => "`states` or `depth` of `[prove]` is reached",
            StopCause::Scans => "as many scans were executed as a survey allows",
            StopCause::Asked => "the answer was no longer wanted",
        }
    }
}
