//! The cells that each step of a scan may write, in a program that was lowered for observation.
//!
//! `observe` requests the list of every step once, and then watches only these cells. A list
//! contains every public cell that the step may write, and of the private cells only the bits of
//! edges.

use super::control::ControlKind;
use super::eye::ScanStep;
use super::image::{BitCell, Image, WordCell};
use super::layout::{Cell, WordBitCell};
use super::ops::{ElementType, Formulas, MathTarget, OpKind, TouchedCells};
use super::program::{EngineProgram, PassStep};
use super::role::{self, FieldRole};
use crate::isa::{Bit, BitSpace, BlockId, ElementId};

/// Stretches of neighbouring bits and words: the first cell and the length of each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stretches {
    /// The stretches of bits.
    pub bits: Vec<(u32, u32)>,
    /// The stretches of words.
    pub words: Vec<(u32, u32)>,
    /// Words of which one bit alone may be written.
    pub word_bits: Vec<WordBitCell>,
}

impl Stretches {
    /// Whether a cell is among them.
    pub fn has(&self, cell: Cell) -> bool {
        let (all, at) = match cell {
            Cell::Bit(BitCell(at)) => (&self.bits, at),
            Cell::Word(WordCell(at)) => (&self.words, at),
            Cell::WordBit(bit) => (&self.words, bit.word.0),
        };
        let has_bit = |bit: &WordBitCell| match cell {
            Cell::Bit(_) => false,
            Cell::Word(word) => bit.word == word,
            Cell::WordBit(asked) => *bit == asked,
        };
        self.word_bits.iter().any(has_bit)
            || all.iter().any(|(first, count)| at >= *first && at - first < *count)
    }

    /// Adds `count` cells, from `first` on.
    pub fn add_cells(&mut self, first: Cell, count: u32) {
        match first {
            Cell::Bit(BitCell(at)) => self.bits.push((at, count)),
            Cell::Word(WordCell(at)) => self.words.push((at, count)),
            Cell::WordBit(bit) => self.word_bits.push(bit),
        }
    }

    fn bit(&mut self, BitCell(at): BitCell) {
        self.bits.push((at, 1));
    }

    pub(super) fn add(&mut self, touches: &TouchedCells) {
        let one = |cell: &u32| (*cell, 1);
        let many = |cells: &role::CellRange| (cells.first, cells.count);
        self.bits.extend(touches.bits_written.iter().map(one));
        self.bits.extend(touches.bit_arrays_written.iter().map(many));
        self.word_bits.extend(&touches.word_bits_written);
        let is_whole = |word: &&u32| !self.word_bits.iter().any(|bit| bit.word.0 == **word);
        self.words.extend(touches.words_written.iter().filter(is_whole).map(one));
        self.words.extend(touches.word_arrays_written.iter().map(many));
    }

    /// Removes private cells; `keeps_bits` keeps the bit of an edge.
    fn public(mut self, program: &EngineProgram, keeps_bits: bool) -> Stretches {
        self.bits.retain(|(first, _)| keeps_bits || *first < program.layout.bit_count());
        self.words.retain(|(first, _)| *first < program.layout.word_count());
        self
    }
}

impl EngineProgram {
    /// The cells that an operation may write, in a block or Stage.
    pub fn written_by_batch(&self, batch: u32, element: ElementId) -> Stretches {
        let batch = self.tables.batches[batch as usize];
        let mut written = Stretches::default();
        for at in batch.first as usize..batch.first as usize + batch.count as usize {
            if matches!(batch.kind, OpKind::Math | OpKind::Columns) {
                self.math(at, &mut written);
            } else if batch.kind == OpKind::Control {
                self.control(self.tables.ops.control[at].kind, element, &mut written);
            } else {
                let mut touches = TouchedCells::default();
                self.tables.ops.touches(batch.kind, at, &mut touches);
                written.add(&touches);
            }
        }
        // For an edge, the bit of its result, but not its history.
        let is_edge = self.is_edge(batch.kind);
        written.bits.truncate(if is_edge { 1 } else { usize::MAX });
        written.public(self, is_edge)
    }

    fn is_edge(&self, kind: OpKind) -> bool {
        matches!(kind, OpKind::Rise | OpKind::Fall)
    }

    fn math(&self, at: usize, written: &mut Stretches) {
        let math = &self.tables.ops.math[at];
        match math.put {
            MathTarget::Word { to, .. } | MathTarget::Real(to) => {
                written.words.push((to.word.0, 1))
            }
            MathTarget::Bit(bit) => written.bits.push((bit.0, 1)),
            MathTarget::At(at) => {
                let cells = (at.first, u32::from(at.count));
                match at.kind {
                    ElementType::Bits => written.bits.push(cells),
                    ElementType::WordBits => {
                        written.word_bits.extend(at.word_bits());
                    }
                    ElementType::Unsigned | ElementType::Integers | ElementType::Reals => {
                        written.words.push(cells);
                    }
                }
            }
            MathTarget::Index(_) => {}
        }
        let mishaps = Formulas { reads: &[], status: self.status() }.mishaps();
        written.bits.push((mishaps.start, mishaps.end - mishaps.start));
    }

    /// The cell of the first status bit, ST0.
    pub(super) fn status(&self) -> u32 {
        self.layout.bit(Bit::Space(BitSpace::St, 0)).0
    }

    /// The bits of blocks and Stages that a control instruction may write.
    pub(super) fn control(&self, kind: ControlKind, element: ElementId, written: &mut Stretches) {
        let running = |block| self.layout.bit(Bit::Running(block));
        let stage = |stage| self.layout.bit(Bit::Stage(stage));
        match kind {
            ControlKind::Run(block)
            | ControlKind::EnableOnce { task: block, .. }
            | ControlKind::EnableEvery { task: block, .. } => self.started(block, written),
            ControlKind::Restart(restart) => self.started(restart.program, written),
            ControlKind::Halt(block) => written.bit(running(block)),
            ControlKind::Exit => written.bit(running(element.block)),
            ControlKind::Jump(to) => {
                element.stage.into_iter().for_each(|from| written.bit(stage(from)));
                let to = &self.tables.stage_lists[to.places()];
                to.iter().for_each(|to| written.bit(stage(*to)));
            }
            ControlKind::StageOn(to) | ControlKind::StageOff(to) => written.bit(stage(to)),
            ControlKind::Converge { from, to } => {
                let from = &self.tables.stage_lists[from.places()];
                from.iter().for_each(|from| written.bit(stage(*from)));
                written.bit(stage(to));
            }
            // The operations of a subroutine are steps of their own.
            ControlKind::Stop
            | ControlKind::Call(_)
            | ControlKind::Return
            | ControlKind::KeepTime { .. }
            | ControlKind::GiveTime { .. } => {}
        }
    }

    fn started(&self, block: BlockId, written: &mut Stretches) {
        written.bit(self.layout.bit(Bit::Running(block)));
        written.bit(self.layout.bit(Bit::Done(block)));
    }

    /// The cells that a step of a pass may write.
    pub fn written_by_pass(&self, step: u32) -> Stretches {
        let mut touches = TouchedCells::default();
        let mut written = Stretches::default();
        match &self.tables.terminations[step as usize] {
            PassStep::BitOff(bit) => written.bits.push((*bit, 1)),
            PassStep::WordBitOff(bit) => bit.touches(&mut touches),
            PassStep::Counter(counter, _) => counter.touches(&mut touches),
            PassStep::Timer(timer, _) => timer.touches(&mut touches),
            PassStep::CountUp(counter) => written.bit(counter.enable_bits().0),
            PassStep::CountDown(counter) => written.bit(counter.enable_bits().1),
            PassStep::DisableTask(task) => written.bit(self.layout.bit(Bit::Running(*task))),
            PassStep::HistoryOff(_) | PassStep::HoldTimer(_) | PassStep::Pick(_) => {}
        }
        written.add(&touches);
        written.public(self, false)
    }

    /// The cells that a block's turn writes by itself: its own bits and those of its Stages.
    pub fn written_by_turn(&self, block: BlockId) -> Stretches {
        let mut written = Stretches::default();
        self.started(block, &mut written);
        for stage in self.stages_of(block) {
            written.bit(self.layout.bit(Bit::Stage(stage)));
        }
        written
    }

    /// The cell that an operation writes through an index at run time. `None` if the operation has
    /// no index, `Some(None)` if the index is outside of the array.
    pub fn selected(&self, deed: ScanStep, image: &Image) -> Option<Option<Cell>> {
        let ScanStep::Batch(batch) = deed else { return None };
        let batch = self.tables.batches[batch as usize];
        if !matches!(batch.kind, OpKind::Math | OpKind::Columns) {
            return None;
        }
        let MathTarget::At(at) = self.tables.ops.math[batch.first as usize].put else {
            return None;
        };
        let index = u32::try_from(image.word(WordCell(at.index))).ok();
        let index = index.filter(|index| *index < u32::from(at.count));
        Some(index.map(|index| match at.kind {
            ElementType::Bits => Cell::Bit(BitCell(at.first + index)),
            ElementType::WordBits => Cell::WordBit(at.word_bit(index)),
            ElementType::Unsigned | ElementType::Integers | ElementType::Reals => {
                Cell::Word(WordCell(at.first + index))
            }
        }))
    }
}
