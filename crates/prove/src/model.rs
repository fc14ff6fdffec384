//! A model: a program that judges itself, and what may change before each of its scans.
//!
//! `question` makes it from a test file. `explore` executes it on the engine, `encode` turns it
//! into gates, and both mean the same scan: that of [`Run::scan`]. It has no names.

use crate::events::{DownTime, Happening, ModelEvents, ScanEvent};
use crate::stage_start::StageStart;
use rungd_base::calendar::LocalTime;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::{
    BitCell, BlockRole, Cell, Engine, EngineProgram, EngineState, Image, ScanTimes,
};

/// Why a question about a period like 250us stays open.
pub(crate) const UNEVEN_PERIOD: &str =
    "timers count milliseconds, and the period is no whole number of them";

/// A program that judges itself.
#[derive(Clone, Debug)]
pub struct ProofModel {
    /// The ladder, with the blocks that judge it (`lower_judged`).
    pub code: EngineProgram,
    /// The period. A question about one that is no number of whole milliseconds stays open
    /// (`explore`, `encode`).
    pub period: ScanPeriod,
    /// The maximum number of periods from one scan to the next; 1: every scan comes exactly a
    /// period after the last one.
    pub late_max: u32,
    /// What the first scan begins with.
    pub start: ProofStart,
    /// What may change before each scan. Everything else changes by the program alone.
    pub inputs: Vec<FreeInput>,
    /// The bits that are ON in every scan whose inputs are allowed. They are evaluated behind the
    /// inputs, before all rungs.
    pub assumed: Vec<BitCell>,
    /// The bits of the conditions that are asked about. They have their values at the end of every
    /// scan.
    pub judged: Vec<BitCell>,
    /// What may happen to the controller behind each scan.
    pub events: ModelEvents,
    /// The Programs whose Stages are free before the first scan.
    pub stage_starts: Vec<StageStart>,
}

impl ProofModel {
    /// An engine in RUN, before the first scan.
    pub(crate) fn begun(&self) -> Engine {
        let mut engine = Engine::new(self.code.clone());
        match &self.start {
            ProofStart::Cold(restored) => {
                restored.iter().for_each(|(cell, value)| engine.restore(*cell, *value));
                engine.start(0);
            }
            ProofStart::Given(state) => {
                let resumes = engine.resume(state);
                assert!(resumes, "a state of the model's program");
            }
        }
        engine
    }

    /// The period, ms.
    pub fn period_ms(&self) -> u32 {
        self.period.ms_up()
    }

    /// The period, ns.
    pub(crate) fn period_ns(&self) -> u64 {
        self.period.ns()
    }

    /// The time of the first scan, ns.
    pub(crate) fn first_ns(&self) -> u64 {
        match &self.start {
            ProofStart::Cold(_) => 0,
            ProofStart::Given(state) => state.now_ns() + self.period_ns(),
        }
    }

    /// The values of the inputs that nothing changes: those of a given state; of a cold start, 0
    /// or the nearest value.
    pub(crate) fn resting(&self) -> Vec<i32> {
        let before = |input: &FreeInput| input.cold.unwrap_or_else(|| self.before_start(input));
        let value = |input: &FreeInput| before(input).clamp(input.low, input.high);
        self.inputs.iter().map(value).collect()
    }

    /// The maximum number of periods between two scans. From a given state, all are in time.
    pub(crate) fn periods_max(&self) -> u32 {
        match &self.start {
            ProofStart::Cold(_) => self.late_max,
            ProofStart::Given(_) => 1,
        }
    }

    /// The memory of a process that finds nothing, before its start.
    pub(crate) fn fresh(&self) -> EngineState {
        let mut engine = Engine::new(self.code.clone());
        if let ProofStart::Cold(restored) = &self.start {
            restored.iter().for_each(|(cell, value)| engine.restore(*cell, *value));
        }
        EngineState::of(&engine)
    }

    /// What is chosen for each scan: the values of the inputs; then, if scans may come late, the
    /// number of periods since the scan before; then, if something may happen behind it, the number
    /// of that event in [`ModelEvents::kinds`], from 1.
    pub fn choices(&self) -> Vec<Choice> {
        let inputs = self.inputs.iter().zip(self.resting());
        let inputs = inputs.map(|(input, resting)| {
            let FreeInput { low, high, .. } = *input;
            Choice { low, high, resting }
        });
        let high = self.periods_max().cast_signed();
        let late = (high > 1).then_some(Choice { low: 1, high, resting: 1 });
        let kinds = self.events.kinds.len() as i32;
        let event = (kinds > 0).then_some(Choice { low: 0, high: kinds, resting: 0 });
        inputs.chain(late).chain(event).collect()
    }

    /// The place of the number of periods among the choices of a scan.
    pub(crate) fn late_place(&self) -> Option<usize> {
        (self.periods_max() > 1).then_some(self.inputs.len())
    }

    /// The place of the event among the choices of a scan.
    pub(crate) fn event_place(&self) -> Option<usize> {
        let place = self.inputs.len() + usize::from(self.late_place().is_some());
        (!self.events.kinds.is_empty()).then_some(place)
    }

    /// The number of periods since the scan before.
    pub fn periods(&self, choices: &[i32]) -> u32 {
        let late = self.late_place().and_then(|place| choices.get(place));
        late.map_or(1, |periods| periods.unsigned_abs())
    }

    /// What happens behind a scan.
    pub fn event(&self, choices: &[i32]) -> Option<ScanEvent> {
        let number = *choices.get(self.event_place()?)?;
        self.events.kinds.get(usize::try_from(number).ok()?.checked_sub(1)?).copied()
    }

    /// The time without a process, if one ends behind a scan, ms; the longest one for all that are
    /// longer.
    pub(crate) fn down_ms(&self, choices: &[i32]) -> u32 {
        let seconds = self.down_place().map_or(0, |at| choices[at]);
        seconds.unsigned_abs().saturating_mul(1000)
    }

    /// The place of the time without a process among the choices of a scan.
    pub(crate) fn down_place(&self) -> Option<usize> {
        let DownTime { next, .. } = self.events.down?;
        self.inputs.iter().position(|input| input.cell == Cell::Word(next))
    }

    /// The time of the next scan of an engine, ns: the first one is at the start of RUN.
    pub fn next_ns(&self, engine: &Engine, choices: &[i32]) -> u64 {
        match engine.scans() {
            0 => engine.start_ns(),
            _ => engine.now_ns() + u64::from(self.periods(choices)) * self.period_ns(),
        }
    }

    /// The value of an input before the first scan.
    pub(crate) fn before_start(&self, input: &FreeInput) -> i32 {
        match &self.start {
            ProofStart::Cold(restored) => {
                let set = restored.iter().find(|(cell, _)| *cell == input.cell);
                set.map_or(0, |(_, value)| *value)
            }
            ProofStart::Given(state) => state.value(input.cell),
        }
    }

    /// Begins a scan on an engine, with these choices: its `execute` comes next.
    pub(crate) fn begin_scan(&self, engine: &mut Engine, at: ScanPlace, choices: &[i32]) {
        if self.event(choices).is_some_and(ScanEvent::ends_run) {
            engine.request_stop();
        }
        let ScanPlace { now_ns, is_first } = at;
        engine.begin_scan(now_ns, &ScanTimes::default(), &LocalTime::default());
        for (input, value) in self.inputs.iter().zip(choices) {
            if !is_first && !input.is_of_every_scan() {
                continue;
            }
            match input.cell {
                Cell::Bit(bit) => engine.write_bit(bit, *value != 0),
                Cell::Word(word) => engine.write_word(word, *value),
                Cell::WordBit(_) => unreachable!("an input is a whole cell"),
            }
        }
        if is_first {
            self.stage_starts.iter().for_each(|start| start.begin(engine));
        }
    }

    /// Whether the inputs of the scan that has left this memory were allowed.
    pub(crate) fn allows(&self, image: &Image) -> bool {
        self.assumed.iter().all(|bit| image.bit(*bit))
    }
}

/// The place of a scan in a path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanPlace {
    /// Its time, ns.
    pub now_ns: u64,
    /// Whether it is the first one of the path.
    pub is_first: bool,
}

/// What the first scan begins with. [`ProofModel::begun`] alone makes an engine of it.
#[derive(Clone, Debug)]
pub enum ProofStart {
    /// A cold start, with other values in some cells.
    Cold(Vec<(Cell, i32)>),
    /// The state of an engine in RUN, between two scans, at whole ms
    /// ([`EngineState::at_whole_ms`]). What is forced stays forced.
    Given(Box<EngineState>),
}

impl ProofStart {
    /// Whether a cell keeps its value in every scan, because it is forced.
    pub(crate) fn is_forced(&self, cell: Cell) -> bool {
        match self {
            ProofStart::Cold(_) => false,
            ProofStart::Given(state) => state.is_forced(cell),
        }
    }
}

/// What is looked for: the end of a scan at which a bit has a value. A line of `always` is broken
/// where its bit is OFF; a witness shows a bit that is ON.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// One of [`ProofModel::judged`].
    pub bit: BitCell,
    /// Its value.
    pub value: bool,
}

impl Target {
    /// Whether memory at the end of a scan shows it.
    pub fn is_met(self, image: &Image) -> bool {
        image.bit(self.bit) == self.value
    }
}

/// A bit or word that may change before each scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FreeInput {
    /// Its cell: a bit or a word, never a bit of a word.
    pub cell: Cell,
    /// The smallest content of the cell; 0 for a bit.
    pub low: i32,
    /// The largest content of the cell; 1 for a bit.
    pub high: i32,
    /// If it is free before the first scan alone: its content after a cold start.
    pub cold: Option<i32>,
}

impl FreeInput {
    /// The choice of a Program's Stages before the first scan: whether it runs, whether it begins
    /// at its initial Stage, and its Stages. A Program with autostart begins at a cold start.
    pub fn of_stages(start: &StageStart, code: &EngineProgram) -> Vec<FreeInput> {
        let role = code.blocks[start.chosen.program.0 as usize].role;
        let begins = matches!(role, BlockRole::Program { autostart: true });
        let bit = |bit: BitCell, cold: bool| FreeInput {
            cell: Cell::Bit(bit),
            low: 0,
            high: 1,
            cold: Some(cold.into()),
        };
        let runs = (!start.runs).then(|| bit(start.chosen.running(), begins));
        let stages = (0..start.chosen.stages).map(|n| bit(start.chosen.stage(n), false));
        runs.into_iter().chain([bit(start.chosen.begins(), begins)]).chain(stages).collect()
    }

    /// Whether it may change before every scan.
    pub(crate) fn is_of_every_scan(&self) -> bool {
        self.cold.is_none()
    }
}

impl DownTime {
    /// The choice of the time without a process.
    pub(crate) fn input(self) -> FreeInput {
        FreeInput { cell: Cell::Word(self.next), low: 0, high: DownTime::MAX, cold: None }
    }
}

/// The values of something that is chosen for each scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The smallest value.
    pub low: i32,
    /// The largest value.
    pub high: i32,
    /// The value if nothing happens.
    pub resting: i32,
}

/// What is chosen for each scan from the first one on, in the order of [`ProofModel::choices`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Path {
    /// By scan.
    pub scans: Vec<Vec<i32>>,
}

/// What the end of a scan shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScanOutcome {
    /// Whether its inputs were allowed. If not, there is no such scan.
    pub is_allowed: bool,
    /// The values of [`ProofModel::judged`].
    pub judged: Vec<bool>,
    /// Whether it was the last one: the ladder has stopped the controller, and nothing starts it.
    pub is_last: bool,
}

/// A model that is executed from its start.
#[derive(Debug)]
pub struct Run<'m> {
    model: &'m ProofModel,
    /// The engine, between two scans.
    pub engine: Engine,
    /// The number of scans so far.
    pub scans: u64,
    /// What happens behind the last scan, before the next one.
    happens: Option<Happening>,
    /// The memory of a process that finds nothing, if processes may end.
    fresh: Option<Box<EngineState>>,
}

impl<'m> Run<'m> {
    /// A run before its first scan.
    pub fn new(model: &'m ProofModel) -> Run<'m> {
        let fresh = (!model.events.kinds.is_empty()).then(|| Box::new(model.fresh()));
        Run { model, engine: model.begun(), scans: 0, happens: None, fresh }
    }

    /// Goes on from the state of an engine behind a number of scans.
    pub fn resume(&mut self, state: &EngineState, scans: u64) {
        let resumes = self.engine.resume(state);
        assert!(resumes, "a state of the same program");
        (self.scans, self.happens) = (scans, None);
    }

    /// Lets happen what happens behind the last scan: memory is then that of the next scan's
    /// start.
    pub fn settle(&mut self) {
        if let (Some(fresh), Some(happens)) = (&self.fresh, self.happens.take()) {
            self.model.events.happen(&mut self.engine, fresh, happens);
        }
    }

    /// Whether a path is allowed, and leads to a target at its last scan.
    pub(crate) fn leads_to(model: &ProofModel, target: Target, path: &Path) -> bool {
        let Some(at) = model.judged.iter().position(|bit| *bit == target.bit) else { return false };
        let (mut run, mut is_met) = (Run::new(model), false);
        for (scan, choices) in (1..).zip(&path.scans) {
            let outcome = run.scan(choices);
            if !outcome.is_allowed || outcome.is_last && scan < path.scans.len() {
                return false;
            }
            is_met = outcome.judged[at] == target.value;
        }
        is_met
    }

    /// The model.
    pub fn model(&self) -> &'m ProofModel {
        self.model
    }

    /// Executes one scan with these choices. Call it no more after the last scan.
    pub fn scan(&mut self, choices: &[i32]) -> ScanOutcome {
        self.scan_with(choices, |engine| engine.execute().last)
    }

    /// Does the same; `execute` executes the scan that has begun, and says whether it is the last
    /// one.
    pub fn scan_with(
        &mut self,
        choices: &[i32],
        execute: impl FnOnce(&mut Engine) -> bool,
    ) -> ScanOutcome {
        self.settle();
        let now_ns = self.model.next_ns(&self.engine, choices);
        let engine = &mut self.engine;
        let is_first = self.scans == 0;
        self.model.begin_scan(engine, ScanPlace { now_ns, is_first }, choices);
        let ends = execute(engine);
        let is_allowed = self.model.allows(engine.image());
        let on = |bit: &BitCell| engine.image().bit(*bit);
        let judged = self.model.judged.iter().map(on).collect();
        let event = self.model.event(choices);
        let is_last = ends && !event.is_some_and(ScanEvent::continues);
        let next_ns = now_ns + self.model.period_ns();
        let happens = Happening { event, is_first, is_last: ends, next_ns };
        self.happens = (!is_last).then_some(happens);
        self.scans += 1;
        ScanOutcome { is_allowed, judged, is_last }
    }
}
