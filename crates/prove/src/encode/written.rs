//! What a program may write: the bits, the words with the limits of what is written, and the blocks
//! that something may start or stop. Everything else is constant.
//!
//! `encode` asks before it makes a latch. A cell that is listed without need costs a latch, which
//! [`Gates::without_constants`](crate::gates::Gates::without_constants) removes.

use rungd_engine::isa::{Address, Bit, BlockId, ElementId, StageId};
use rungd_engine::ops::{
    ArrayLimits, ArrayTarget, CellRange, Control, ControlKind, CounterRule, ElementType, Math,
    MathReports, MathTarget, Op, Sensaphone, TouchedCells, WordForm, WordTarget,
};
use rungd_engine::record::RECORD;
use rungd_engine::{BitCell, BlockRole, Cell, EngineProgram, Image, PassStep, WordCell};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::model::FreeInput;

/// The least and greatest value that is written to a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct WordRange {
    pub low: i32,
    pub high: i32,
}

impl WordRange {
    pub const ALL: WordRange = WordRange { low: i32::MIN, high: i32::MAX };
    pub const BIT: WordRange = WordRange { low: 0, high: 1 };
    const NOT_NEGATIVE: WordRange = WordRange { low: 0, high: i32::MAX };
    const SENSAPHONE: WordRange = WordRange { low: i16::MIN as i32, high: i16::MAX as i32 };

    /// The limits of a target.
    pub fn of(to: &WordTarget) -> WordRange {
        WordRange { low: to.min, high: to.max }
    }

    /// The limits that also contain a value.
    pub fn with(self, value: i32) -> WordRange {
        self.and(WordRange { low: value, high: value })
    }

    fn and(self, other: WordRange) -> WordRange {
        WordRange { low: self.low.min(other.low), high: self.high.max(other.high) }
    }
}

/// What a program may write.
pub(super) struct WrittenCells<'c> {
    code: &'c EngineProgram,
    /// Memory before the first scan: the constants.
    image: &'c Image,
    /// By bit: whether an operation may write it.
    bits: Vec<bool>,
    words: FxHashMap<u32, WordRange>,
    /// The blocks whose `.Running` something may turn OFF.
    pub halted: FxHashSet<BlockId>,
    /// The Stages that something may leave.
    pub left: FxHashSet<StageId>,
    /// The Tasks that are enabled recurrently, with the words of their intervals.
    pub recurrent: FxHashMap<BlockId, Vec<u32>>,
    /// The Tasks that are enabled once.
    pub once: FxHashSet<BlockId>,
    /// Whether there is a STOP.
    pub stops: bool,
}

impl<'c> WrittenCells<'c> {
    pub fn of(code: &'c EngineProgram, image: &'c Image) -> WrittenCells<'c> {
        let mut written = WrittenCells {
            code,
            image,
            bits: vec![false; code.bit_count as usize],
            words: FxHashMap::default(),
            halted: FxHashSet::default(),
            left: FxHashSet::default(),
            recurrent: FxHashMap::default(),
            once: FxHashSet::default(),
            stops: false,
        };
        for (block, parts) in (0..).map(BlockId).zip(&code.blocks) {
            written.block(block, parts.role);
            written.element(ElementId { block, stage: None }, &parts.own);
            for stage in parts.stages.clone() {
                let element = ElementId { block, stage: Some(StageId(stage)) };
                written.element(element, &code.stages[stage as usize]);
                written.bit(code.layout.bit(Bit::Stage(StageId(stage))).0);
            }
        }
        for step in &code.tables.terminations {
            written.pass(step);
        }
        code.tables.picks.iter().for_each(|pick| written.math(pick));
        written
    }

    /// A cell is written before the first scan.
    pub fn starts_with(&mut self, input: &FreeInput) {
        match input.cell {
            Cell::Bit(BitCell(bit)) => self.bit(bit),
            Cell::Word(WordCell(word)) => {
                self.put(word, WordRange { low: input.low, high: input.high });
            }
            Cell::WordBit(_) => unreachable!("an input is a whole cell"),
        }
    }

    /// Whether an operation may write a bit.
    pub fn has_bit(&self, BitCell(bit): BitCell) -> bool {
        self.bits[bit as usize]
    }

    /// The limits of what is written to a word; `None` if nothing is.
    pub fn word(&self, WordCell(word): WordCell) -> Option<WordRange> {
        self.words.get(&word).copied()
    }

    /// The interval of a recurrent Task, ms, if it is always the same.
    pub fn interval(&self, task: BlockId) -> Option<i32> {
        let is_private = |word: &u32| *word >= self.code.layout.word_count();
        let fixed = |word: &u32| is_private(word) && !self.words.contains_key(word);
        let words = self.recurrent.get(&task)?;
        let first = *words.first()?;
        let interval = |word: u32| self.image.word(WordCell(word)).max(0);
        let same = words.iter().all(|word| fixed(word) && interval(*word) == interval(first));
        same.then(|| interval(first))
    }

    /// A block that ends by itself, or that `LastScan` starts.
    fn block(&mut self, block: BlockId, role: BlockRole) {
        match role {
            BlockRole::Program { .. } | BlockRole::TopOfScan | BlockRole::BottomOfScan => {}
            BlockRole::Task | BlockRole::FirstScan | BlockRole::LastScan => {
                self.halts(block);
                self.starts(block);
            }
            BlockRole::Subroutine => self.bit(self.code.layout.bit(Bit::Running(block)).0),
        }
    }

    fn element(&mut self, element: ElementId, code: &rungd_engine::ElementCode) {
        for batch in code.batches.clone() {
            for op in self.code.tables.ops_of(self.code.tables.batches[batch as usize]) {
                self.op(&op, element);
            }
        }
    }

    fn bit(&mut self, bit: u32) {
        self.bits[bit as usize] = true;
    }

    fn bit_range(&mut self, CellRange { first, count }: CellRange) {
        self.bits[first as usize..(first + count) as usize].fill(true);
    }

    /// All bits of a record: the flags and the state.
    fn record(&mut self, at: u32) {
        self.bit_range(CellRange { first: at * RECORD as u32, count: RECORD as u32 });
    }

    fn put(&mut self, word: u32, limits: WordRange) {
        let before = self.words.entry(word).or_insert(limits);
        *before = before.and(limits);
    }

    /// The limits of a word by its address.
    fn natural(&self, word: u32) -> WordRange {
        let address = self.code.layout.address(Cell::Word(WordCell(word)));
        let Some(Address::Word(word)) = address else { return WordRange::ALL };
        let (low, high) = word.range();
        WordRange { low, high }
    }

    fn op(&mut self, op: &Op, element: ElementId) {
        if let Op::Math(math) = op {
            return self.math(math);
        }
        if let Op::Control(control) = op {
            return self.control(control, element);
        }
        let mut touches = TouchedCells::default();
        op.touches(&mut touches);
        touches.bits_written.iter().for_each(|bit| self.bit(*bit));
        touches.bit_arrays_written.iter().for_each(|range| self.bit_range(*range));
        self.words_of(op);
    }

    /// The words that an operation writes, and the records.
    fn words_of(&mut self, op: &Op) {
        match op {
            Op::And2(_) | Op::And3(_) | Op::And4(_) | Op::PickBit(_) | Op::LoadWordBit(_) => {}
            Op::Rise(_) | Op::Fall(_) | Op::Equal(_) | Op::Less(_) => {}
            Op::EqualMixed(_) | Op::LessMixed(_) => {}
            Op::Out(_) | Op::OutOne(_) | Op::Set(_) | Op::Rst(_) => {}
            Op::Pd(_) | Op::Nd(_) | Op::Ponoff(_) => {}
            Op::CopyBits(_) | Op::FillBits(_) | Op::UnpackBits(_) | Op::Sr(_) => {}
            Op::PickWord(op) => self.put(op.cell.0, WordRange::ALL),
            Op::OutWordBit(op) => self.word_bit(op.bit.0.word),
            Op::SetWordBit(op) => self.word_bit(op.bit.0.word),
            Op::RstWordBit(op) => self.word_bit(op.bit.0.word),
            Op::Cnt(op) => self.structure(op.counter.at, WordRange::NOT_NEGATIVE),
            Op::Cntdn(op) => self.structure(op.counter.at, WordRange::ALL),
            Op::Udc(op) => self.structure(op.counter.at, WordRange::ALL),
            Op::Rstct(op) => self.structure(op.counter.at, rule_limits(&op.rule)),
            Op::Ondtmr(op) => self.structure(op.timer.at, WordRange::NOT_NEGATIVE),
            Op::Offdtmr(op) => self.structure(op.timer.at, WordRange::NOT_NEGATIVE),
            Op::Tmr(op) => self.structure(op.timer.at, WordRange::NOT_NEGATIVE),
            Op::Tmrdown(op) => self.structure(op.timer.at, WordRange::NOT_NEGATIVE),
            Op::Tmra(op) => self.structure(op.timer.at, WordRange::NOT_NEGATIVE),
            Op::Tmradown(op) => self.structure(op.timer.at, WordRange::NOT_NEGATIVE),
            Op::Rstt(op) => self.structure(op.timer.at, WordRange::NOT_NEGATIVE),
            Op::Ctu(op) => self.sensaphone(&op.counter),
            Op::Ctd(op) => self.sensaphone(&op.counter),
            Op::Res(op) => self.sensaphone(&op.counter),
            Op::Move(op) => self.target(&op.to),
            Op::Add(op) => self.target(&op.to),
            Op::Sub(op) => self.target(&op.to),
            Op::AddMixed(op) => self.target(&op.to.target),
            Op::SubMixed(op) => self.target(&op.to.target),
            Op::CopyWords(op) => self.words_in_form(op.to.0, op.form),
            Op::FillWords(op) => self.words_in_form(op.to.0, op.form),
            Op::PackBits(op) => self.target(&op.to),
            Op::Math(_) | Op::Control(_) => unreachable!("they are no plain operations"),
        }
    }

    fn word_bit(&mut self, WordCell(word): WordCell) {
        self.put(word, self.natural(word));
    }

    fn structure(&mut self, at: u32, limits: WordRange) {
        self.put(at, limits);
        self.record(at);
    }

    fn sensaphone(&mut self, counter: &Sensaphone) {
        self.structure(counter.at, WordRange::SENSAPHONE);
        if counter.preset.is_some() {
            self.put(counter.pre.0, WordRange::SENSAPHONE);
        }
    }

    fn target(&mut self, to: &WordTarget) {
        self.put(to.word.0, WordRange::of(to));
    }

    fn words_in_form(&mut self, to: CellRange, form: WordForm) {
        for at in 0..to.count {
            self.put(to.first + at, self.element_limits(form.limits, at));
        }
    }

    /// The limits of an element of an array of words.
    pub fn element_limits(&self, limits: ArrayLimits, element: u32) -> WordRange {
        let at = limits.first + if limits.each { 2 * element } else { 0 };
        let word = |at| self.image.word(WordCell(at));
        WordRange { low: word(at), high: word(at + 1) }
    }

    fn math(&mut self, math: &Math) {
        match math.put {
            MathTarget::Word { to, .. } | MathTarget::Real(to) => self.target(&to),
            MathTarget::Bit(bit) => self.bit(bit.0),
            MathTarget::At(at) => self.array(&at),
            MathTarget::Index(word) => self.put(word.0, WordRange::ALL),
        }
        if math.reports != MathReports::Nothing {
            let status = rungd_engine::isa::BitSpace::St;
            let first = self.code.layout.bit(Bit::Space(status, 0)).0;
            rungd_engine::Mishap::ALL.iter().for_each(|mishap| self.bit(first + mishap.status()));
        }
    }

    fn array(&mut self, at: &ArrayTarget) {
        let range = CellRange { first: at.first, count: at.count.into() };
        match at.kind {
            ElementType::Bits => self.bit_range(range),
            ElementType::WordBits => {
                for word in at.first..at.first + range.count {
                    self.word_bit(WordCell(word));
                }
            }
            ElementType::Unsigned | ElementType::Integers | ElementType::Reals => {
                let limits = ArrayLimits { first: at.limits, each: at.each };
                for element in 0..range.count {
                    self.put(at.first + element, self.element_limits(limits, element));
                }
            }
        }
    }

    fn control(&mut self, control: &Control, element: ElementId) {
        match control.kind {
            ControlKind::Run(program) => self.starts(program),
            ControlKind::Restart(restart) => {
                self.bit(restart.history);
                self.halts(restart.program);
                self.starts(restart.program);
            }
            ControlKind::Halt(block) => self.halts(block),
            ControlKind::Exit => self.exits(element.block),
            ControlKind::EnableOnce { task, history } => {
                self.bit(history);
                self.once.insert(task);
                self.starts(task);
            }
            ControlKind::EnableEvery { task, every, pick: _ } => {
                self.starts(task);
                self.halts(task);
                self.recurrent.entry(task).or_default().push(every);
            }
            ControlKind::Jump(_) => self.left.extend(element.stage),
            ControlKind::StageOn(_) => {}
            ControlKind::StageOff(stage) => {
                self.left.insert(stage);
            }
            ControlKind::Converge { from, .. } => {
                self.left.extend(&self.code.tables.stage_lists[from.places()]);
            }
            ControlKind::Stop => self.stops = true,
            ControlKind::Call(_) | ControlKind::Return => {}
            ControlKind::KeepTime { missed_ms } | ControlKind::GiveTime { missed_ms } => {
                self.put(missed_ms, WordRange::NOT_NEGATIVE);
            }
        }
    }

    /// A block whose `.Running` something may turn ON.
    pub fn starts(&mut self, block: BlockId) {
        self.bit(self.code.layout.bit(Bit::Running(block)).0);
        self.bit(self.code.layout.bit(Bit::Done(block)).0);
    }

    fn halts(&mut self, block: BlockId) {
        self.bit(self.code.layout.bit(Bit::Running(block)).0);
        self.bit(self.code.layout.bit(Bit::Done(block)).0);
        self.halted.insert(block);
    }

    /// An EXIT: in a subroutine, that of any block.
    fn exits(&mut self, block: BlockId) {
        if self.code.blocks[block.0 as usize].role != BlockRole::Subroutine {
            return self.halts(block);
        }
        for (block, parts) in (0..).map(BlockId).zip(&self.code.blocks) {
            if parts.role != BlockRole::Subroutine {
                self.halts(block);
            }
        }
    }

    fn pass(&mut self, step: &PassStep) {
        match step {
            PassStep::BitOff(bit) | PassStep::HistoryOff(bit) => self.bit(*bit),
            PassStep::WordBitOff(bit) => self.word_bit(bit.0.word),
            PassStep::Counter(counter, rule) => self.structure(counter.at, rule_limits(rule)),
            PassStep::Timer(timer, _) => self.structure(timer.at, WordRange::NOT_NEGATIVE),
            PassStep::HoldTimer(timer) => self.record(timer.at),
            PassStep::CountUp(counter) | PassStep::CountDown(counter) => self.record(counter.at),
            PassStep::DisableTask(task) => self.halts(*task),
            PassStep::Pick(_) => {}
        }
    }
}

/// The limits of a counter's reset value.
fn rule_limits(rule: &CounterRule) -> WordRange {
    match rule {
        CounterRule::Up(_) | CounterRule::UpDown(_) => WordRange { low: 0, high: 0 },
        CounterRule::Down(_) => WordRange::ALL,
    }
}
