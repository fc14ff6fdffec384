//! Explains a failed test: the operands of its condition with their values, the age of the values,
//! their last changes, and the reasons.
//!
//! The scenario is played again with a tape. It fails in the same way, and `observe` finds the
//! reasons on the tape. `report` makes text from a [`Failure`].

use std::sync::Arc;

use super::condition::Condition;
use super::history::{OperandChange, OperandHistory};
use super::judge::JudgedRig;
use super::lowered_suite::LoweredSuite;
use super::pasted::{PastedRun, pasted};
use super::player::{FailedStep, FailedWhy, NoSpectator, condition, play};
use super::random_run::BrokenRun;
use super::reasons::{Reasons, TapedProgram};
use super::suite::{RandomTest, Scenario};
use crate::rig::RigMode;
use rungd_engine::Cell;
use rungd_history::observe::{QuestionTime, Subject};
use rungd_language::source::wording::counted;
use rungd_runtime::TapeSection;

/// A failed test.
#[derive(Clone, Debug)]
pub struct Failure {
    /// The step that failed: its number from 1, and the number of steps. `None` for a random test.
    pub step: Option<(usize, usize)>,
    /// The line and column of that step, or of the test; from 1.
    pub place: (u32, u32),
    /// The text of the step.
    pub text: String,
    /// The reason of the failure, in a sentence.
    pub what: String,
    /// The number of the last scan of its process, from 1; 0: none.
    pub scan: u64,
    /// The time of that scan, ns since the start of the test.
    pub now_ns: u64,
    /// The operands of the condition.
    pub operands: Vec<SeenOperand>,
    /// The field devices whose last exchange failed, with the reasons.
    pub troubles: Vec<String>,
    /// The reasons of their values: the answers of `rungd why`.
    pub why: Vec<String>,
    /// A random run as a scenario to paste into a test file.
    pub scenario: Option<String>,
    /// The findings of a refused `reload`.
    pub findings: Option<String>,
}

/// An operand of a condition.
#[derive(Clone, Debug)]
pub struct SeenOperand {
    /// Its name.
    pub name: String,
    /// Its value as text: `ON`, `OFF`, a number; with the text of the value, if its tag gives one.
    pub value: String,
    /// Whether it is a bit.
    pub is_bit: bool,
    /// The last scan within which it was ON, although it was OFF at its end: a condition is judged
    /// at the end.
    pub on_within: Option<u64>,
    /// Its last changes, the newest last; the first one is its value at the start of the process.
    pub changes: Vec<SeenChange>,
}

/// A change of an operand.
#[derive(Clone, Debug)]
pub struct SeenChange {
    /// The scan, from 1 in its process; 0: before the first scan.
    pub scan: u64,
    /// The time of that scan, ns since the start of the test.
    pub now_ns: u64,
    /// The new value as text.
    pub value: String,
}

/// Explains a scenario that failed.
pub(super) fn failure(stage: LoweredSuite, scenario: &Scenario, failed: &FailedStep) -> Failure {
    let step = &scenario.steps[failed.step];
    let suite = stage.suite;
    let judged = false_condition(stage, scenario, failed);
    let text = match failed.why {
        FailedWhy::Always(at) => format!("always: {}", suite.always[failed.program.0][at].text),
        FailedWhy::Unmet
        | FailedWhy::Never(_)
        | FailedWhy::NotHeld(_)
        | FailedWhy::Mode(_)
        | FailedWhy::AlreadyOn(_)
        | FailedWhy::NotForced(_)
        | FailedWhy::Refused(_)
        | FailedWhy::GivenUp => suite.text(step.span).to_owned(),
    };
    let mut failure = Failure {
        step: Some((failed.step + 1, scenario.steps.len())),
        place: suite.place(step.span),
        what: what(stage, scenario, failed),
        text,
        scan: failed.scan,
        now_ns: failed.now_ns,
        operands: Vec::new(),
        troubles: failed.troubles.clone(),
        why: Vec::new(),
        scenario: None,
        findings: match &failed.why {
            FailedWhy::Refused(text) => Some(text.clone()),
            FailedWhy::Unmet
            | FailedWhy::Never(_)
            | FailedWhy::NotHeld(_)
            | FailedWhy::Always(_)
            | FailedWhy::Mode(_)
            | FailedWhy::AlreadyOn(_)
            | FailedWhy::NotForced(_)
            | FailedWhy::GivenUp => None,
        },
    };
    if let Some(condition) = judged {
        explain(stage, scenario, FalseCondition { failed, condition }, &mut failure);
    }
    failure
}

/// Explains a random run that failed.
pub(super) fn failure_of_run(
    stage: LoweredSuite,
    test: &RandomTest,
    broken: &BrokenRun,
    run: u32,
) -> Failure {
    // A bit that the ladder holds ON cannot be pulsed: then the changes are separate steps.
    let breaks = |run: PastedRun| {
        let failed = play(stage, &run.scenario, false, &mut NoSpectator).0.failed?;
        matches!(failed.why, FailedWhy::Always(_)).then_some((run, Some(failed)))
    };
    let short = breaks(pasted(stage, test, broken, true));
    let plain = || pasted(stage, test, broken, false);
    let (run_as_scenario, failed) =
        short.or_else(|| breaks(plain())).unwrap_or_else(|| (plain(), None));
    let PastedRun { scenario, text } = run_as_scenario;
    let line = format!("always: {}", stage.suite.always[0][broken.always].text);
    let what =
        format!("the condition is false; this is run {} of {}, shortened", run + 1, test.runs);
    let place = stage.suite.place(test.span);
    let explained = failed.map(|failed| failure(stage, &scenario, &failed));
    let scan_time = |scan: u64| scan * stage.programs[0].period_ns();
    Failure {
        step: None,
        place,
        text: line,
        what,
        scan: broken.scan + 1,
        now_ns: scan_time(broken.scan),
        operands: explained.as_ref().map_or_else(Vec::new, |explained| explained.operands.clone()),
        troubles: explained.as_ref().map_or_else(Vec::new, |explained| explained.troubles.clone()),
        why: explained.map_or_else(Vec::new, |explained| explained.why),
        scenario: Some(text),
        findings: None,
    }
}

/// A step that failed, with its condition, which is false.
#[derive(Clone, Copy)]
struct FalseCondition<'a> {
    failed: &'a FailedStep,
    condition: &'a Condition,
}

/// The condition that is false.
fn false_condition<'a>(
    stage: LoweredSuite<'a>,
    scenario: &'a Scenario,
    failed: &FailedStep,
) -> Option<&'a Condition> {
    match &failed.why {
        FailedWhy::Always(at) => Some(&stage.suite.always[failed.program.0][*at]),
        FailedWhy::Unmet | FailedWhy::Never(_) | FailedWhy::NotHeld(_) => {
            condition(&scenario.steps[failed.step].value)
        }
        FailedWhy::Mode(_)
        | FailedWhy::AlreadyOn(_)
        | FailedWhy::NotForced(_)
        | FailedWhy::Refused(_)
        | FailedWhy::GivenUp => None,
    }
}

fn what(stage: LoweredSuite, scenario: &Scenario, failed: &FailedStep) -> String {
    match &failed.why {
        FailedWhy::Unmet => "the condition is false".to_owned(),
        FailedWhy::Never(count) => {
            format!("the condition was never true in {}", counted(*count, "scan"))
        }
        FailedWhy::NotHeld(at) => {
            format!("the condition is false in the {} scan of the step", ordinal(*at))
        }
        FailedWhy::Always(_) => {
            let step = stage.suite.text(scenario.steps[failed.step].span);
            match step.is_empty() {
                true => "the condition is false".to_owned(),
                false => format!("the condition is false during `{step}`"),
            }
        }
        FailedWhy::Mode(RigMode::Run) => "the controller is in STOP: this step needs RUN".into(),
        FailedWhy::Mode(RigMode::Stop) => "the controller is in RUN: this step needs STOP".into(),
        FailedWhy::AlreadyOn(operand) => {
            format!(
                "`{}` is ON: a pulse needs a bit that is OFF (`run 1 scans` lets an earlier pulse \
                 end)",
                operand.name
            )
        }
        FailedWhy::NotForced(operand) => format!("`{}` is not forced", operand.name),
        FailedWhy::Refused(_) => "the reload is refused".to_owned(),
        FailedWhy::GivenUp => "the test was given up".to_owned(),
    }
}

/// `1st`, `2nd`, `13th`.
fn ordinal(number: u64) -> String {
    let ending = match (number % 10, number % 100) {
        (1, rest) if rest != 11 => "st",
        (2, rest) if rest != 12 => "nd",
        (3, rest) if rest != 13 => "rd",
        _ => "th",
    };
    format!("{number}{ending}")
}

/// Plays the scenario again with a tape, and explains the operands of its condition.
fn explain(stage: LoweredSuite, scenario: &Scenario, unmet: FalseCondition, failure: &mut Failure) {
    let FalseCondition { failed, condition } = unmet;
    let program = &stage.programs[failed.program.0];
    let mut history = OperandHistory::new(Arc::clone(program), condition, failed.scans);
    let (_, JudgedRig { rig, mut judge }) = play(stage, scenario, true, &mut history);
    judge.look(&rig);
    let image = judge.image(&rig);
    if failed.scans == 0 || !matches!(failed.why, FailedWhy::Always(_)) {
        // Steps without a scan may have changed memory since the last scan.
        history.deciding = condition.deciding(image);
    }
    let text = |cell: Cell, value: i32| match judge.view() {
        Some(view) => view.symbols.say_value(view.of_values(cell), value),
        None => program.symbols.say_value(cell, value),
    };
    let operands = condition.operands.iter().zip(history.changes());
    failure.operands = operands
        .map(|((name, cell), changes)| {
            let seen = |change: &OperandChange| SeenChange {
                scan: change.scan,
                now_ns: change.now_ns,
                value: text(*cell, change.value),
            };
            let value = image.value(*cell);
            SeenOperand {
                name: name.clone(),
                value: text(*cell, changes.back().map_or(value, |last| last.value)),
                is_bit: cell.is_bit(),
                on_within: None,
                changes: changes.iter().map(seen).collect(),
            }
        })
        .collect();
    // The current value of a selected element. It has no list of changes, because they would be
    // changes of several cells.
    let element = |(name, cell): (String, Cell)| SeenOperand {
        name,
        value: text(cell, image.value(cell)),
        is_bit: cell.is_bit(),
        on_within: None,
        changes: Vec::new(),
    };
    failure.operands.extend(condition.elements(image).into_iter().map(element));
    let of_scan = matches!(failed.why, FailedWhy::Always(_)) && failed.scan > 0;
    let at = if of_scan { QuestionTime::Scan(failed.scan) } else { QuestionTime::Now };
    let test_program = &stage.suite.programs[failed.program.0];
    let subject = Subject::new(Arc::clone(&test_program.program), test_program.files.clone());
    let sections = rig.sections();
    let operands = condition.operands.iter();
    let cells: Vec<_> = operands.map(|(_, cell)| judge.of_ladder(*cell)).collect();
    note_on_within(
        &Glimpsed { subject: &subject, failed, cells },
        &sections,
        &mut failure.operands,
    );
    let mut files = test_program.files.clone();
    files.push(stage.suite.file.clone());
    let observer = judge.view().and_then(|view| {
        let subject = view.subject(files)?;
        Some(TapedProgram { subject, sections: judge.sections() })
    });
    let mut reasons =
        Reasons { ladder: TapedProgram { subject, sections }, observer, view: judge.view(), at };
    failure.why = reasons.reasons(&history.deciding);
}

/// The operands of a false condition, for what was seen of them within scans.
struct Glimpsed<'a> {
    subject: &'a Subject,
    failed: &'a FailedStep,
    /// Their cells in the controller; `None`: none of it.
    cells: Vec<Option<Cell>>,
}

/// Notes which bits of a condition were ON only within a scan: for `within` in all its scans, else
/// in the last one.
fn note_on_within(
    Glimpsed { subject, failed, cells }: &Glimpsed,
    sections: &[Arc<TapeSection>],
    operands: &mut [SeenOperand],
) {
    let count = match failed.why {
        FailedWhy::Never(count) => count,
        FailedWhy::Unmet
        | FailedWhy::NotHeld(_)
        | FailedWhy::Always(_)
        | FailedWhy::Mode(_)
        | FailedWhy::AlreadyOn(_)
        | FailedWhy::NotForced(_)
        | FailedWhy::Refused(_)
        | FailedWhy::GivenUp => 1,
    };
    let bit = |(at, cell): (usize, &Option<Cell>)| Some((at, cell.filter(|cell| cell.is_bit())?));
    let (places, bits): (Vec<usize>, Vec<Cell>) = cells.iter().enumerate().filter_map(bit).unzip();
    let from = (failed.scan + 1).saturating_sub(count);
    let glimpses = subject.glimpses(sections, &bits, from);
    for (at, glimpse) in places.into_iter().zip(glimpses) {
        operands[at].on_within = glimpse.filter(|_| operands[at].value.starts_with("OFF"));
    }
}
