//! Runs suites: every scenario, and every run of a random test, on several threads.
//!
//! `cli` passes suites and gets a [`TestVerdict`] for each test, in file order. The verdicts do not
//! depend on the number of threads: the verdict of a random test is that of its first failing run.

use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering};

use super::failure::{Failure, failure, failure_of_run};
use super::lowered_suite::LoweredSuite;
use super::player::{NoSpectator, PlayedScenario, play};
use super::random_run::{self, BrokenRun};
use super::shrink::shrink;
use super::suite::Suite;
use super::unmoved::{MovableCells, UnmovedCells, UnmovedNames};
use crate::rig::RigProgram;
use rungd_base::locked::locked;

/// The maximum number of random runs that one thread takes at a time.
const RUNS_AT_ONCE: u32 = 8;

/// The result of a test.
#[derive(Clone, Debug)]
pub struct TestVerdict {
    /// The test's name.
    pub name: String,
    /// The line of the test in its file.
    pub line: u32,
    /// The number of its scans; for a random test, of all runs.
    pub scans: u64,
    /// The virtual time that passed, ns.
    pub virtual_ns: u64,
    /// The number of runs of a random test; 1 for a scenario.
    pub runs: u32,
    /// What never moved in any run of a random test that passed.
    pub unmoved: UnmovedNames,
    /// The failure; `None`: it passed.
    pub failure: Option<Box<Failure>>,
}

/// The options for running tests.
pub struct RunOptions<'a> {
    /// The number of threads; at least 1.
    pub jobs: usize,
    /// Runs only tests whose names contain this text.
    pub filter: Option<&'a str>,
    /// Called when a test or a part of a test is done, with the number of parts that are done and
    /// the number of all parts.
    pub progress: &'a (dyn Fn(u64, u64) + Sync),
    /// Gives the tests up as soon as it is `true`; then there are no verdicts.
    pub given_up: Option<&'a AtomicBool>,
}

/// A piece of work for a thread.
#[derive(Clone, Copy)]
enum WorkItem {
    Scenario(usize),
    /// Runs of a random test: its index, the first run, and the run after the last one.
    Runs(usize, u32, u32),
}

/// The result of a scenario, with its failure explained.
type JudgedScenario = (PlayedScenario, Option<Box<Failure>>);

/// The results, filled in by all threads.
struct Results {
    scenarios: Vec<Mutex<Option<JudgedScenario>>>,
    randoms: Vec<RandomResult>,
    movable: MovableCells,
}

/// The results of a random test.
struct RandomResult {
    scans: AtomicU64,
    /// The first run known to fail.
    first: AtomicU32,
    broken: Mutex<Option<(u32, BrokenRun)>>,
    /// What has not moved in any run; `None` before the first one.
    unmoved: Mutex<Option<UnmovedCells>>,
}

/// Lowers the programs of a suite.
pub fn programs(suite: &Suite) -> Vec<Arc<RigProgram>> {
    let program = |program: &super::suite::TestProgram| {
        let lowered = RigProgram::new(&program.program, &program.controller);
        Arc::new(lowered.with_devices(&suite.devices))
    };
    suite.programs.iter().map(program).collect()
}

/// Runs the tests of a suite whose names contain the filter, in file order: scenarios, then random
/// tests.
pub fn run(suite: &Suite, programs: &[Arc<RigProgram>], options: &RunOptions) -> Vec<TestVerdict> {
    let stage = LoweredSuite { suite, programs, given_up: options.given_up };
    let is_wanted = |name: &str| options.filter.is_none_or(|text| name.contains(text));
    let work = work(suite, is_wanted);
    let results = Results {
        scenarios: suite.scenarios.iter().map(|_| Mutex::new(None)).collect(),
        randoms: suite.randoms.iter().map(|_| RandomResult::new()).collect(),
        movable: MovableCells::of(&suite.programs[0], &programs[0]),
    };
    let (next, done) = (AtomicUsize::new(0), AtomicU64::new(0));
    let all = work.len() as u64;
    std::thread::scope(|scope| {
        for _ in 0..options.jobs.clamp(1, work.len().max(1)) {
            scope.spawn(|| {
                while let Some(one) = work.get(next.fetch_add(1, Ordering::Relaxed)) {
                    results.work(stage, *one);
                    let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                    (options.progress)(done, all);
                }
            });
        }
    });
    if stage.is_given_up() {
        return Vec::new();
    }
    results.verdicts(stage, is_wanted)
}

fn work(suite: &Suite, is_wanted: impl Fn(&str) -> bool) -> Vec<WorkItem> {
    let scenarios = suite.scenarios.iter().enumerate();
    let mut work: Vec<WorkItem> = scenarios
        .filter(|(_, scenario)| is_wanted(&scenario.name))
        .map(|(at, _)| WorkItem::Scenario(at))
        .collect();
    for (at, test) in suite.randoms.iter().enumerate().filter(|(_, test)| is_wanted(&test.name)) {
        for first in (0..test.runs).step_by(RUNS_AT_ONCE as usize) {
            work.push(WorkItem::Runs(at, first, (first + RUNS_AT_ONCE).min(test.runs)));
        }
    }
    work
}

impl RandomResult {
    fn new() -> RandomResult {
        RandomResult {
            scans: AtomicU64::new(0),
            first: AtomicU32::new(u32::MAX),
            broken: Mutex::new(None),
            unmoved: Mutex::new(None),
        }
    }

    /// Notes what has not moved in a run.
    fn joins(&self, unmoved: UnmovedCells) {
        let mut known = locked(&self.unmoved);
        match &mut *known {
            Some(known) => known.join(&unmoved),
            None => *known = Some(unmoved),
        }
    }

    /// Notes a run that has failed, unless a run with a lower number has failed.
    fn fails(&self, run: u32, broken: BrokenRun) {
        let mut known = locked(&self.broken);
        if known.as_ref().is_none_or(|(first, _)| run < *first) {
            self.first.store(run, Ordering::Relaxed);
            *known = Some((run, broken));
        }
    }
}

impl Results {
    fn work(&self, stage: LoweredSuite, work: WorkItem) {
        match work {
            WorkItem::Scenario(at) => {
                let scenario = &stage.suite.scenarios[at];
                let (played, _) = play(stage, scenario, false, &mut NoSpectator);
                if stage.is_given_up() {
                    return;
                }
                let failed = played.failed.as_ref();
                let failure = failed.map(|failed| Box::new(failure(stage, scenario, failed)));
                *locked(&self.scenarios[at]) = Some((played, failure));
            }
            WorkItem::Runs(at, first, end) => {
                let (test, result) = (&stage.suite.randoms[at], &self.randoms[at]);
                for run in first..end {
                    if result.first.load(Ordering::Relaxed) < run || stage.is_given_up() {
                        return;
                    }
                    let mut unmoved = self.movable.unmoved();
                    let ended = random_run::run(stage, test, run, Some(&mut unmoved));
                    result.scans.fetch_add(ended.scans, Ordering::Relaxed);
                    match ended.broken {
                        Some(broken) => result.fails(run, broken),
                        None => result.joins(unmoved),
                    }
                }
            }
        }
    }

    fn verdicts(self, stage: LoweredSuite, is_wanted: impl Fn(&str) -> bool) -> Vec<TestVerdict> {
        let suite = stage.suite;
        let mut verdicts = Vec::new();
        for (scenario, result) in suite.scenarios.iter().zip(self.scenarios) {
            let Some((played, failure)) = taken(result) else { continue };
            verdicts.push(TestVerdict {
                name: scenario.name.clone(),
                line: suite.line(scenario.span),
                scans: played.scans,
                virtual_ns: played.virtual_ns,
                runs: 1,
                unmoved: UnmovedNames::default(),
                failure,
            });
        }
        let period_ns = stage.programs[0].period_ns();
        for (test, result) in suite.randoms.iter().zip(self.randoms) {
            if !is_wanted(&test.name) {
                continue;
            }
            let broken = taken(result.broken);
            let unmoved = taken(result.unmoved).filter(|_| broken.is_none());
            let unmoved =
                unmoved.map_or_else(UnmovedNames::default, |unmoved| self.movable.names(&unmoved));
            let (mut scans, mut runs) = (result.scans.into_inner(), test.runs);
            let failure = broken.map(|(run, broken)| {
                // The number of later runs depends on the threads, so they do not count.
                (runs, scans) = (run + 1, u64::from(run) * test.scans + broken.scan + 1);
                let short = shrink(stage, test, broken);
                Box::new(failure_of_run(stage, test, &short, run))
            });
            verdicts.push(TestVerdict {
                name: test.name.clone(),
                line: suite.line(test.span),
                scans,
                virtual_ns: scans.saturating_mul(period_ns),
                runs,
                unmoved,
                failure,
            });
        }
        verdicts
    }
}

fn taken<T>(result: Mutex<Option<T>>) -> Option<T> {
    result.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner)
}
