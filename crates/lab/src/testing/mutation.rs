//! The quality of a suite: the mutants of its ladder for which it fails.
//!
//! Called by `rungd mutate`. Each mutant replaces the first program of the suite, and the tests run
//! until one fails. Programs of `reload` steps are not changed.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use super::lowered_suite::LoweredSuite;
use super::mutants::{Mutant, MutantKind, mutants};
use super::player::{NoSpectator, play};
use super::random_run;
use super::suite::Suite;
use crate::rig::RigProgram;

/// The maximum number of runs of a random test for each mutant.
const RUNS_MAX: u32 = 10;

/// The options for judging mutants.
pub struct MutateOptions<'a> {
    /// The number of threads; at least 1.
    pub jobs: usize,
    /// The kinds of mutants to judge; empty: all.
    pub kinds: &'a [MutantKind],
    /// Called when a mutant has been judged, with the number of judged mutants and the number of
    /// all mutants.
    pub progress: &'a (dyn Fn(u64, u64) + Sync),
}

/// A mutant, and the first test that failed for it.
#[derive(Clone, Debug)]
pub struct JudgedMutant {
    /// The mutant.
    pub mutant: Mutant,
    /// The name of the test that fails; `None`: it has survived.
    pub killed_by: Option<String>,
}

/// The first test of a suite that fails with its own ladder.
///
/// A suite that fails with its own ladder cannot judge mutants.
pub fn first_failure(suite: &Suite) -> Option<String> {
    let programs = super::runner::programs(suite);
    failing(LoweredSuite { suite, programs: &programs, given_up: None }, u32::MAX)
}

/// Judges the mutants of the suite's ladder, in file order.
pub fn mutate(suite: &Suite, options: &MutateOptions) -> Vec<JudgedMutant> {
    let test_program = &suite.programs[0];
    let mut all =
        mutants(&test_program.program, &test_program.files, test_program.controller.period_ms);
    all.retain(|mutant| options.kinds.is_empty() || options.kinds.contains(&mutant.kind));
    let programs = super::runner::programs(suite);
    let (next, done) = (AtomicUsize::new(0), AtomicU64::new(0));
    let count = all.len() as u64;
    let work = || {
        let mut judged = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(mutant) = all.get(at) else { return judged };
            let program =
                RigProgram::new(&mutant.apply(&test_program.program), &test_program.controller)
                    .with_devices(&suite.devices);
            let mut programs = programs.clone();
            programs[0] = Arc::new(program);
            judged.push((
                at,
                failing(LoweredSuite { suite, programs: &programs, given_up: None }, RUNS_MAX),
            ));
            (options.progress)(done.fetch_add(1, Ordering::Relaxed) + 1, count);
        }
    };
    let mut judged: Vec<(usize, Option<String>)> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..options.jobs.max(1)).map(|_| scope.spawn(work)).collect();
        let results = threads.into_iter().map(std::thread::ScopedJoinHandle::join);
        results.flat_map(Result::unwrap_or_default).collect()
    });
    judged.sort_unstable_by_key(|(at, _)| *at);
    let judge = |(mutant, (_, killed_by))| JudgedMutant { mutant, killed_by };
    all.into_iter().zip(judged).map(judge).collect()
}

/// The first test that fails: scenarios in file order, then random tests.
fn failing(stage: LoweredSuite, runs_max: u32) -> Option<String> {
    for scenario in &stage.suite.scenarios {
        let (played, _) = play(stage, scenario, false, &mut NoSpectator);
        if played.failed.is_some() {
            return Some(scenario.name.clone());
        }
    }
    for test in &stage.suite.randoms {
        let mut runs = 0..test.runs.min(runs_max);
        if runs.any(|run| random_run::run(stage, test, run, None).broken.is_some()) {
            return Some(test.name.clone());
        }
    }
    None
}
