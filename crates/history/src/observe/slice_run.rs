//! Executes a slice without the operations that would change nothing.
//!
//! The result of an operation depends on the cells that it touches; the result of a timer depends
//! on the time too. If an operation changed nothing when it executed last, and none of its cells
//! has changed since, it would change nothing again. Little changes from scan to scan, so a minute
//! of a large plant takes little time. Control, timers, turns and passes are never left out.
//! A state to continue from makes only the operations due whose cells differ. The slice may be the
//! whole program: so a running controller is followed.

use std::ops::Range;

use super::noted_cells::{CellChange, ChangingStep, NotedCells};
use super::step_numbers::StepNumbers;
use super::subject::Subject;
use rungd_engine::isa::status::{ST_COUNT, dst};
use rungd_engine::isa::{Bit, BitSpace, BlockId, StageId, Word, WordSpace};
use rungd_engine::{
    Cell, Element, Engine, EngineCall, EngineState, Image, ScanObserver, ScanStep, Slice,
};

/// Sees the steps of a call beside the record of the operations that are left out.
pub(super) trait StepWitness {
    /// The batches that must be visited, one bit for each, although they would change nothing.
    fn wanted(&self) -> &[u64];

    /// Of the remaining batches of an element, those before this one are passed.
    fn passes(&mut self, batches: Range<u32>, next: u32);

    /// A step begins.
    fn before(&mut self, deed: ScanStep, slice: &Slice, image: &Image);

    /// A cell has changed.
    fn changed(&mut self, number: u32);
}

/// What a run executes a slice of.
pub(super) trait SliceHolder {
    /// The slice.
    fn slice(&self) -> &Slice;
}

impl SliceHolder for &Slice {
    fn slice(&self) -> &Slice {
        self
    }
}

/// An engine of a slice, with the record of the operations that it may leave out.
pub(super) struct SliceRun<S> {
    engine: Engine,
    eye: SliceObserver<S>,
}

impl<S: SliceHolder> SliceRun<S> {
    /// A run that needs a [`SliceRun::resume`] before its first call.
    pub fn new(subject: &Subject, slice: S) -> SliceRun<S> {
        let engine = Engine::new(slice.slice().program.clone());
        let eye = SliceObserver::new(subject, slice, &EngineState::of(&engine));
        SliceRun { engine, eye }
    }

    /// Continues from a state; returns false, and changes nothing, if the state does not fit.
    pub fn resume(&mut self, state: &EngineState) -> bool {
        let SliceRun { engine, eye } = self;
        let fits = engine.resume(state);
        eye.noted.resume(&eye.slice.slice().wiring, engine.image());
        fits
    }

    /// Makes a call, and adds the changes of public cells and of edges to `changes`.
    pub fn call(&mut self, entry: u32, call: EngineCall, changes: Option<&mut Vec<CellChange>>) {
        let SliceRun { engine, eye } = self;
        eye.begin(entry);
        engine.apply_seen(call, eye);
        eye.end(call, engine.image());
        if let Some(changes) = changes {
            changes.append(&mut eye.noted.changes);
        }
    }

    /// Makes a call that a witness sees.
    pub fn call_seen(&mut self, call: EngineCall, witness: &mut impl StepWitness) {
        let SliceRun { engine, eye } = self;
        eye.begin(0);
        engine.apply_seen(call, &mut WitnessedSlice { eye, witness });
        eye.end(call, engine.image());
        eye.noted.numbers.drain(..).for_each(|number| witness.changed(number));
    }

    /// The cells that the last call, or the last state, has changed.
    pub fn changed(&self) -> &[u32] {
        &self.eye.noted.numbers
    }

    /// The engine. What it executes by itself is not noted: then a state follows.
    pub fn engine(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// The engine.
    pub fn seen_engine(&self) -> &Engine {
        &self.engine
    }
}

/// Notes the cells that change, and leaves out the batches that are not due.
struct SliceObserver<S> {
    slice: S,
    noted: NotedCells,
    /// One bit for each batch that is never left out.
    moves: Vec<u64>,
    /// By Stage: its Program.
    programs: Vec<BlockId>,
    numbers: StepNumbers,
    /// Whether a step of the call has begun.
    begun: bool,
}

impl<S: SliceHolder> SliceObserver<S> {
    fn new(subject: &Subject, slice: S, state: &EngineState) -> SliceObserver<S> {
        let own = slice.slice();
        let layout = &subject.symbols.layout;
        let mut noted = NotedCells::new(state, own.places.len());
        noted.tell_public(layout);
        // The bits of edges are the only private cells in this list.
        for place in &own.places {
            for (first, count) in &subject.batches[place.end as usize - 1].bits {
                (*first..first + count).for_each(|bit| noted.tell(bit));
            }
        }
        let mut moves = vec![0; own.places.len().div_ceil(64)];
        for (at, _) in own.wiring.moves.iter().enumerate().filter(|(_, moves)| **moves) {
            moves[at / 64] |= 1 << (at % 64);
        }
        let programs = subject.program.stages.iter().map(|(program, ..)| *program).collect();
        let (numbers, begun) = (StepNumbers::default(), false);
        SliceObserver { slice, noted, moves, programs, numbers, begun }
    }

    /// Begins a call.
    fn begin(&mut self, entry: u32) {
        self.noted.begin(entry);
        (self.begun, self.numbers) = (false, StepNumbers::default());
    }

    /// Notes what a call has changed outside of its steps.
    fn end(&mut self, call: EngineCall, image: &Image) {
        let noted = &mut self.noted;
        match call {
            EngineCall::Write(cell, _) => {
                let (number, wiring) = (noted.number(cell), &self.slice.slice().wiring);
                noted.note(number, wiring, image, ChangingStep::CALL);
            }
            EngineCall::Force(cell, _) | EngineCall::Release(cell) => {
                let (number, wiring) = (noted.number(cell), &self.slice.slice().wiring);
                noted.note(number, wiring, image, ChangingStep::CALL);
                noted.touched(number, wiring);
                noted.is_forced = true;
                self.status(image);
            }
            EngineCall::Start { .. } => self.blocks(image, 0),
            EngineCall::Terminate => self.blocks(image, u32::MAX),
            EngineCall::Begin { .. } => self.status(image),
            EngineCall::Execute | EngineCall::RequestStop => {}
        }
    }

    /// Notes the cells of a step. `step`: its number among the batches, passes and turns.
    fn step(&mut self, step: usize, image: &Image, by: ChangingStep) {
        let wiring = &self.slice.slice().wiring;
        wiring.written(step).iter().for_each(|cell| self.noted.note(*cell, wiring, image, by));
    }

    fn turn(&self, BlockId(block): BlockId) -> usize {
        let slice = self.slice.slice();
        slice.places.len() + slice.program.tables.terminations.len() + block as usize
    }

    /// Notes the bits of all blocks, after a call that starts or stops them.
    fn blocks(&mut self, image: &Image, step: u32) {
        for at in 0..self.slice.slice().program.blocks.len() as u32 {
            self.step(self.turn(BlockId(at)), image, ChangingStep { number: step, by: None });
        }
    }

    /// Notes the status bits and words, which the start of a scan writes. Their changes are not
    /// reported.
    fn status(&mut self, image: &Image) {
        let (slice, noted) = (self.slice.slice(), &mut self.noted);
        let layout = &slice.program.layout;
        let bit = noted.number(Cell::Bit(layout.bit(Bit::Space(BitSpace::St, 0))));
        let word = |n| noted.number(Cell::Word(layout.word(Word::Space(WordSpace::Dst, n))));
        let words: [u32; dst::COUNT] = std::array::from_fn(|n| word(n as u32));
        let told = noted.changes.len();
        let all = (bit..bit + ST_COUNT).chain(words);
        all.for_each(|number| noted.note(number, &slice.wiring, image, ChangingStep::CALL));
        noted.changes.truncate(told);
    }

    /// The next batch that is due, or wanted by one of these bits.
    fn next_of(&self, batches: Range<u32>, wanted: &[u64]) -> u32 {
        let mut at = batches.start;
        while at < batches.end {
            let word = at as usize / 64;
            let wanted = wanted.get(word).copied().unwrap_or(0);
            let left = (self.noted.due[word] | self.moves[word] | wanted) >> (at % 64);
            if left != 0 {
                return batches.end.min(at + left.trailing_zeros());
            }
            at = (word as u32 + 1) * 64;
        }
        batches.end
    }
}

impl<S: SliceHolder> ScanObserver for SliceObserver<S> {
    fn next(&mut self, batches: Range<u32>) -> u32 {
        self.next_of(batches, &[])
    }

    fn before(&mut self, deed: ScanStep, image: &Image) {
        let number = self.numbers.before(deed, self.slice.slice());
        if !std::mem::replace(&mut self.begun, true) {
            // The engine has started LastScan.
            self.blocks(image, 0);
        }
        let block = match deed {
            ScanStep::Batch(at) => return self.noted.executes(at),
            ScanStep::Element(Element::Block(block)) => block,
            ScanStep::Element(Element::Stage(StageId(stage))) => self.programs[stage as usize],
            ScanStep::Turn(_) | ScanStep::Pass(_) => return,
        };
        let step = ChangingStep::new(number, ScanStep::Turn(block));
        self.step(self.turn(block), image, step);
    }

    fn after(&mut self, deed: ScanStep, image: &Image) {
        let number = self.numbers.after(deed);
        let batches = self.slice.slice().places.len();
        let (step, by) = match deed {
            ScanStep::Batch(at) => (at as usize, self.slice.slice().whole(deed)),
            ScanStep::Pass(at) => (batches + at as usize, deed),
            ScanStep::Turn(block) => (self.turn(block), deed),
            ScanStep::Element(_) => return,
        };
        self.step(step, image, ChangingStep::new(number, by));
    }
}

/// The observer of a slice with a witness beside it.
struct WitnessedSlice<'a, S, W> {
    eye: &'a mut SliceObserver<S>,
    witness: &'a mut W,
}

impl<S: SliceHolder, W: StepWitness> WitnessedSlice<'_, S, W> {
    fn tell(&mut self) {
        self.eye.noted.numbers.drain(..).for_each(|number| self.witness.changed(number));
    }
}

impl<S: SliceHolder, W: StepWitness> ScanObserver for WitnessedSlice<'_, S, W> {
    fn next(&mut self, batches: Range<u32>) -> u32 {
        let next = self.eye.next_of(batches.clone(), self.witness.wanted());
        self.witness.passes(batches, next);
        next
    }

    fn before(&mut self, deed: ScanStep, image: &Image) {
        self.eye.before(deed, image);
        self.tell();
        self.witness.before(deed, self.eye.slice.slice(), image);
    }

    fn after(&mut self, deed: ScanStep, image: &Image) {
        self.eye.after(deed, image);
        self.tell();
    }
}
