//! Tries a path on the rig, as `rungd test` would play it: the path becomes a scenario.
//!
//! Called by `decide` and `equal`. No answer tells a path that was not tried.

use crate::model::{FreeInput, Path, ProofModel, ProofStart, Run};
use crate::question::{InputSetting, NamedInput, Questions};
use rungd_lab::testing::{
    Condition, FoundRun, TestOperand, TestStep, TestTime, TriedRun, try_run, try_violation,
};

/// A path about the model of [`Questions`].
pub(crate) struct Trial<'q> {
    pub questions: &'q Questions,
    /// The values of all inputs, by scan.
    pub path: &'q Path,
}

impl Trial<'_> {
    /// Tries whether the path breaks a line at its last scan.
    pub fn violation(&self, line: usize) -> TriedRun {
        let Questions { suite, programs, lines, .. } = self.questions;
        let name = format!("violates: {}", lines[line].text);
        try_violation(
            suite,
            programs,
            line,
            FoundRun { name, set: self.set(), steps: self.steps() },
        )
    }

    /// Tries whether a condition is true after the path.
    pub fn witness(&self, condition: &Condition) -> TriedRun {
        let Questions { suite, programs, .. } = self.questions;
        try_run(suite, programs, self.run(format!("shows: {}", condition.text), condition))
    }

    /// The path as a run after which a condition is true.
    pub fn run(&self, name: String, condition: &Condition) -> FoundRun {
        let mut steps = self.steps();
        steps.push(TestStep::Expect(condition.clone()));
        FoundRun { name, set: self.set(), steps }
    }

    /// Plays the path to a state from which nothing leads to a condition.
    pub fn dead_end(&self, condition: &str) -> TriedRun {
        let Questions { suite, programs, .. } = self.questions;
        let mut steps = self.steps();
        if steps.is_empty() {
            steps.push(TestStep::Run(TestTime::Scans(1)));
        }
        try_run(
            suite,
            programs,
            FoundRun { name: format!("from here never: {condition}"), set: self.set(), steps },
        )
    }

    /// The retained values before the first scan that are not those of a cold start.
    fn set(&self) -> Vec<(TestOperand, i32)> {
        let Questions { model, inputs, .. } = self.questions;
        let Some(first) = self.path.scans.first() else { return Vec::new() };
        let all = inputs.iter().zip(&model.inputs).zip(first);
        let set = all.filter_map(|((named, input), value)| match &named.setting {
            InputSetting::Start(operand) if Some(*value) != input.cold => {
                Some((operand.clone(), *value))
            }
            InputSetting::Start(_)
            | InputSetting::Set(_)
            | InputSetting::Force(_)
            | InputSetting::Any => None,
        });
        set.collect()
    }

    fn steps(&self) -> Vec<TestStep> {
        let inputs: Vec<Option<&NamedInput>> = self.questions.inputs.iter().map(Some).collect();
        steps(&self.questions.model, &inputs, self.path)
    }
}

/// A path as steps: what changes before each scan, and the scans. `inputs`: by input of the model;
/// `None`: a test cannot set it.
pub(crate) fn steps(
    model: &ProofModel,
    inputs: &[Option<&NamedInput>],
    path: &Path,
) -> Vec<TestStep> {
    let mut run = Run::new(model);
    // What a device moves has any level before it is forced.
    let is_cold = matches!(model.start, ProofStart::Cold(_));
    let level = |(named, input): (&Option<&NamedInput>, &FreeInput)| {
        let is_known =
            |named: &&NamedInput| !(matches!(named.setting, InputSetting::Force(_)) && is_cold);
        named.filter(is_known).map(|_| model.before_start(input))
    };
    let mut levels: Vec<Option<i32>> = inputs.iter().zip(&model.inputs).map(level).collect();
    let (mut steps, mut still) = (Vec::new(), 0);
    for scan in &path.scans {
        let mut changes = Vec::new();
        for (at, value) in scan.iter().take(inputs.len()).enumerate() {
            let Some(named) = inputs[at] else { continue };
            // A level stays; what is written once may have been overwritten by the ladder.
            let before = match named.keeps_its_level() {
                true => levels[at],
                false => Some(run.engine.image().value(model.inputs[at].cell)),
            };
            if before != Some(*value) {
                changes.extend(named.step(*value));
            }
            levels[at] = Some(*value);
        }
        // In the first scan no time has passed.
        let late = if run.scans > 0 { model.periods(scan) - 1 } else { 0 };
        changes.extend((late > 0).then_some(TestStep::Late(late)));
        if !changes.is_empty() && still > 0 {
            steps.push(TestStep::Run(TestTime::Scans(still)));
            still = 0;
        }
        steps.append(&mut changes);
        run.scan(scan);
        still += 1;
    }
    if still > 0 {
        steps.push(TestStep::Run(TestTime::Scans(still)));
    }
    steps
}

impl NamedInput {
    /// Whether a value that was given once stays until the next one.
    fn keeps_its_level(&self) -> bool {
        match &self.setting {
            InputSetting::Set(operand) => operand.input.is_some(),
            InputSetting::Force(_) => true,
            InputSetting::Start(_) | InputSetting::Any => false,
        }
    }

    /// The step that gives it a value; `None`: a test cannot.
    fn step(&self, value: i32) -> Option<TestStep> {
        match &self.setting {
            InputSetting::Set(operand) => Some(TestStep::Set(operand.clone(), value)),
            InputSetting::Force(operand) => Some(TestStep::Force(operand.clone(), value)),
            InputSetting::Start(_) | InputSetting::Any => None,
        }
    }
}
