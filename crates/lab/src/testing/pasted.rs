//! A random run as a scenario that can be played again, and as text to paste into a test file.

use std::sync::Arc;

use super::lowered_suite::LoweredSuite;
use super::random_run::{BrokenRun, RandomEvent};
use super::random_world::{RandomDraw, STARTED};
use super::suite::{Incident, RandomSource, RandomTest, Scenario, TestOperand, TestStep, TestTime};
use crate::rig::{PowerOff, RigProgram};
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::DeviceId;
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
    let mut steps = RandomSteps { test, steps: Vec::new(), scan: 0, last: Vec::new() };
    broken.events.iter().for_each(|event| steps.add(event));
    steps.run_to(broken.scan + 1);
    let mut steps = steps.steps;
    if has_pulses {
        steps = pulses(steps, stage.programs[0].controller.period);
    }
    let located = |value| Located { value, span: test.span };
    let steps = steps.into_iter().map(located).collect();
    let scenario =
        Scenario { name: test.name.clone(), span: test.span, set: test.set.clone(), steps };
    let text = scenario_text(&scenario, stage.programs);
    PastedRun { scenario, text }
}

/// A scenario as text to paste into a test file.
pub(super) fn scenario_text(scenario: &Scenario, programs: &[Arc<RigProgram>]) -> String {
    let program = &programs[0];
    let mut text = format!("[[scenario]]\nname  = {}\n", quoted(&scenario.name));
    if !scenario.set.is_empty() {
        let set = |(operand, value): &(TestOperand, i32)| {
            format!("{} = {}", quoted(&operand.name), value_text(program, operand, *value))
        };
        let all: Vec<String> = scenario.set.iter().map(set).collect();
        text += &format!("set   = {{ {} }}\n", all.join(", "));
    }
    text += "steps = [\n";
    for step in &scenario.steps {
        text += &format!("    {},\n", quoted(&step_text(&step.value, program)));
    }
    text + "]\n"
}

/// The steps of a run, so far.
struct RandomSteps<'t> {
    test: &'t RandomTest,
    steps: Vec<TestStep>,
    /// The number of scans of these steps.
    scan: u64,
    /// The stop, with what follows it, whose last scan is the next one. Its scan comes after the
    /// changes of that scan.
    last: Vec<TestStep>,
}

impl RandomSteps<'_> {
    fn add(&mut self, event: &RandomEvent) {
        self.run_to(event.scan);
        let incident = match self.test.source(event.source) {
            RandomSource::Change(change) => {
                return self.steps.push(TestStep::Set(change.operand.clone(), event.value));
            }
            RandomSource::Incident(incident) => incident,
        };
        match incident {
            Incident::Device { id, .. } if event.draw == RandomDraw::Lose(true) => {
                self.steps.push(TestStep::Lose(*id));
            }
            Incident::Device { id, .. } => self.steps.push(TestStep::Restore(*id)),
            Incident::PowerCut => {
                self.steps.push(TestStep::PowerCut(PowerOff { down_ms: 0, lose_ms: 0 }));
                if event.value == STARTED {
                    self.steps.push(TestStep::Start);
                }
            }
            Incident::Restart => self.last = vec![TestStep::Restart { down_ms: 0 }],
            Incident::Stop => self.last = vec![TestStep::Stop, TestStep::Start],
        }
    }

    /// Adds scans up to one, from 0.
    fn run_to(&mut self, scan: u64) {
        if scan > self.scan && !self.last.is_empty() {
            self.steps.append(&mut self.last);
            self.scan += 1;
        }
        if scan > self.scan {
            self.steps.push(TestStep::Run(TestTime::Scans(scan - self.scan)));
            self.scan = scan;
        }
    }
}

/// Replaces equal pulses (a bit goes ON and OFF again, at least twice) by one step.
fn pulses(steps: Vec<TestStep>, period: ScanPeriod) -> Vec<TestStep> {
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
        let ms = |scans: u64| whole_ms(scans, period);
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

/// The time of some scans, if it is a number of whole ms.
fn whole_ms(scans: u64, period: ScanPeriod) -> Option<u32> {
    let us = scans.checked_mul(period.us())?;
    us.is_multiple_of(1000).then(|| u32::try_from(us / 1000).ok()).flatten()
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

/// The text of a step. A run that was found contains only a few kinds of steps.
fn step_text(step: &TestStep, program: &RigProgram) -> String {
    match step {
        TestStep::Set(operand, value) => {
            format!("set {} {}", operand.name, value_text(program, operand, *value))
        }
        TestStep::Run(TestTime::Scans(1)) => "run 1 scans".to_owned(),
        TestStep::Run(TestTime::Scans(scans)) => format!("run {scans} scans"),
        TestStep::Run(TestTime::Ms(ms)) => format!("run {ms}ms"),
        TestStep::Late(periods) => format!("late {periods}"),
        TestStep::Pulse { operand, on: TestTime::Ms(on), every: TestTime::Ms(every), times } => {
            format!("pulse {} {on}ms every {every}ms times {times}", operand.name)
        }
        TestStep::Lose(device) => format!("lose {}", device_name(program, *device)),
        TestStep::Restore(device) => format!("restore {}", device_name(program, *device)),
        TestStep::PowerCut(off) => format!("power-cut{}", down_text(off.down_ms)),
        TestStep::Restart { down_ms } => format!("restart{}", down_text(*down_ms)),
        TestStep::Stop => "stop".to_owned(),
        TestStep::Start => "start".to_owned(),
        TestStep::Force(operand, value) => {
            format!("force {} {}", operand.name, value_text(program, operand, *value))
        }
        TestStep::Expect(condition) => format!("expect: {}", condition.text),
        TestStep::Unforce(_)
        | TestStep::Pulse { .. }
        | TestStep::Beat { .. }
        | TestStep::Within(..)
        | TestStep::Hold(..)
        | TestStep::Reload(_)
        | TestStep::Clock(_) => String::new(),
    }
}

/// For how long no process runs.
fn down_text(down_ms: u32) -> String {
    match (down_ms, down_ms % 1000) {
        (0, _) => String::new(),
        (_, 0) => format!(" for {}s", down_ms / 1000),
        (_, _) => format!(" for {down_ms}ms"),
    }
}

fn value_text(program: &RigProgram, operand: &TestOperand, value: i32) -> String {
    program.layout_of(operand.device).text(operand.cell, value)
}

fn device_name(program: &RigProgram, device: DeviceId) -> &str {
    program.symbols.names.device(device)
}

/// A TOML string.
pub(super) fn quoted(text: &str) -> String {
    serde_json::to_string(text).unwrap_or_default()
}
