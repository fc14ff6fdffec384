//! From every state that can be reached: does some sequence of inputs lead to the target?
//!
//! `rungd prove` asks it for the lines of `can`. All states are visited as in `search`, by one
//! thread, with the scans between them; then the states are marked from which a scan that meets the
//! target can be reached, from the target backwards. A state that stays unmarked is the answer.

use std::collections::HashMap;

use super::keys::key;
use super::limits::{ExploreLimits, StopCause};
use super::search::{ScanResult, StateScanner, StateSearch, Step};
use crate::model::Path;

/// The answer about a line of `can`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Attained {
    /// From every state some inputs lead there; the number of states.
    Everywhere(u64),
    /// From the end of this path nothing leads there.
    NotFrom(Path),
    /// Not all states were visited.
    Stopped {
        /// The number of states that were found.
        states: u64,
        /// Why.
        cause: StopCause,
    },
}

/// All states, with the scans between them. State 0 is the one before the first scan.
struct StateGraph {
    size: usize,
    bytes: Vec<u8>,
    numbers: HashMap<u128, u32>,
    /// By state, the start left out: the scan that has found it.
    steps: Vec<Step>,
    /// From one state to another.
    scans: Vec<(u32, u32)>,
    /// By state: whether a scan that begins with it meets the target.
    meets: Vec<bool>,
}

impl StateGraph {
    fn count(&self) -> usize {
        self.meets.len()
    }

    fn state(&self, at: usize) -> Option<&[u8]> {
        let first = at.checked_sub(1)? * self.size;
        Some(&self.bytes[first..first + self.size])
    }

    fn memory(&self) -> usize {
        self.bytes.len() + self.count() * 64 + self.scans.len() * 8
    }

    /// Adds a scan to a state, whose bytes are the last ones. Only an ordinary scan is on a way.
    fn add(&mut self, step: Step, before: usize, is_ordinary: bool) {
        let (next, key) = (self.count() as u32, key(&self.bytes[before..]));
        let number = *self.numbers.entry(key).or_insert(next);
        if is_ordinary {
            self.scans.push((step.from, number));
        }
        if number == next {
            self.steps.push(step);
            self.meets.push(false);
        } else {
            self.bytes.truncate(before);
        }
    }

    /// The first state from which no scan that meets the target can be reached.
    fn lost(mut self) -> Option<usize> {
        self.scans.sort_unstable_by_key(|(_, to)| *to);
        let mut open: Vec<u32> =
            (0..self.count() as u32).filter(|at| self.meets[*at as usize]).collect();
        while let Some(to) = open.pop() {
            let first = self.scans.partition_point(|(_, other)| *other < to);
            let into = self.scans[first..].iter().take_while(|(_, other)| *other == to);
            for (from, _) in into {
                if !std::mem::replace(&mut self.meets[*from as usize], true) {
                    open.push(*from);
                }
            }
        }
        self.meets.iter().position(|meets| !meets)
    }
}

/// Visits all states, and marks those from which the target can be reached.
pub(super) fn attain(search: &StateSearch, limits: &ExploreLimits) -> Attained {
    let mut graph = StateGraph {
        size: search.state_size(),
        bytes: Vec::new(),
        numbers: HashMap::new(),
        steps: Vec::new(),
        scans: Vec::new(),
        meets: vec![false],
    };
    let mut scanner = StateScanner::new(search);
    let mut at = 0;
    while at < graph.count() {
        let stopped = follow(&mut scanner, &mut graph, at, limits);
        if let Some(cause) = stopped.or_else(|| limits.reached(graph.count(), graph.memory())) {
            return Attained::Stopped { states: graph.count() as u64, cause };
        }
        at += 1;
    }
    let (states, steps) = (graph.count() as u64 - 1, std::mem::take(&mut graph.steps));
    match graph.lost() {
        None => Attained::Everywhere(states),
        Some(lost) => Attained::NotFrom(path(search, &steps, lost)),
    }
}

/// Executes the scans that begin with a state.
fn follow(
    scanner: &mut StateScanner,
    graph: &mut StateGraph,
    at: usize,
    limits: &ExploreLimits,
) -> Option<StopCause> {
    let mut combinations = limits.combinations;
    loop {
        let step = scanner.step(at as u32);
        let ended = scanner.scan(graph.state(at));
        let is_ordinary = scanner.was_ordinary();
        graph.meets[at] |= ended == ScanResult::Met && is_ordinary;
        let continues = match ended {
            ScanResult::Refused | ScanResult::Last => false,
            ScanResult::Met => !scanner.was_last,
            ScanResult::Followed => true,
        };
        if continues {
            let before = graph.bytes.len();
            scanner.save(&mut graph.bytes);
            graph.add(step, before, is_ordinary);
        }
        if !scanner.advance() {
            return None;
        }
        combinations -= 1;
        if combinations == 0 {
            return Some(StopCause::Combinations);
        }
    }
}

fn path(search: &StateSearch, steps: &[Step], state: usize) -> Path {
    let (mut scans, mut at) = (Vec::new(), state);
    while let Some(before) = at.checked_sub(1) {
        let Step { from, inputs } = steps[before];
        scans.push(search.unpack(inputs));
        at = from as usize;
    }
    scans.reverse();
    Path { scans }
}
