//! How much of a counter's or timer's `.Acc` matters.
//!
//! Behind its preset, a timer counts on for days, and nothing in the ladder changes. If the preset
//! is a constant, and nothing else than the structure itself and compares with constants reads
//! `.Acc`, then its gates stop just behind the last value that can be seen; if no compare does, a
//! timer counts scans in place of milliseconds. What the ladder does is the same in every scan.

use rungd_engine::isa::{Address, Word, WordSpace};
use rungd_engine::ops::{
    CellRange, Control, ControlKind, CounterRule, FormulaStep, Math, MathTarget, Offdtmr, Ondtmr,
    Op, Timer, Tmr, Tmra, Tmradown, Tmrdown, TouchedCells, WordRead, reads,
};
use rungd_engine::{Cell, ElementCode, EngineProgram, Image, PassStep, WordCell};
use rustc_hash::{FxHashMap, FxHashSet};

use super::written::{WordRange, WrittenCells};
use crate::model::ProofModel;

/// The form of an `.Acc`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AccForm {
    /// Its content, limited to these values.
    Limited {
        /// The smallest.
        low: i32,
        /// The largest.
        high: i32,
    },
    /// The number of scans whose time it has, rounded up, at most so many.
    Scans {
        /// The largest.
        high: i32,
    },
}

/// In which direction an owner counts.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Counting {
    /// A timer from 0 on.
    TimeUp,
    /// A timer down to 0.
    TimeDown,
    /// CNT.
    Up,
    /// CNTDN.
    Down,
    /// UDC: to both sides, so that every value matters.
    Both,
}

/// What is known of a structure's `.Acc`.
struct Uses {
    /// Its owners; more than one is a surprise.
    owners: Vec<Counting>,
    /// The words of its presets.
    presets: Vec<u32>,
    /// Whether something in its element may end an execution before it, and keeps its time.
    keeps_time: bool,
    /// The constants that it is compared with.
    compared: Vec<i32>,
}

/// The search for forms.
struct FormSearch<'m> {
    code: &'m EngineProgram,
    image: &'m Image,
    written: &'m WrittenCells<'m>,
    uses: FxHashMap<u32, Uses>,
    /// Words that something else reads or writes.
    seen: FxHashSet<u32>,
    inputs: FxHashSet<u32>,
    period_ms: i32,
}

/// The forms of those `.Acc` that do not need all their bits.
pub(super) fn acc_forms(
    model: &ProofModel,
    image: &Image,
    written: &WrittenCells,
) -> FxHashMap<u32, AccForm> {
    let code = &model.code;
    let words = model.inputs.iter().filter_map(|input| match input.cell {
        Cell::Word(WordCell(word)) => Some(word),
        Cell::Bit(_) | Cell::WordBit(_) => None,
    });
    let inputs: FxHashSet<u32> = words.collect();
    let mut search = FormSearch {
        code,
        image,
        written,
        uses: FxHashMap::default(),
        seen: inputs.clone(),
        inputs,
        period_ms: model.period_ms().max(1).cast_signed(),
    };
    code.blocks.iter().for_each(|block| search.element(&block.own));
    code.stages.iter().for_each(|stage| search.element(stage));
    for pick in &code.tables.picks {
        search.math(pick, &code.tables.steps[pick.first as usize..][..pick.count as usize]);
    }
    code.tables.terminations.iter().for_each(|step| search.pass(step));
    let uses = search.uses.iter();
    uses.filter_map(|(word, uses)| Some((*word, search.form(*word, uses)?))).collect()
}

impl FormSearch<'_> {
    fn element(&mut self, element: &ElementCode) {
        let tables = &self.code.tables;
        let batches = || element.batches.clone().map(|at| tables.batches[at as usize]);
        let keeps_time = batches().flat_map(|batch| tables.ops_of(batch)).any(|op| keeps_time(&op));
        for batch in batches() {
            for (nth, op) in (0..).zip(tables.ops_of(batch)) {
                if let Op::Math(math) = &op {
                    self.math(math, &tables.formula(batch, nth));
                } else {
                    self.op(&op, keeps_time);
                }
            }
        }
    }

    fn op(&mut self, op: &Op, keeps_time: bool) {
        if let Some((timer, counting)) = timer_of(op) {
            self.owner(timer.at, counting, timer.preset);
            self.uses(timer.at).keeps_time |= keeps_time;
        } else if let Op::Cnt(op) = op {
            self.owner(op.counter.at, Counting::Up, op.preset);
        } else if let Op::Cntdn(op) = op {
            self.owner(op.counter.at, Counting::Down, op.preset);
        } else if let Op::Udc(op) = op {
            self.rule(op.counter.at, &CounterRule::UpDown(op.presets));
            self.uses(op.counter.at).owners.push(Counting::Both);
        } else if let Op::Rstt(op) = op {
            self.preset(op.timer.at, op.timer.preset);
        } else if let Op::Rstct(op) = op {
            self.rule(op.counter.at, &op.rule);
        } else if let Op::Less(op) = op {
            self.compared(op.a, op.b);
        } else if let Op::Equal(op) = op {
            self.compared(op.a, op.b);
        } else if let Op::Control(control) = op {
            self.control(control);
        } else {
            self.others(op);
        }
    }

    fn uses(&mut self, word: u32) -> &mut Uses {
        self.uses.entry(word).or_insert(Uses {
            owners: Vec::new(),
            presets: Vec::new(),
            keeps_time: false,
            compared: Vec::new(),
        })
    }

    fn owner(&mut self, word: u32, counting: Counting, preset: WordRead) {
        self.preset(word, preset);
        self.uses(word).owners.push(counting);
    }

    fn preset(&mut self, word: u32, preset: WordRead) {
        self.seen.insert(preset.0);
        self.uses(word).presets.push(preset.0);
    }

    fn rule(&mut self, word: u32, rule: &CounterRule) {
        match rule {
            CounterRule::Up(preset) | CounterRule::Down(preset) => self.preset(word, *preset),
            CounterRule::UpDown(presets) => {
                let presets = [presets.up, presets.dn].into_iter().flatten();
                self.seen.extend(presets.map(|preset| preset.0));
            }
        }
    }

    /// A compare: with a constant, it sees the other word only up to there.
    fn compared(&mut self, a: WordRead, b: WordRead) {
        for (word, other) in [(a, b), (b, a)] {
            match self.constant(other.0) {
                Some(value) => self.uses(word.0).compared.push(value),
                None => {
                    self.seen.insert(word.0);
                }
            }
        }
    }

    fn constant(&self, word: u32) -> Option<i32> {
        let cell = WordCell(word);
        let is_fixed = self.written.word(cell).is_none() && !self.is_input(word);
        is_fixed.then(|| self.image.word(cell))
    }

    /// Whether a word is an input, or a status word, which step 1 writes.
    fn is_input(&self, word: u32) -> bool {
        let address = self.code.layout.address(Cell::Word(WordCell(word)));
        let is_status = matches!(address, Some(Address::Word(Word::Space(WordSpace::Dst, _))));
        is_status || self.inputs.contains(&word)
    }

    /// All words that any other operation reads or writes.
    fn others(&mut self, op: &Op) {
        let mut touches = TouchedCells::default();
        op.touches(&mut touches);
        self.seen.extend(touches.words_read.iter().chain(&touches.words_written));
        let arrays = touches.word_arrays_read.iter().chain(&touches.word_arrays_written);
        arrays.for_each(|array| self.array(*array));
    }

    fn array(&mut self, CellRange { first, count }: CellRange) {
        self.seen.extend(first..first + count);
    }

    fn math(&mut self, math: &Math, steps: &[FormulaStep]) {
        let reads = reads(steps);
        self.seen.extend(reads.words);
        reads.word_arrays.into_iter().for_each(|array| self.array(array));
        match math.put {
            MathTarget::Word { to, .. } | MathTarget::Real(to) => {
                self.seen.insert(to.word.0);
            }
            MathTarget::Bit(_) => {}
            MathTarget::Index(word) => {
                self.seen.insert(word.0);
            }
            MathTarget::At(at) => {
                self.seen.insert(at.index);
                // Of an array of bits, these are no words; that a word is seen harms nothing.
                self.array(CellRange { first: at.first, count: at.count.into() });
            }
        }
    }

    fn control(&mut self, control: &Control) {
        if let ControlKind::EnableEvery { every, .. } = control.kind {
            self.seen.insert(every);
        }
    }

    fn pass(&mut self, step: &PassStep) {
        match step {
            PassStep::Counter(counter, rule) => self.rule(counter.at, rule),
            PassStep::Timer(timer, _) => self.preset(timer.at, timer.preset),
            PassStep::WordBitOff(bit) => {
                self.seen.insert(bit.0.word.0);
            }
            PassStep::BitOff(_)
            | PassStep::HistoryOff(_)
            | PassStep::HoldTimer(_)
            | PassStep::CountUp(_)
            | PassStep::CountDown(_)
            | PassStep::DisableTask(_)
            | PassStep::Pick(_) => {}
        }
    }

    /// The form of an `.Acc`; `None` if all its bits matter.
    fn form(&self, word: u32, uses: &Uses) -> Option<AccForm> {
        let [counting] = uses.owners[..] else { return None };
        if self.seen.contains(&word) || self.image.word(WordCell(word)) != 0 {
            return None;
        }
        let presets: Option<Vec<i32>> =
            uses.presets.iter().map(|preset| self.constant(*preset)).collect();
        let presets = presets?;
        let preset = *presets.first()?;
        if presets.iter().any(|other| *other != preset) {
            return None;
        }
        let ends = uses.compared.iter();
        let above = ends.clone().map(|end| end.saturating_add(1)).max().unwrap_or(1).max(1);
        let below = ends.map(|end| end.saturating_sub(1)).min().unwrap_or(-1).min(-1);
        let can_count_scans = uses.compared.is_empty() && !uses.keeps_time;
        let scans = |ms: i32| (i64::from(ms.max(0)) as u64).div_ceil(self.period_ms as u64) as i32;
        match counting {
            Counting::TimeUp if can_count_scans => {
                Some(AccForm::Scans { high: scans(preset).max(1) })
            }
            Counting::TimeDown if can_count_scans => Some(AccForm::Scans { high: scans(preset) }),
            Counting::TimeUp => Some(AccForm::Limited { low: 0, high: preset.max(above) }),
            Counting::TimeDown => Some(AccForm::Limited { low: 0, high: preset.max(0) }),
            Counting::Up => Some(AccForm::Limited { low: 0, high: preset.max(above) }),
            Counting::Down => {
                Some(AccForm::Limited { low: below.min(preset), high: preset.max(0) })
            }
            Counting::Both => None,
        }
    }
}

/// Whether timers behind an operation may have missed time.
pub(super) fn keeps_time(op: &Op) -> bool {
    matches!(op, Op::Control(Control { kind: ControlKind::KeepTime { .. }, .. }))
}

/// The timer that an operation owns.
pub(super) fn timer_of(op: &Op) -> Option<(Timer, Counting)> {
    if let Op::Tmr(Tmr { timer, .. })
    | Op::Ondtmr(Ondtmr { timer, .. })
    | Op::Tmra(Tmra { timer, .. }) = op
    {
        return Some((*timer, Counting::TimeUp));
    }
    if let Op::Offdtmr(Offdtmr { timer, .. })
    | Op::Tmrdown(Tmrdown { timer, .. })
    | Op::Tmradown(Tmradown { timer, .. }) = op
    {
        return Some((*timer, Counting::TimeDown));
    }
    None
}

impl AccForm {
    /// The limits of its number.
    pub(super) fn range(self) -> WordRange {
        match self {
            AccForm::Limited { low, high } => WordRange { low, high },
            AccForm::Scans { high } => WordRange { low: 0, high },
        }
    }
}
