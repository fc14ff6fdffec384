//! The quality of suites: the mutants of their ladder for which they fail.
//!
//! Called by `rungd mutate`. Each mutant replaces the first program of a suite, and the tests run
//! until one fails. Suites of one ladder are judged together: a mutant is noticed if one of them
//! fails. Programs of `reload` steps are not changed.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

use super::joint::{FailingTest, JointMutant, JudgedMutant, MutantOfSuite, joint_mutants};
use super::lowered_suite::LoweredSuite;
use super::mutants::{Mutant, MutantKind, MutatedProgram, RungIndex};
use super::player::{NoSpectator, play};
use super::random_run;
use super::suite::{Suite, TestProgram};
use crate::rig::RigProgram;
use rungd_language::resolve::program::Program;

/// The maximum number of runs of a random test for each mutant.
const RUNS_MAX: u32 = 10;

/// The options for judging mutants.
pub struct MutateOptions<'a> {
    /// The number of threads; at least 1.
    pub jobs: usize,
    /// The kinds of mutants to judge; empty: all.
    pub kinds: &'a [MutantKind],
    /// Called when a mutant has been judged.
    pub progress: &'a (dyn Fn(MutationProgress) + Sync),
    /// Proves that a mistake in contacts changes nothing. `false`: that is not shown.
    pub proves: Option<&'a (dyn Fn(&UnnoticedMutant<'_>) -> bool + Sync)>,
    /// Ends the judgement as soon as it is `true`; the mutants judged so far are kept.
    pub given_up: &'a AtomicBool,
}

/// A mistake in contacts that no test notices.
pub struct UnnoticedMutant<'a> {
    /// A suite of the ladder, which is its first program.
    pub suite: &'a Suite,
    /// The ladder with the mistake. Nothing but contacts is different.
    pub mutated: &'a Program,
    /// The rungs with the mistake, the last one in the program first.
    pub rungs: Vec<RungIndex>,
}

/// How far a judgement is.
#[derive(Clone, Copy, Debug)]
pub struct MutationProgress {
    /// The number of mutants that are judged, or known to change nothing.
    pub done: u64,
    /// The number of all mutants.
    pub all: u64,
    /// The number of mutants that no test has noticed.
    pub unnoticed: u64,
}

/// The judged mutants of a ladder.
#[derive(Clone, Debug, Default)]
pub struct JudgedLadder {
    /// The judged mutants: those of rungs in file order, then those of `[retain]`.
    pub judged: Vec<JudgedMutant>,
    /// The number of mutants that change nothing; no test could notice them, so they do not count.
    pub unchanged: usize,
    /// The mutants that change nothing by proof; they do not count either.
    pub proved: Vec<JudgedMutant>,
    /// The number of mutants that were not judged before the end.
    pub left: usize,
}

/// The judgement of one mutant.
enum Verdict {
    /// It executes and retains the same as its ladder.
    ChangesNothing,
    /// It does the same as its ladder, by proof.
    ProvedSame,
    /// The first test that fails; `None`: no test does.
    Judged(Option<FailingTest>),
}

/// The first test of a suite that fails with its own ladder.
///
/// A suite that fails with its own ladder cannot judge mutants. `given_up` ends the tests; then no
/// test has failed.
pub fn first_failure(suite: &Suite, given_up: &AtomicBool) -> Option<String> {
    let programs = super::runner::programs(suite);
    let stage = LoweredSuite { suite, programs: &programs, given_up: Some(given_up) };
    failing(stage, u32::MAX).filter(|_| !stage.is_given_up())
}

/// Judges the mutants of the ladder that all suites test.
pub fn mutate(suites: &[&Suite], options: &MutateOptions) -> JudgedLadder {
    let mut all = joint_mutants(suites);
    all.retain(|mutant| options.kinds.is_empty() || options.kinds.contains(&mutant.kind()));
    let judgement = LadderJudgement::of(suites, options);
    let (next, count) = (AtomicUsize::new(0), all.len() as u64);
    let work = || {
        let mut verdicts = Vec::new();
        while let Some(at) = judgement.next(&next, all.len()) {
            let Some(verdict) = judgement.judge(&all[at]) else { break };
            judgement.show(&verdict, count);
            verdicts.push((at, verdict));
        }
        verdicts
    };
    let mut verdicts: Vec<(usize, Verdict)> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..options.jobs.max(1)).map(|_| scope.spawn(work)).collect();
        let results = threads.into_iter().map(std::thread::ScopedJoinHandle::join);
        results.flat_map(Result::unwrap_or_default).collect()
    });
    verdicts.sort_unstable_by_key(|(at, _)| *at);
    let mut ladder = JudgedLadder { left: all.len() - verdicts.len(), ..Default::default() };
    for (at, verdict) in verdicts {
        match verdict {
            Verdict::ChangesNothing => ladder.unchanged += 1,
            Verdict::ProvedSame => ladder.proved.push(all[at].judged(suites, None)),
            Verdict::Judged(killed_by) => ladder.judged.push(all[at].judged(suites, killed_by)),
        }
    }
    ladder
}

/// A suite whose ladder executes something else with a mutant.
struct ChangedSuite<'a> {
    suite: &'a Suite,
    mutant: &'a Mutant,
    mutated: MutatedProgram,
}

/// What all threads know.
struct LadderJudgement<'a> {
    suites: &'a [&'a Suite],
    /// The lowered programs of each suite.
    programs: Vec<Vec<Arc<RigProgram>>>,
    /// The fingerprint of the first program of each suite.
    fingerprints: Vec<u64>,
    options: &'a MutateOptions<'a>,
    done: AtomicU64,
    unnoticed: AtomicU64,
}

impl<'a> LadderJudgement<'a> {
    fn of(suites: &'a [&'a Suite], options: &'a MutateOptions<'a>) -> LadderJudgement<'a> {
        let programs: Vec<_> = suites.iter().map(|suite| super::runner::programs(suite)).collect();
        let fingerprints = programs.iter().map(|programs| programs[0].fingerprint()).collect();
        let (done, unnoticed) = (AtomicU64::new(0), AtomicU64::new(0));
        LadderJudgement { suites, programs, fingerprints, options, done, unnoticed }
    }

    /// The next mutant for a thread; `None`: there is none, or the judgement is given up.
    fn next(&self, next: &AtomicUsize, count: usize) -> Option<usize> {
        let at = next.fetch_add(1, Ordering::Relaxed);
        (at < count && !self.is_given_up()).then_some(at)
    }

    fn is_given_up(&self) -> bool {
        self.options.given_up.load(Ordering::Relaxed)
    }

    /// Runs the suites until a test fails, and tries a proof if none does; `None`: they were given
    /// up.
    fn judge(&self, joint: &JointMutant) -> Option<Verdict> {
        let mut changing = Vec::new();
        for MutantOfSuite { suite: at, mutant } in &joint.of_suites {
            let suite = self.suites[*at];
            let mutated = mutant.apply(&suite.programs[0]);
            let program = RigProgram::new(&mutated.program, &mutated.controller);
            if program.fingerprint() == self.fingerprints[*at] || repeats(suite, mutant, &mutated) {
                continue;
            }
            let mut programs = self.programs[*at].clone();
            programs[0] = Arc::new(program.with_devices(&suite.devices));
            let given_up = Some(self.options.given_up);
            let failing = failing(LoweredSuite { suite, programs: &programs, given_up }, RUNS_MAX);
            if self.is_given_up() {
                return None;
            }
            if let Some(name) = failing {
                return Some(Verdict::Judged(Some(FailingTest { suite: *at, name })));
            }
            changing.push(ChangedSuite { suite, mutant, mutated });
        }
        Some(match changing.as_slice() {
            [] => Verdict::ChangesNothing,
            all if all.iter().all(|changed| self.is_proved_same(changed)) => Verdict::ProvedSame,
            _ => Verdict::Judged(None),
        })
    }

    /// Whether it is proved that a mutant does the same as its ladder.
    fn is_proved_same(&self, changed: &ChangedSuite) -> bool {
        let ChangedSuite { suite, mutant, mutated } = changed;
        let (Some(proves), Some(rungs)) = (self.options.proves, mutant.of_contacts_alone()) else {
            return false;
        };
        proves(&UnnoticedMutant { suite, mutated: &mutated.program, rungs })
    }

    fn show(&self, verdict: &Verdict, all: u64) {
        let is_unnoticed = matches!(verdict, Verdict::Judged(None));
        let unnoticed = self.unnoticed.fetch_add(is_unnoticed.into(), Ordering::Relaxed);
        let unnoticed = unnoticed + u64::from(is_unnoticed);
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        (self.options.progress)(MutationProgress { done, all, unnoticed });
    }
}

/// Whether a mutant differs from its ladder only by contacts that repeat other contacts.
fn repeats(suite: &Suite, mutant: &Mutant, mutated: &MutatedProgram) -> bool {
    let TestProgram { program, controller, .. } = &suite.programs[0];
    let plain = mutant.without_repeats(program, &mutated.program);
    plain.is_some_and(|plain| {
        let [original, mutated] =
            plain.map(|program| RigProgram::new(&program, controller).fingerprint());
        original == mutated
    })
}

/// The first test that fails: scenarios in file order, then random tests. The result means nothing
/// if the suite was given up.
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
