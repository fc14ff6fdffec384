//! A random run as a scenario that can be played again, and as text to paste into a test file.

use super::lowered_suite::LoweredSuite;
use super::random_run::{BrokenRun, RandomEvent};
use super::suite::{RandomTest, Scenario, TestOperand, TestStep, TestTime};
use rungd_engine::Layout;
use rungd_language::source::span::Located;

/// A run as a scenario.
pub(super) struct PastedRun {
    pub scenario: Scenario,
    pub text: String,
}

/// Makes a scenario from a run that broke a line of `always`. `has_pulses`: equal pulses become one
/// step.
pub(super) fn pasted(
    stage: LoweredSuite,
    test: &RandomTest,
    broken: &BrokenRun,
    has_pulses: bool,
) -> PastedRun {
    let layout = &stage.programs[0].symbols.layout;
    let mut steps: Vec<TestStep> = Vec::new();
    let mut scan = 0;
    for RandomEvent { scan: at, change, value, .. } in &broken.events {
        if *at > scan {
            steps.push(TestStep::Run(TestTime::Scans(at - scan)));
            scan = *at;
        }
        steps.push(TestStep::Set(test.changes[*change].operand.clone(), *value));
    }
    steps.push(TestStep::Run(TestTime::Scans(broken.scan + 1 - scan)));
    if has_pulses {
        steps = pulses(steps, stage.programs[0].controller.period_ms);
    }
    let mut text = format!("[[scenario]]\nname  = {}\n", quoted(&test.name));
    if !test.set.is_empty() {
        let set = |(operand, value): &(TestOperand, i32)| {
            format!("{} = {}", quoted(&operand.name), layout.text(operand.cell, *value))
        };
        let all: Vec<String> = test.set.iter().map(set).collect();
        text += &format!("set   = {{ {} }}\n", all.join(", "));
    }
    text += "steps = [\n";
    for step in &steps {
        text += &format!("    {},\n", quoted(&step_text(step, layout)));
    }
    text += "]\n";
    let located = |value| Located { value, span: test.span };
    let steps = steps.into_iter().map(located).collect();
    let scenario =
        Scenario { name: test.name.clone(), span: test.span, set: test.set.clone(), steps };
    PastedRun { scenario, text }
}

/// Replaces equal pulses (a bit goes ON and OFF again, at least twice) by one step.
fn pulses(steps: Vec<TestStep>, period_ms: u32) -> Vec<TestStep> {
    let mut short = Vec::new();
    let mut rest = &steps[..];
    while let Some(first) = rest.first() {
        let Some(SetPulse { operand, on, off }) = pulse(rest) else {
            short.push(first.clone());
            rest = &rest[1..];
            continue;
        };
        let times =
            rest.chunks(4).take_while(|next| pulse(next) == Some(SetPulse { operand, on, off }));
        let times = times.count();
        let ms = |scans: u64| u32::try_from(scans * u64::from(period_ms)).ok();
        match (ms(on), ms(on + off)) {
            (Some(on), Some(every)) if times > 1 => short.push(TestStep::Pulse {
                operand: operand.clone(),
                on: TestTime::Ms(on),
                every: TestTime::Ms(every),
                times: times as u32,
            }),
            _ => short.extend_from_slice(&rest[..4 * times]),
        }
        rest = &rest[4 * times..];
    }
    short
}

/// A bit that goes ON and OFF again.
#[derive(PartialEq)]
struct SetPulse<'a> {
    operand: &'a TestOperand,
    /// The scans for which it is ON.
    on: u64,
    /// The scans for which it is OFF then.
    off: u64,
}

/// The pulse at the beginning of steps.
fn pulse(steps: &[TestStep]) -> Option<SetPulse<'_>> {
    match steps {
        [
            TestStep::Set(up, 1),
            TestStep::Run(TestTime::Scans(on)),
            TestStep::Set(down, 0),
            TestStep::Run(TestTime::Scans(off)),
            ..,
        ] if up == down && up.cell.is_bit() => Some(SetPulse { operand: up, on: *on, off: *off }),
        _ => None,
    }
}

/// The text of a step. A run contains only a few kinds of steps.
fn step_text(step: &TestStep, layout: &Layout) -> String {
    match step {
        TestStep::Set(operand, value) => {
            format!("set {} {}", operand.name, layout.text(operand.cell, *value))
        }
        TestStep::Run(TestTime::Scans(1)) => "run 1 scans".to_owned(),
        TestStep::Run(TestTime::Scans(scans)) => format!("run {scans} scans"),
        TestStep::Run(TestTime::Ms(ms)) => format!("run {ms}ms"),
        TestStep::Pulse { operand, on: TestTime::Ms(on), every: TestTime::Ms(every), times } => {
            format!("pulse {} {on}ms every {every}ms times {times}", operand.name)
        }
        TestStep::Force(..)
        | TestStep::Unforce(_)
        | TestStep::Pulse { .. }
        | TestStep::Beat { .. }
        | TestStep::Expect(_)
        | TestStep::Within(..)
        | TestStep::Hold(..)
        | TestStep::Stop
        | TestStep::Start
        | TestStep::Restart { .. }
        | TestStep::PowerCut(_)
        | TestStep::Reload(_)
        | TestStep::Lose(_)
        | TestStep::Restore(_)
        | TestStep::Clock(_) => String::new(),
    }
}

/// A TOML string.
pub(super) fn quoted(text: &str) -> String {
    serde_json::to_string(text).unwrap_or_default()
}
