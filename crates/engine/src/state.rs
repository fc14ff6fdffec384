//! The state that an engine keeps between two calls, as a value to resume, compare or store.
//!
//! `record` stores states and passes them to engines of the same program. The scan thread copies a
//! state into memory that was allocated before. Data that lasts only for one call is not in a
//! state: events, and the slots of formulas.

use std::borrow::Cow;
use std::ops::Range;

use super::events::Element;
use super::image::{BitCell, WordCell};
use super::layout::{Cell, Layout, WordBitCell};
use super::machine::{BlockState, StageState};
use super::program::EngineProgram;
use super::scan::Engine;

/// The state of an engine between two calls.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EngineState {
    /// All bits, the program's own included: 0 or 1.
    pub(super) bits: Box<[u8]>,
    /// All words, the constants included.
    pub(super) words: Box<[i32]>,
    /// Whether each of `bits` is forced.
    pub(super) forced_bits: Box<[bool]>,
    /// Whether each of `words` is forced.
    pub(super) forced_words: Box<[bool]>,
    /// The number of forced cells.
    pub(super) forces: u32,
    pub(super) blocks: Box<[BlockState]>,
    pub(super) stages: Box<[StageState]>,
    /// By subroutine: the element that executed it last.
    pub(super) callers: Box<[Option<Element>]>,
    /// The timestamp of the last scan.
    pub(super) now_ns: u64,
    /// When RUN began.
    pub(super) start_ns: u64,
    /// Scans since RUN began.
    pub(super) scans: u64,
    /// The last scan has begun.
    pub(super) last: bool,
    pub(super) stop_requested: bool,
    /// The words that its bytes do not have, because an earlier version of rungd recorded it.
    pub(super) absent_words: Range<usize>,
}

impl EngineState {
    /// The state of an engine. Allocates.
    pub fn of(engine: &Engine) -> EngineState {
        let (image, machine) = (engine.image(), &engine.machine);
        EngineState {
            bits: image.bits().into(),
            words: image.words().into(),
            forced_bits: image.forced_bits.clone(),
            forced_words: image.forced_words.clone(),
            forces: image.forces(),
            blocks: machine.blocks.clone(),
            stages: machine.stages.clone(),
            callers: machine.callers.clone(),
            now_ns: machine.now_ns,
            start_ns: engine.start_ns,
            scans: engine.scans,
            last: engine.last,
            stop_requested: machine.stop_requested,
            absent_words: engine.absent_words.clone(),
        }
    }

    /// Becomes the state of an engine of the same program. Allocates nothing.
    pub fn copy_from(&mut self, engine: &Engine) {
        let (image, machine) = (engine.image(), &engine.machine);
        self.bits.copy_from_slice(image.bits());
        self.words.copy_from_slice(image.words());
        if self.forces > 0 || image.forces() > 0 {
            self.forced_bits.copy_from_slice(&image.forced_bits);
            self.forced_words.copy_from_slice(&image.forced_words);
        }
        self.forces = image.forces();
        self.blocks.copy_from_slice(&machine.blocks);
        self.stages.copy_from_slice(&machine.stages);
        self.callers.copy_from_slice(&machine.callers);
        (self.now_ns, self.stop_requested) = (machine.now_ns, machine.stop_requested);
        (self.start_ns, self.scans, self.last) = (engine.start_ns, engine.scans, engine.last);
        self.absent_words.clone_from(&engine.absent_words);
    }

    /// The state for a program of this version: a state of rungd 0.2 gets the words that it does
    /// not have, as 0.
    fn widened(&self, program: &EngineProgram) -> Cow<'_, EngineState> {
        let later = program.layout.later_words();
        if self.words.len() + later.len() != program.word_count as usize {
            return Cow::Borrowed(self);
        }
        let mut state = self.clone();
        let (before, behind) = self.words.split_at(later.start);
        state.words = [before, &vec![0; later.len()], behind].concat().into();
        let (before, behind) = self.forced_words.split_at(later.start);
        state.forced_words = [before, &vec![false; later.len()], behind].concat().into();
        state.absent_words = later;
        Cow::Owned(state)
    }

    /// Whether its numbers of bits, words, blocks, Stages and subroutines are those of a program.
    pub fn fits(&self, program: &EngineProgram) -> bool {
        self.bits.len() == program.bit_count as usize
            && self.words.len() == program.word_count as usize
            && self.blocks.len() == program.blocks.len()
            && self.stages.len() == program.stages.len()
            && self.callers.len() == program.subroutines.len()
    }

    /// A bit (0 or 1) or a word.
    pub fn value(&self, cell: Cell) -> i32 {
        match cell {
            Cell::Bit(BitCell(at)) => i32::from(self.bits[at as usize]),
            Cell::Word(WordCell(at)) => self.words[at as usize],
            Cell::WordBit(bit) => i32::from(bit.is_on(self.words[bit.word.0 as usize])),
        }
    }

    /// All bits: 0 or 1.
    pub fn bits(&self) -> &[u8] {
        &self.bits
    }

    /// All words.
    pub fn words(&self) -> &[i32] {
        &self.words
    }

    /// Whether a bit or word is forced; a bit of a word with its word.
    pub fn is_forced(&self, cell: Cell) -> bool {
        self.forces > 0
            && match cell {
                Cell::Bit(BitCell(at)) => self.forced_bits[at as usize],
                Cell::Word(WordCell(at))
                | Cell::WordBit(WordBitCell { word: WordCell(at), .. }) => {
                    self.forced_words[at as usize]
                }
            }
    }

    /// The public bits and words that are forced.
    pub fn forced<'s>(&'s self, layout: &Layout) -> impl Iterator<Item = Cell> + use<'s> {
        let bits = (0..layout.bit_count()).map(|at| Cell::Bit(BitCell(at)));
        let words = (0..layout.word_count()).map(|at| Cell::Word(WordCell(at)));
        bits.chain(words).filter(|cell| self.is_forced(*cell))
    }

    /// The timestamp of the last scan, ns.
    pub fn now_ns(&self) -> u64 {
        self.now_ns
    }

    /// Scans since RUN began.
    pub fn scans(&self) -> u64 {
        self.scans
    }

    /// When RUN began, ns.
    pub fn start_ns(&self) -> u64 {
        self.start_ns
    }

    /// Whether the next scan is the last one, or the last one has begun.
    pub fn stops(&self) -> bool {
        self.stop_requested
    }

    /// The same state at another time: its last scan, the start of RUN and every time that it
    /// remembers are at whole milliseconds, and RUN began at a multiple of a minute. If every
    /// later scan comes whole milliseconds after the last one, the future is the same: parts of a
    /// millisecond are never seen then.
    #[must_use]
    pub fn at_whole_ms(mut self) -> EngineState {
        let now_ms = self.now_ns / NS_PER_MS;
        let since_start_ms = self.now_ns.saturating_sub(self.start_ns) / NS_PER_MS;
        // Later by less than a minute, so that no time comes before the start of the machine.
        let start_ms = now_ms.saturating_sub(since_start_ms).next_multiple_of(MINUTE_MS);
        let later_ms = start_ms + since_start_ms - now_ms;
        for block in &mut self.blocks {
            block.executed_ms += later_ms;
            let enabled_ms = self.now_ns.saturating_sub(block.enabled_ns) / NS_PER_MS;
            block.enabled_ns = (now_ms + later_ms).saturating_sub(enabled_ms) * NS_PER_MS;
        }
        self.stages.iter_mut().for_each(|stage| stage.executed_ms += later_ms);
        self.start_ns = start_ms * NS_PER_MS;
        self.now_ns = (now_ms + later_ms) * NS_PER_MS;
        self
    }
}

const NS_PER_MS: u64 = 1_000_000;

/// A multiple of the periods of all clock bits.
const MINUTE_MS: u64 = 60_000;

impl Engine {
    /// Continues from a state. Returns false and changes nothing if it cannot be a state of this
    /// program. Allocates nothing, but for a state of an earlier version of rungd.
    pub fn resume(&mut self, state: &EngineState) -> bool {
        let state = &*state.widened(&self.machine.program);
        if !state.is_of(&self.machine.program) {
            return false;
        }
        let machine = &mut self.machine;
        let image = &mut machine.memory.image;
        image.bits[..state.bits.len()].copy_from_slice(&state.bits);
        image.words[..state.words.len()].copy_from_slice(&state.words);
        image.put_forced(state.forces, &state.forced_bits, &state.forced_words);
        machine.blocks.copy_from_slice(&state.blocks);
        machine.stages.copy_from_slice(&state.stages);
        machine.callers.copy_from_slice(&state.callers);
        (machine.now_ns, machine.stop_requested) = (state.now_ns, state.stop_requested);
        machine.events.clear();
        (self.start_ns, self.scans, self.last) = (state.start_ns, state.scans, state.last);
        self.absent_words.clone_from(&state.absent_words);
        true
    }
}
