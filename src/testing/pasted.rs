//! A random run as a scenario: to be played again, and as text to paste into a test file.

use super::player::Stage;
use super::random_run::{BrokenRun, RandomEvent};
use super::suite::{Operand, RandomTest, Scenario, Step, TestTime};
use crate::engine::Layout;
use crate::source::span::Located;

/// A run as a scenario.
pub(super) struct PastedRun {
    pub scenario: Scenario,
    pub text: String,
}

/// Makes a scenario of a run that broke a line of `always`.
pub(super) fn pasted(stage: Stage, test: &RandomTest, broken: &BrokenRun) -> PastedRun {
    let layout = &stage.programs[0].symbols.layout;
    let mut steps: Vec<Step> = Vec::new();
    let mut scan = 0;
    for RandomEvent { scan: at, change, value } in &broken.events {
        if *at > scan {
            steps.push(Step::Run(TestTime::Scans(at - scan)));
            scan = *at;
        }
        steps.push(Step::Set(test.changes[*change].operand.clone(), *value));
    }
    steps.push(Step::Run(TestTime::Scans(broken.scan + 1 - scan)));
    let mut text = format!("[[scenario]]\nname  = {}\n", quoted(&test.name));
    if !test.set.is_empty() {
        let set = |(operand, value): &(Operand, i32)| {
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

/// The steps that a run is made of.
fn step_text(step: &Step, layout: &Layout) -> String {
    match step {
        Step::Set(operand, value) => {
            format!("set {} {}", operand.name, layout.text(operand.cell, *value))
        }
        Step::Run(TestTime::Scans(1)) => "run 1 scans".to_owned(),
        Step::Run(TestTime::Scans(scans)) => format!("run {scans} scans"),
        Step::Run(TestTime::Ms(ms)) => format!("run {ms}ms"),
        Step::Force(..)
        | Step::Unforce(_)
        | Step::Pulse { .. }
        | Step::Beat { .. }
        | Step::Expect(_)
        | Step::Within(..)
        | Step::Hold(..)
        | Step::Stop
        | Step::Start
        | Step::Restart
        | Step::PowerCut { .. }
        | Step::Reload(_)
        | Step::Lose(_)
        | Step::Restore(_)
        | Step::Clock(_) => String::new(),
    }
}

/// A TOML string.
pub(super) fn quoted(text: &str) -> String {
    serde_json::to_string(text).unwrap_or_default()
}
