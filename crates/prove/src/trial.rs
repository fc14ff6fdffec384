//! Tries a path on the rig, as `rungd test` would play it: the path becomes a scenario.
//!
//! Called by `decide` and `equal_difference`. No answer tells a path that was not tried.

use crate::events::ScanEvent;
use crate::model::{FreeInput, Path, ProofModel, ProofStart, Run};
use crate::named_input::{InputSetting, NamedInput};
use crate::question::Questions;
use crate::rig_memory::DeadEnd;
use crate::stage_start::StageStart;
use rungd_engine::{BitCell, Cell};
use rungd_lab::rig::PowerOff;
use rungd_lab::testing::{
    Condition, FoundRun, TestOperand, TestStep, TestTime, TriedRun, try_end, try_run, try_violation,
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

    /// Tries whether the path leads to a state from which nothing leads to a condition. What
    /// happens behind its last scan is a part of it.
    pub fn dead_end(&self, condition: &str, end: &DeadEnd) -> TriedRun {
        let Questions { suite, programs, .. } = self.questions;
        let inputs: Vec<Option<&NamedInput>> = self.questions.inputs.iter().map(Some).collect();
        let mut all = PathSteps::new(&self.questions.model, &inputs);
        self.path.scans.iter().for_each(|choices| all.add(choices, false));
        let mut steps = all.ended();
        if steps.is_empty() {
            steps.push(TestStep::Run(TestTime::Scans(1)));
        }
        let name = format!("from here never: {condition}");
        let run = FoundRun { name, set: self.set(), steps };
        try_end(suite, programs, run, |rig| end.is_of(rig))
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
            | InputSetting::Stored(_)
            | InputSetting::Set(_)
            | InputSetting::Force(_)
            | InputSetting::Device(_)
            | InputSetting::Follows
            | InputSetting::Any(_) => None,
        });
        let stages = model.stage_starts.iter();
        set.chain(stages.flat_map(|start| self.set_stages(start, first))).collect()
    }

    /// What an image says of a Program's Stages, if its start is not a cold one. `first`: the
    /// values before the first scan.
    fn set_stages(&self, start: &StageStart, first: &[i32]) -> Vec<(TestOperand, i32)> {
        let Questions { model, inputs, .. } = self.questions;
        let place = |bit: BitCell| {
            let cell = Cell::Bit(bit);
            model.inputs.iter().position(|input| input.cell == cell)
        };
        let is_chosen = |bit: BitCell| place(bit).is_some_and(|at| first[at] != 0);
        let operand = |bit: BitCell| match &inputs[place(bit)?].setting {
            InputSetting::Stored(operand) => Some(operand.clone()),
            InputSetting::Start(_)
            | InputSetting::Set(_)
            | InputSetting::Force(_)
            | InputSetting::Device(_)
            | InputSetting::Follows
            | InputSetting::Any(_) => None,
        };
        let chosen = start.chosen;
        let runs = start.runs || is_chosen(chosen.running());
        let begins = runs && is_chosen(chosen.begins());
        let by_itself = place(chosen.begins()).is_some_and(|at| model.inputs[at].cold == Some(1));
        let one = |bit: BitCell, value: i32| Some((operand(bit)?, value));
        if !runs || begins {
            let is_cold = begins == by_itself && runs == by_itself;
            let set = one(chosen.running(), runs.into()).filter(|_| !is_cold);
            return set.into_iter().collect();
        }
        let stages = (0..chosen.stages).map(|n| chosen.stage(n));
        let on: Vec<BitCell> = stages.filter(|bit| is_chosen(*bit)).collect();
        match on.is_empty() {
            true => one(chosen.stage(0), 0).into_iter().collect(),
            false => on.into_iter().filter_map(|bit| one(bit, 1)).collect(),
        }
    }

    fn steps(&self) -> Vec<TestStep> {
        let inputs: Vec<Option<&NamedInput>> = self.questions.inputs.iter().map(Some).collect();
        steps(&self.questions.model, &inputs, self.path)
    }
}

/// A path as steps: what changes before each scan, the scans, and what happens behind them.
/// `inputs`: by input of the model; `None`: a test cannot set it.
pub(crate) fn steps(
    model: &ProofModel,
    inputs: &[Option<&NamedInput>],
    path: &Path,
) -> Vec<TestStep> {
    let mut all = PathSteps::new(model, inputs);
    for (at, choices) in path.scans.iter().enumerate() {
        all.add(choices, at + 1 == path.scans.len());
    }
    all.ended()
}

/// The steps of a path, so far.
struct PathSteps<'p> {
    run: Run<'p>,
    inputs: &'p [Option<&'p NamedInput>],
    /// The levels that the inputs have kept; `None`: they are not known.
    levels: Vec<Option<i32>>,
    steps: Vec<TestStep>,
    /// The number of scans that are no step yet.
    still: u64,
}

impl<'p> PathSteps<'p> {
    fn new(model: &'p ProofModel, inputs: &'p [Option<&'p NamedInput>]) -> PathSteps<'p> {
        // What a device moves has any level before it is forced.
        let is_cold = matches!(model.start, ProofStart::Cold(_));
        let level = |(named, input): (&Option<&NamedInput>, &FreeInput)| {
            let is_known = |named: &&NamedInput| !(named.is_forced() && is_cold);
            named.filter(is_known).map(|_| model.before_start(input))
        };
        let levels = inputs.iter().zip(&model.inputs).map(level).collect();
        PathSteps { run: Run::new(model), inputs, levels, steps: Vec::new(), still: 0 }
    }

    fn ended(mut self) -> Vec<TestStep> {
        self.pass();
        self.steps
    }

    /// Adds a scan, with what changes before it and what happens behind it.
    fn add(&mut self, choices: &[i32], is_end: bool) {
        let model = self.run.model();
        let mut changes = self.changes(choices);
        // At a start of RUN no time has passed.
        let late = if self.run.engine.scans() > 0 { model.periods(choices) - 1 } else { 0 };
        changes.extend((late > 0).then_some(TestStep::Late(late)));
        if !changes.is_empty() {
            self.pass();
        }
        self.steps.append(&mut changes);
        let event = model.event(choices);
        self.run.scan(choices);
        match event.filter(|event| !is_end || event.ends_run()) {
            Some(event) => self.happen(event, model.down_ms(choices), is_end),
            None => self.still += 1,
        }
        self.run.settle();
    }

    /// What changes before a scan.
    fn changes(&mut self, choices: &[i32]) -> Vec<TestStep> {
        let model = self.run.model();
        let mut changes = Vec::new();
        for (at, value) in choices.iter().take(self.inputs.len()).enumerate() {
            let Some(named) = self.inputs[at] else { continue };
            // A level stays; what is written once may have been overwritten by the ladder.
            let before = match named.keeps_its_level() {
                true => self.levels[at],
                false => Some(self.run.engine.image().value(model.inputs[at].cell)),
            };
            if before != Some(*value) {
                changes.extend(named.step(*value));
            }
            self.levels[at] = Some(*value);
        }
        changes
    }

    /// Adds a scan and what happens behind it. `down_ms`: the time without a process, if one ends.
    fn happen(&mut self, event: ScanEvent, down_ms: u32, is_end: bool) {
        match event {
            ScanEvent::Stop => {
                self.pass();
                self.steps.push(TestStep::Stop);
                self.steps.extend((!is_end).then_some(TestStep::Start));
            }
            ScanEvent::Restart => {
                self.pass();
                let restart = TestStep::Restart { down_ms };
                self.steps.push(if is_end { TestStep::Stop } else { restart });
            }
            ScanEvent::PowerCut | ScanEvent::PowerCutBeforeImage => {
                self.still += 1;
                self.pass();
                self.steps.push(TestStep::PowerCut(PowerOff { down_ms, lose_ms: 0 }));
            }
            // Images come by themselves.
            ScanEvent::KeepImage => self.still += 1,
        }
        if event.begins_process() {
            // Forces end with a process.
            for (level, named) in self.levels.iter_mut().zip(self.inputs) {
                if named.is_some_and(NamedInput::is_forced) {
                    *level = None;
                }
            }
        }
    }

    /// Adds the scans that are no step yet.
    fn pass(&mut self) {
        if self.still > 0 {
            self.steps.push(TestStep::Run(TestTime::Scans(self.still)));
            self.still = 0;
        }
    }
}

impl NamedInput {
    /// Whether a device of the test moves it, so that it is forced.
    fn is_forced(&self) -> bool {
        matches!(self.setting, InputSetting::Force(_))
    }

    /// Whether a value that was given once stays until the next one.
    fn keeps_its_level(&self) -> bool {
        match &self.setting {
            InputSetting::Set(operand) => operand.input.is_some(),
            InputSetting::Force(_) | InputSetting::Device(_) => true,
            InputSetting::Start(_)
            | InputSetting::Stored(_)
            | InputSetting::Follows
            | InputSetting::Any(_) => false,
        }
    }

    /// The step that gives it a value; `None`: a test cannot.
    fn step(&self, value: i32) -> Option<TestStep> {
        match &self.setting {
            InputSetting::Set(operand) => Some(TestStep::Set(operand.clone(), value)),
            InputSetting::Force(operand) => Some(TestStep::Force(operand.clone(), value)),
            InputSetting::Device(device) if value == 0 => Some(TestStep::Lose(*device)),
            InputSetting::Device(device) => Some(TestStep::Restore(*device)),
            InputSetting::Start(_)
            | InputSetting::Stored(_)
            | InputSetting::Follows
            | InputSetting::Any(_) => None,
        }
    }
}
