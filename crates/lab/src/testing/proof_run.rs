//! Tries what a proof has found: a run as a scenario, played as `rungd test` plays it, and as text
//! to paste into a test file.
//!
//! Called by `rungd-prove`. A run that does not do on the rig what the proof says of it is told as
//! such; nothing is printed here.

use std::sync::Arc;

use super::failure::{Failure, failure};
use super::lowered_suite::LoweredSuite;
use super::pasted::scenario_text;
use super::player::{FailedWhy, NoSpectator, play};
use super::suite::{Scenario, Suite, TestOperand, TestStep, TestTime};
use crate::rig::{Rig, RigProgram};
use rungd_language::source::span::{Located, Span};

/// A run that a proof has found, from a cold start.
#[derive(Clone, Debug)]
pub struct FoundRun {
    /// The name of its scenario: `violates: !(up & down)`.
    pub name: String,
    /// Memory before the first scan that differs from a cold start.
    pub set: Vec<(TestOperand, i32)>,
    /// Its steps: `set`, `force`, `run` in scans, what happens to the controller in RUN, and
    /// `expect`.
    pub steps: Vec<TestStep>,
}

/// A run that was tried.
#[derive(Clone, Debug)]
pub struct TriedRun {
    /// The scenario, to paste into a test file.
    pub text: String,
    /// Whether it does what the proof says of it.
    pub is_confirmed: bool,
    /// How the test fails: where it breaks its line, or what it does not show.
    pub failure: Option<Box<Failure>>,
}

/// Tries a run that breaks a line of `always` at its last scan; `line`: the line's number.
pub fn try_violation(
    suite: &Suite,
    programs: &[Arc<RigProgram>],
    line: usize,
    run: FoundRun,
) -> TriedRun {
    let mut alone = suite.clone();
    alone.always.iter_mut().for_each(|lines| *lines = vec![lines[line].clone()]);
    let stage = LoweredSuite { suite: &alone, programs, given_up: None };
    let scenario = scenario_of(run);
    let text = scenario_text(&scenario, programs);
    let scans = scans_of(&scenario);
    let (played, _) = play(stage, &scenario, false, &mut NoSpectator);
    let broken = played.failed.filter(|failed| matches!(failed.why, FailedWhy::Always(_)));
    let is_confirmed = broken.as_ref().is_some_and(|failed| failed.scans == scans);
    let failure = broken.map(|failed| Box::new(failure(stage, &scenario, &failed)));
    TriedRun { text, is_confirmed, failure }
}

/// Tries a run whose steps expect something: it is confirmed if they all pass.
pub fn try_run(suite: &Suite, programs: &[Arc<RigProgram>], run: FoundRun) -> TriedRun {
    try_end(suite, programs, run, |_| true)
}

/// Does the same; `is_there`: whether the rig is where the run leads.
pub fn try_end(
    suite: &Suite,
    programs: &[Arc<RigProgram>],
    run: FoundRun,
    is_there: impl FnOnce(&Rig) -> bool,
) -> TriedRun {
    let mut alone = suite.clone();
    alone.always.iter_mut().for_each(Vec::clear);
    let stage = LoweredSuite { suite: &alone, programs, given_up: None };
    let scenario = scenario_of(run);
    let text = scenario_text(&scenario, programs);
    let (played, judged) = play(stage, &scenario, false, &mut NoSpectator);
    let failure = played.failed.map(|failed| Box::new(failure(stage, &scenario, &failed)));
    let is_confirmed = failure.is_none() && is_there(&judged.rig);
    TriedRun { text, is_confirmed, failure }
}

/// A run as a scenario to read; it is not tried.
pub fn run_text(programs: &[Arc<RigProgram>], run: FoundRun) -> String {
    scenario_text(&scenario_of(run), programs)
}

fn scenario_of(run: FoundRun) -> Scenario {
    let steps = run.steps.into_iter().map(located).collect();
    Scenario { name: run.name, span: Span::default(), set: run.set, steps }
}

fn located(value: TestStep) -> Located<TestStep> {
    Located { value, span: Span::default() }
}

/// The number of scans of its steps.
fn scans_of(scenario: &Scenario) -> u64 {
    let scans = scenario.steps.iter().map(|step| {
        if let TestStep::Run(TestTime::Scans(scans)) = step.value {
            return scans;
        }
        // The last one.
        u64::from(matches!(step.value, TestStep::Stop | TestStep::Restart { .. }))
    });
    scans.sum()
}
