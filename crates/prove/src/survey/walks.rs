//! Walks: runs of the whole model with inputs that change at random, before anything is deduced.
//!
//! Called by `survey` and `mistake`. Most of what can be in a ladder is seen in a second, for all
//! facts at once. A fact that a walk has shown needs no search. The random numbers are the same on
//! every machine, and what a walk shows was executed by the engine from a cold start.

use rungd_base::random::SplitMix64;
use rungd_engine::EngineState;

use crate::model::{Path, ProofModel, Run};

/// The number of operations that all walks of a survey execute together, about.
pub(crate) const SURVEY_OPERATIONS: u64 = 40_000_000;
/// The least and the greatest number of scans of all walks.
const SCANS: [u64; 2] = [2_000, 60_000];
/// The lengths of walks, in scans.
const LENGTHS: [u64; 4] = [20, 100, 500, 3_000];
/// The attempts to find inputs that are allowed.
const ATTEMPTS: usize = 16;

/// The paths to the judged bits that walks have seen ON, by their numbers. `operations`: the number
/// that all walks execute together, about.
pub(crate) fn walks(
    model: &ProofModel,
    operations: u64,
    is_given_up: &dyn Fn() -> bool,
) -> Vec<Option<Path>> {
    let of_scan: u64 = model.code.tables.batches.iter().map(|batch| u64::from(batch.count)).sum();
    let mut left = (operations / u64::max(of_scan, 1)).clamp(SCANS[0], SCANS[1]);
    let mut found = vec![None; model.judged.len()];
    let mut number = 0;
    while left > 0 && !is_given_up() && found.iter().any(Option::is_none) {
        let length = LENGTHS[(number % LENGTHS.len() as u64) as usize].min(left);
        left -= length;
        InputWalk::new(model, number).run(length, &mut found);
        number += 1;
    }
    found
}

struct InputWalk<'m> {
    run: Run<'m>,
    random: SplitMix64,
    inputs: Vec<i32>,
    /// An input changes before a scan with the probability 1 to 2 to the power of this.
    stillness: u32,
    path: Path,
}

impl<'m> InputWalk<'m> {
    fn new(model: &'m ProofModel, number: u64) -> InputWalk<'m> {
        let inputs = model.resting();
        let random = SplitMix64(number);
        let stillness = 1 + (number / LENGTHS.len() as u64 % 8) as u32;
        InputWalk { run: Run::new(model), random, inputs, stillness, path: Path::default() }
    }

    /// Executes scans; notes the bits that are ON for the first time.
    fn run(mut self, length: u64, found: &mut [Option<Path>]) {
        for _ in 0..length {
            let Some(outcome) = self.scan() else { return };
            for (found, is_on) in found.iter_mut().zip(&outcome.judged) {
                if *is_on && found.is_none() {
                    *found = Some(self.path.clone());
                }
            }
            if outcome.is_last {
                return;
            }
        }
    }

    /// A scan with inputs that are allowed; `None`: none were found.
    fn scan(&mut self) -> Option<crate::model::ScanOutcome> {
        let is_free = self.run.model().assumed.is_empty();
        let before = (!is_free).then(|| EngineState::of(&self.run.engine));
        for _ in 0..ATTEMPTS {
            let last = self.inputs.clone();
            self.change();
            let outcome = self.run.scan(&self.inputs);
            if outcome.is_allowed {
                self.path.scans.push(self.inputs.clone());
                return Some(outcome);
            }
            self.inputs = last;
            self.run.scans -= 1;
            if !before.as_ref().is_some_and(|before| self.run.engine.resume(before)) {
                return None;
            }
        }
        None
    }

    fn change(&mut self) {
        for (value, input) in self.inputs.iter_mut().zip(&self.run.model().inputs) {
            let random = self.random.next();
            if random & ((1 << self.stillness) - 1) != 0 {
                continue;
            }
            let span = (i64::from(input.high) - i64::from(input.low)).unsigned_abs();
            // The ends of the range, small numbers, or any.
            let offset = match (random >> 32) % 4 {
                _ if span == 1 => u64::from(*value == input.low),
                0 => 0,
                1 => span,
                2 => i64::from(input.low).min(0).unsigned_abs() + self.random.next() % 128,
                _ => self.random.next() % (span + 1),
            };
            let moved = i64::from(input.low) + offset.min(span).cast_signed();
            *value = i32::try_from(moved).unwrap_or(input.high);
        }
    }
}
