//! `from = "retained"`: what memory a process may find before its first scan.
//!
//! `question` calls it. A retained bit or word that something reads has any value within its limits
//! there; a bit that OUT alone drives is OFF, because the pass before the first scan turns it OFF.
//! Of a retained counter or timer `.Acc` has any value, and so have its flags and what its
//! instruction keeps, but for what every pass turns OFF: that a timer times, and the histories of
//! edges. The pass behind a crash also resets what is not retained, and turns outputs OFF that
//! begin ON. All this is more than a process finds, and holds for all that it can find. A scenario
//! sets what a test can set by `set`. Retained Stages are in `retained_stages`.

use std::collections::{HashMap, HashSet};

use crate::any::readers;
use crate::asked_events::{DOWN_SECONDS, EventQuestion};
use crate::events::KeptLimits;
use crate::explore::effects::{EffectCells, Effects};
use crate::model::FreeInput;
use crate::named_input::{InputSetting, NamedInput};
use rungd_engine::isa::{Address, Bit, Flag, Structure, Word};
use rungd_engine::ops::{CounterRule, TimerRule};
use rungd_engine::record::{FLAGS, RECORD, counter_state, sensaphone_state, timer_state};
use rungd_engine::{BitCell, Cell, Engine, EngineProgram, PassStep, WordCell};
use rungd_lab::rig::RigProgram;
use rungd_lab::testing::{Suite, TestOperand};

/// What may be retained before the first scan.
#[derive(Default)]
pub(crate) struct RetainedStart {
    /// What is free before the first scan.
    pub free: Vec<(FreeInput, NamedInput)>,
    /// What is retained, and no proof can vary yet.
    pub unknown: Option<String>,
}

/// Why a test cannot set the flags of a retained structure.
const BY_ITS_INSTRUCTION: &str = "retained flags, and what its instruction keeps";

/// What is free before the first scan. `asked`: what a new process restores.
pub(crate) fn retained(
    asked: &EventQuestion,
    suite: &Suite,
    rig: &RigProgram,
    code: &EngineProgram,
) -> RetainedStart {
    let remembered = |(place, _): &(Address, Address)| code.layout.cell(*place).map(Cell::whole);
    if !suite.proof.from_retained {
        return RetainedStart::default();
    }
    let mut search = StartSearch {
        rig,
        code,
        cold: Engine::new(code.clone()),
        readers: readers(code),
        driven: driven(code),
        passed: code.tables.terminations.iter().filter_map(passed).collect(),
        remembered: asked.remembered.iter().filter_map(remembered).collect(),
        seen: HashSet::new(),
        start: RetainedStart::default(),
    };
    let controller = &suite.programs[0].controller;
    for address in controller.retain.iter().flat_map(|range| range.addresses()) {
        match address {
            Address::Structure(structure) => search.structure(structure),
            Address::Bit(_) => search.value(address, BIT),
            Address::Word(word) => {
                let (low, high) = rig.symbols.limits(word);
                search.value(address, KeptLimits { low, high });
            }
        }
    }
    // Where nothing is retained, each process begins cold.
    if let Some(restored) = asked.restored(code) {
        restored.iter().for_each(|one| search.history(one.cell));
        search.down_seconds();
        code.tables.terminations.iter().for_each(|step| search.terminated(step));
    }
    search.start
}

/// The bits that a pass turns OFF, and that no operation writes whose pass does not.
fn driven(code: &EngineProgram) -> HashSet<Cell> {
    let (effects, mut writers) = (Effects::new(code), HashMap::<u32, usize>::new());
    for batch in &code.tables.batches {
        let written = code.tables.ops_of(*batch).flat_map(|op| effects.effect(&op).writes);
        let mut seen: Vec<u32> = written.collect();
        seen.sort_unstable();
        seen.into_iter().for_each(|cell| *writers.entry(cell).or_default() += 1);
    }
    let mut passes = HashMap::<u32, usize>::new();
    for step in &code.tables.terminations {
        if let Some(Cell::Bit(BitCell(bit))) = step.bit_off() {
            *passes.entry(bit).or_default() += 1;
        }
    }
    let is_driven = |(bit, passes): &(u32, usize)| writers.get(bit) == Some(passes);
    passes.into_iter().filter(is_driven).map(|(bit, _)| Cell::Bit(BitCell(bit))).collect()
}

/// The record that a step of a pass resets.
fn passed(step: &PassStep) -> Option<u32> {
    match step {
        PassStep::Counter(counter, _) => Some(counter.at),
        PassStep::Timer(timer, _) => Some(timer.at),
        PassStep::BitOff(_)
        | PassStep::WordBitOff(_)
        | PassStep::HistoryOff(_)
        | PassStep::HoldTimer(_)
        | PassStep::CountUp(_)
        | PassStep::CountDown(_)
        | PassStep::DisableTask(_)
        | PassStep::Pick(_) => None,
    }
}

/// The search for what is free.
struct StartSearch<'a> {
    rig: &'a RigProgram,
    code: &'a EngineProgram,
    /// Memory of a cold start.
    cold: Engine,
    readers: HashMap<u32, usize>,
    /// The bits that are OFF behind every pass.
    driven: HashSet<Cell>,
    /// The records that a pass resets.
    passed: HashSet<u32>,
    /// The places of `was(x)`.
    remembered: HashSet<Cell>,
    seen: HashSet<Cell>,
    start: RetainedStart,
}

impl StartSearch<'_> {
    fn unknown(&mut self, cause: String) {
        self.start.unknown = Some(cause);
    }

    /// A bit or word that a test can set.
    fn value(&mut self, address: Address, limits: KeptLimits) {
        let cells = [self.code.layout.cell(address), self.rig.symbols.layout.cell(address)];
        let [Some(cell), Some(own)] = cells else { return };
        let name = self.rig.symbols.names.name(address);
        let operand = TestOperand { name: name.clone(), cell: own, input: None, device: None };
        self.add(name, InputSetting::Start(operand), cell, limits);
    }

    /// A word that has any of its values.
    fn word(&mut self, word: Word) {
        let (low, high) = word.range();
        self.value(Address::Word(word), KeptLimits { low, high });
    }

    fn add(&mut self, name: String, setting: InputSetting, cell: Cell, limits: KeptLimits) {
        let number = EffectCells { bits: self.code.bit_count }.number(cell);
        let cold = self.cold.image().value(cell);
        let is_off = cold == 0 && self.driven.contains(&cell);
        if is_off || !self.readers.contains_key(&number) || !self.seen.insert(cell) {
            return;
        }
        if self.remembered.contains(&cell) {
            self.unknown(format!("`from`: `was({name})` of a retained value"));
        }
        let (low, high) = (limits.low.min(cold), limits.high.max(cold));
        let input = FreeInput { cell, low, high, cold: Some(cold) };
        self.start.free.push((input, NamedInput { name, setting, is_written: false }));
    }

    /// What a crash leaves that the pass before the first scan writes, whether retained or not.
    fn terminated(&mut self, step: &PassStep) {
        let layout = &self.code.layout;
        let structure = |at: u32| {
            let address = layout.address(Cell::Word(WordCell(at)));
            address.and_then(Address::structure)
        };
        let turned_off = step.bit_off().filter(|cell| self.cold.image().value(*cell) != 0);
        match turned_off.and_then(|cell| layout.address(cell.whole())) {
            Some(Address::Word(word)) => self.word(word),
            Some(address) => self.value(address, BIT),
            None => {}
        }
        match step {
            PassStep::Counter(counter, rule) => {
                if let Some(structure) = structure(counter.at) {
                    self.reset(structure, matches!(rule, CounterRule::Down(_)));
                }
            }
            PassStep::Timer(timer, rule) => {
                if let Some(structure) = structure(timer.at) {
                    self.reset(structure, *rule == TimerRule::Preset);
                }
            }
            PassStep::BitOff(_)
            | PassStep::WordBitOff(_)
            | PassStep::HistoryOff(_)
            | PassStep::HoldTimer(_)
            | PassStep::CountUp(_)
            | PassStep::CountDown(_)
            | PassStep::DisableTask(_)
            | PassStep::Pick(_) => {}
        }
    }

    /// A counter or timer that a pass may have reset, or that has not begun.
    fn reset(&mut self, structure: Structure, to_preset: bool) {
        if to_preset {
            self.word(Word::Acc(structure));
            self.own_bit(structure, FLAGS + counter_state::LOADED as usize);
        }
        if matches!(structure, Structure::Counter(_)) {
            (0..FLAGS).for_each(|place| self.own_bit(structure, place));
            return;
        }
        for flag in [Flag::Reset, Flag::Zero] {
            let flag = self.code.layout.bit(Bit::Flag(structure, flag));
            self.bit_of(structure, flag);
        }
    }

    /// The history of an SR, which is retained with its bits. No other cell without an address is
    /// left.
    fn history(&mut self, cell: Cell) {
        let layout = &self.code.layout;
        let records = layout.structure_count() * RECORD as u32;
        let is_of_record = matches!(cell, Cell::Bit(BitCell(bit)) if bit < records);
        if layout.address(cell).is_none() && !is_of_record {
            let setting = InputSetting::Any("the retained history of its `clk`");
            self.add("SR".to_owned(), setting, cell, BIT);
        }
    }

    /// A retained counter or timer.
    fn structure(&mut self, structure: Structure) {
        self.word(Word::Acc(structure));
        if let Structure::Sensaphone(n) = structure {
            self.word(Word::Pre(n));
        }
        for place in 0..RECORD {
            if !self.is_turned_off(structure, place) {
                self.own_bit(structure, place);
            }
        }
    }

    /// The time without a process.
    fn down_seconds(&mut self) {
        if let Some(cell) = self.code.layout.cell(DOWN_SECONDS) {
            let name = self.rig.symbols.names.name(DOWN_SECONDS);
            let limits = KeptLimits { low: 0, high: i32::MAX };
            self.add(name, InputSetting::Any("the time without a process"), cell, limits);
        }
    }

    /// A bit of a structure's record, by its place.
    fn own_bit(&mut self, structure: Structure, place: usize) {
        let first = self.code.layout.record_bits(structure).start;
        self.bit_of(structure, BitCell(first + place as u32));
    }

    fn bit_of(&mut self, structure: Structure, bit: BitCell) {
        let name = self.rig.symbols.names.name(Address::Structure(structure));
        let setting = InputSetting::Any(BY_ITS_INSTRUCTION);
        self.add(name, setting, Cell::Bit(bit), BIT);
    }

    /// Whether a bit of a structure's record, by its place, is OFF behind every pass: its owner
    /// alone turns it ON.
    fn is_turned_off(&self, structure: Structure, place: usize) -> bool {
        let owns = |state: u32| place == FLAGS + state as usize;
        let has_pass = self.passed.contains(&self.code.layout.word(Word::Acc(structure)).0);
        match structure {
            Structure::Sensaphone(_) => {
                [sensaphone_state::UP, sensaphone_state::DOWN].contains(&place)
            }
            Structure::Timer(_) => owns(timer_state::RUNNING) || has_pass && owns(timer_state::LEG),
            Structure::Counter(_) => {
                has_pass && (owns(counter_state::UP) || owns(counter_state::DN))
            }
        }
    }
}

/// The values of a bit.
const BIT: KeptLimits = KeptLimits { low: 0, high: 1 };
