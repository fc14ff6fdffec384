//! All changes of public memory in one section, in order, with the step that made each.
//!
//! Made by executing the section once, seen; asked for the last change of a cell. Of a large
//! program a state every few scans is kept, so that a scan of the section can be executed again
//! soon.

use super::subject::Subject;
use super::walk::{Witness, walk};
use crate::engine::{BitCell, Cell, Deed, Engine, EngineCall, EngineState, Image, Slice, WordCell};
use crate::isa::status::ST_COUNT;
use crate::isa::{Bit, BitSpace, BlockId};
use crate::runtime::{TapeEntry, TapeSection};

/// The operations from one state that is kept to the next.
const APART: usize = 20_000;

/// A change of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CellChange {
    /// The entry of the call.
    pub entry: u32,
    /// The number of the step; 0: the call itself.
    pub step: u32,
    /// The cell.
    pub cell: Cell,
    /// What made it; `None`: the call itself.
    pub by: Option<Deed>,
    /// The value before.
    pub before: i32,
    /// The value after.
    pub after: i32,
}

/// The changes of a section.
#[derive(Debug)]
pub(super) struct SectionLog {
    pub changes: Vec<CellChange>,
    /// States right before entries, in order.
    pub states: Vec<(usize, EngineState)>,
}

impl SectionLog {
    /// Executes a section that fits the engine of a slice.
    pub fn new(
        (subject, slice): (&Subject, &Slice),
        engine: &mut Engine,
        section: &TapeSection,
    ) -> SectionLog {
        let apart = (APART / slice.places.len().max(1)).max(8);
        let mut states = Vec::new();
        let mut recorder = Recorder::new((subject, slice), &section.state);
        engine.resume(&section.state);
        let mut scans = 0;
        for (at, entry) in section.entries.iter().enumerate() {
            let TapeEntry::Call(call) = entry else { continue };
            if let EngineCall::Begin { .. } = call {
                if scans % apart == 0 && scans > 0 {
                    states.push((at, EngineState::of(engine)));
                }
                scans += 1;
            }
            recorder.entry = at as u32;
            recorder.call(engine, *call);
        }
        SectionLog { changes: recorder.changes, states }
    }

    /// The last change of a cell before a step of an entry that some condition holds for.
    pub fn last(
        &self,
        cell: Cell,
        (entry, step): (usize, u32),
        is: impl Fn(&CellChange) -> bool,
    ) -> Option<CellChange> {
        let end = self.changes.partition_point(|c| (c.entry as usize, c.step) < (entry, step));
        self.changes[..end].iter().rev().find(|c| c.cell == cell && is(c)).copied()
    }
}

/// Notes changes while a section is executed. Keeps a copy of public memory.
struct Recorder<'s> {
    subject: &'s Subject,
    slice: &'s Slice,
    bits: Vec<u8>,
    words: Vec<i32>,
    changes: Vec<CellChange>,
    entry: u32,
    /// The call has had a step.
    begun: bool,
}

impl<'s> Recorder<'s> {
    fn new((subject, slice): (&'s Subject, &'s Slice), state: &EngineState) -> Recorder<'s> {
        let words = subject.symbols.layout.word_count() as usize;
        Recorder {
            subject,
            slice,
            bits: state.bits().to_vec(),
            words: state.words()[..words].to_vec(),
            changes: Vec::new(),
            entry: 0,
            begun: false,
        }
    }

    fn call(&mut self, engine: &mut Engine, call: EngineCall) {
        self.begun = false;
        walk((self.subject, self.slice), engine, call, self);
        let image = engine.image();
        match call {
            EngineCall::Write(cell, _) | EngineCall::Force(cell, _) => {
                self.note(cell, image, (0, None));
            }
            EngineCall::Start { .. } => self.blocks(image, 0),
            EngineCall::Terminate => self.blocks(image, u32::MAX),
            EngineCall::Begin { .. } => self.status(image),
            EngineCall::Execute | EngineCall::RequestStop | EngineCall::Release(_) => {}
        }
    }

    /// Notes a cell, if it has changed.
    fn note(&mut self, cell: Cell, image: &Image, (step, by): (u32, Option<Deed>)) {
        let (before, after) = match cell {
            Cell::Bit(BitCell(at)) => {
                let Some(known) = self.bits.get_mut(at as usize) else { return };
                let after = image.bits()[at as usize];
                (i32::from(std::mem::replace(known, after)), i32::from(after))
            }
            Cell::Word(WordCell(at)) => {
                let Some(known) = self.words.get_mut(at as usize) else { return };
                let after = image.words()[at as usize];
                (std::mem::replace(known, after), after)
            }
        };
        if before != after {
            self.changes.push(CellChange { entry: self.entry, step, cell, by, before, after });
        }
    }

    fn step(&mut self, deed: Deed, image: &Image, (step, by): (u32, Option<Deed>)) {
        let subject = self.subject;
        let Some(written) = subject.written_by(deed) else { return };
        for (first, count) in &written.bits {
            (*first..first + count)
                .for_each(|at| self.note(Cell::Bit(BitCell(at)), image, (step, by)));
        }
        for (first, count) in &written.words {
            (*first..first + count)
                .for_each(|at| self.note(Cell::Word(WordCell(at)), image, (step, by)));
        }
    }

    /// The bits of all blocks, after a call that starts or stops them.
    fn blocks(&mut self, image: &Image, step: u32) {
        for at in 0..self.subject.turns.len() as u32 {
            self.step(Deed::Turn(BlockId(at)), image, (step, None));
        }
    }

    /// The status bits, which a scan's start writes: they are no news.
    fn status(&mut self, image: &Image) {
        let first = self.subject.symbols.layout.bit(Bit::Space(BitSpace::St, 0)).0;
        for at in first as usize..(first + ST_COUNT) as usize {
            self.bits[at] = image.bits()[at];
        }
    }
}

impl Witness for Recorder<'_> {
    const PARTS: bool = false;

    fn before(&mut self, deed: Deed, number: u32, image: &Image) {
        if !std::mem::replace(&mut self.begun, true) {
            // The engine has started LastScan.
            self.blocks(image, 0);
        }
        if let Deed::Element(element) = deed {
            let block = match element {
                crate::engine::Element::Block(block) => block,
                crate::engine::Element::Stage(stage) => {
                    self.subject.program.stages[stage.0 as usize].0
                }
            };
            let deed = Deed::Turn(block);
            self.step(deed, image, (number, Some(deed)));
        }
    }

    fn after(&mut self, deed: Deed, number: u32, image: &Image) {
        if let Deed::Batch(at) = deed
            && !self.subject.writes[at as usize]
        {
            return;
        }
        self.step(deed, image, (number, Some(deed)));
    }
}
