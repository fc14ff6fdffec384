//! Executes a slice without the operations that would change nothing.
//!
//! The result of an operation depends on the cells that it touches; the result of a timer depends
//! on the time too. If an operation changed nothing when it executed last, and none of its cells
//! has changed since, it would change nothing again. Little changes from scan to scan, so a minute
//! of a large plant takes little time. Control, timers, turns and passes are never left out.

use std::ops::Range;

use super::step_numbers::StepNumbers;
use super::subject::Subject;
use rungd_engine::isa::status::{ST_COUNT, dst};
use rungd_engine::isa::{Bit, BitSpace, BlockId, Word, WordSpace};
use rungd_engine::{
    BitCell, Cell, Element, Engine, EngineCall, EngineState, Image, ScanObserver, ScanStep, Slice,
    WordCell,
};

/// A change of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CellChange {
    /// The entry of the call.
    pub entry: u32,
    /// The number of the step; 0: the call itself.
    pub step: u32,
    /// The cell.
    pub cell: Cell,
    /// The step that made it; `None`: the call itself.
    pub by: Option<ScanStep>,
    /// The value before.
    pub before: i32,
    /// The value after.
    pub after: i32,
}

impl CellChange {
    /// The change of a cell; `None` if this is of a different cell. A change of a word may be one
    /// of its bit.
    pub fn of(&self, cell: Cell) -> Option<CellChange> {
        let Cell::WordBit(bit) = cell else { return (self.cell == cell).then_some(*self) };
        let [before, after] = [self.before, self.after].map(|held| i32::from(bit.is_on(held)));
        let is_change = self.cell == Cell::Word(bit.word) && before != after;
        is_change.then_some(CellChange { cell, before, after, ..*self })
    }
}

/// The step of a call that may change cells.
#[derive(Clone, Copy)]
struct ChangingStep {
    /// Its number; 0: the call itself.
    number: u32,
    /// The step; `None`: the call itself.
    by: Option<ScanStep>,
}

impl ChangingStep {
    /// The call itself.
    const CALL: ChangingStep = ChangingStep { number: 0, by: None };

    fn new(number: u32, by: ScanStep) -> ChangingStep {
        ChangingStep { number, by: Some(by) }
    }
}

/// An engine of a slice, with the record of the operations that it may leave out.
pub(super) struct SliceRun<'s> {
    engine: Engine,
    eye: SliceObserver<'s>,
}

impl<'s> SliceRun<'s> {
    /// A run that needs a [`SliceRun::resume`] before its first call.
    pub fn new(subject: &'s Subject, slice: &'s Slice) -> SliceRun<'s> {
        let engine = Engine::new(slice.program.clone());
        let eye = SliceObserver::new(subject, slice, &EngineState::of(&engine));
        SliceRun { engine, eye }
    }

    /// Continues from a state that fits.
    pub fn resume(&mut self, state: &EngineState) {
        self.engine.resume(state);
        self.eye.bits.copy_from_slice(state.bits());
        self.eye.words.copy_from_slice(state.words());
        self.eye.due.fill(u64::MAX);
    }

    /// Makes a call, and adds the changes of public cells and of edges to `changes`.
    pub fn call(&mut self, entry: u32, call: EngineCall, changes: Option<&mut Vec<CellChange>>) {
        let SliceRun { engine, eye } = self;
        eye.changes.clear();
        (eye.entry, eye.begun, eye.numbers) = (entry, false, StepNumbers::default());
        engine.apply_seen(call, eye);
        let image = engine.image();
        match call {
            EngineCall::Write(cell, _) => eye.note(eye.number(cell), image, ChangingStep::CALL),
            EngineCall::Force(cell, _) | EngineCall::Release(cell) => {
                eye.note(eye.number(cell), image, ChangingStep::CALL);
                eye.touched(eye.number(cell));
                eye.status(image);
            }
            EngineCall::Start { .. } => eye.blocks(image, 0),
            EngineCall::Terminate => eye.blocks(image, u32::MAX),
            EngineCall::Begin { .. } => eye.status(image),
            EngineCall::Execute | EngineCall::RequestStop => {}
        }
        if let Some(changes) = changes {
            changes.append(&mut eye.changes);
        }
    }

    /// The engine.
    pub fn engine(&mut self) -> &mut Engine {
        &mut self.engine
    }
}

/// Notes the cells that change, and the batches that are due for that reason. Cells are numbered as
/// in the wiring.
struct SliceObserver<'s> {
    subject: &'s Subject,
    slice: &'s Slice,
    /// All of memory, as it was last noted.
    bits: Vec<u8>,
    words: Vec<i32>,
    /// One bit for each batch. `due`: it may change something; `moves`: it is never left out.
    due: Vec<u64>,
    moves: Vec<u64>,
    /// By cell: whether its changes are reported.
    told: Vec<bool>,
    changes: Vec<CellChange>,
    numbers: StepNumbers,
    entry: u32,
    /// Whether a step of the call has begun.
    begun: bool,
}

impl<'s> SliceObserver<'s> {
    fn new(subject: &'s Subject, slice: &'s Slice, state: &EngineState) -> SliceObserver<'s> {
        let (bits, words) = (state.bits().to_vec(), state.words().to_vec());
        let layout = &subject.symbols.layout;
        let mut told = vec![false; bits.len() + words.len()];
        told[..layout.bit_count() as usize].fill(true);
        told[bits.len()..][..layout.word_count() as usize].fill(true);
        // The bits of edges are the only private cells in this list.
        for place in &slice.places {
            for (first, count) in &subject.batches[place.end as usize - 1].bits {
                told[*first as usize..(first + count) as usize].fill(true);
            }
        }
        let mut moves = vec![0; slice.places.len().div_ceil(64)];
        for (at, _) in slice.wiring.moves.iter().enumerate().filter(|(_, moves)| **moves) {
            moves[at / 64] |= 1 << (at % 64);
        }
        let due = vec![u64::MAX; moves.len()];
        let (changes, numbers) = (Vec::new(), StepNumbers::default());
        let (entry, begun) = (0, false);
        SliceObserver {
            subject,
            slice,
            bits,
            words,
            due,
            moves,
            told,
            changes,
            numbers,
            entry,
            begun,
        }
    }

    fn number(&self, cell: Cell) -> u32 {
        match cell {
            Cell::Bit(BitCell(at)) => at,
            Cell::Word(WordCell(at)) => self.bits.len() as u32 + at,
            Cell::WordBit(bit) => self.number(Cell::Word(bit.word)),
        }
    }

    /// Notes a cell, if it has changed.
    fn note(&mut self, number: u32, image: &Image, step: ChangingStep) {
        let at = number as usize;
        let (cell, before, after) = match at.checked_sub(self.bits.len()) {
            None => {
                let after = image.bits()[at];
                let before = std::mem::replace(&mut self.bits[at], after);
                (Cell::Bit(BitCell(number)), i32::from(before), i32::from(after))
            }
            Some(at) => {
                let after = image.words()[at];
                let before = std::mem::replace(&mut self.words[at], after);
                (Cell::Word(WordCell(at as u32)), before, after)
            }
        };
        if before == after {
            return;
        }
        self.touched(number);
        if self.told[at] {
            let (entry, ChangingStep { number: step, by }) = (self.entry, step);
            self.changes.push(CellChange { entry, step, cell, by, before, after });
        }
    }

    /// Marks all batches that touch a cell as due.
    fn touched(&mut self, number: u32) {
        for batch in self.slice.wiring.touching(number) {
            self.due[batch as usize / 64] |= 1 << (batch % 64);
        }
    }

    /// Notes the cells of a step. `step`: its number among the batches, passes and turns.
    fn step(&mut self, step: usize, image: &Image, by: ChangingStep) {
        let slice = self.slice;
        slice.wiring.written(step).iter().for_each(|cell| self.note(*cell, image, by));
    }

    fn turn(&self, BlockId(block): BlockId) -> usize {
        self.slice.places.len() + self.slice.program.tables.terminations.len() + block as usize
    }

    /// Notes the bits of all blocks, after a call that starts or stops them.
    fn blocks(&mut self, image: &Image, step: u32) {
        for at in 0..self.slice.program.blocks.len() as u32 {
            self.step(self.turn(BlockId(at)), image, ChangingStep { number: step, by: None });
        }
    }

    /// Notes the status bits and words, which the start of a scan writes. Their changes are not
    /// reported.
    fn status(&mut self, image: &Image) {
        let layout = &self.slice.program.layout;
        let bit = self.number(Cell::Bit(layout.bit(Bit::Space(BitSpace::St, 0))));
        let word = |n| self.number(Cell::Word(layout.word(Word::Space(WordSpace::Dst, n))));
        let words: [u32; dst::COUNT] = std::array::from_fn(|n| word(n as u32));
        let told = self.changes.len();
        let all = (bit..bit + ST_COUNT).chain(words);
        all.for_each(|number| self.note(number, image, ChangingStep::CALL));
        self.changes.truncate(told);
    }
}

impl ScanObserver for SliceObserver<'_> {
    fn next(&mut self, batches: Range<u32>) -> u32 {
        let mut at = batches.start;
        while at < batches.end {
            let word = at as usize / 64;
            let left = (self.due[word] | self.moves[word]) >> (at % 64);
            if left != 0 {
                return batches.end.min(at + left.trailing_zeros());
            }
            at = (word as u32 + 1) * 64;
        }
        batches.end
    }

    fn before(&mut self, deed: ScanStep, image: &Image) {
        let number = self.numbers.before(deed, self.slice);
        if !std::mem::replace(&mut self.begun, true) {
            // The engine has started LastScan.
            self.blocks(image, 0);
        }
        match deed {
            ScanStep::Batch(at) => self.due[at as usize / 64] &= !(1 << (at % 64)),
            ScanStep::Element(Element::Block(block)) => {
                self.step(
                    self.turn(block),
                    image,
                    ChangingStep::new(number, ScanStep::Turn(block)),
                );
            }
            ScanStep::Element(Element::Stage(stage)) => {
                let block = self.subject.program.stages[stage.0 as usize].0;
                self.step(
                    self.turn(block),
                    image,
                    ChangingStep::new(number, ScanStep::Turn(block)),
                );
            }
            ScanStep::Turn(_) | ScanStep::Pass(_) => {}
        }
    }

    fn after(&mut self, deed: ScanStep, image: &Image) {
        let number = self.numbers.after(deed);
        let batches = self.slice.places.len();
        let (step, by) = match deed {
            ScanStep::Batch(at) => (at as usize, self.slice.whole(deed)),
            ScanStep::Pass(at) => (batches + at as usize, deed),
            ScanStep::Turn(block) => (self.turn(block), deed),
            ScanStep::Element(_) => return,
        };
        self.step(step, image, ChangingStep::new(number, by));
    }
}
