//! An engine program: tables of operations, batches over them, elements, blocks.
//!
//! Made by `lower`, which cannot fail: the resolver and the checks have found every mistake before.
//! Read-only while it runs.

use std::ops::Range;

use super::image::{BitCell, WordCell};
use super::layout::{Cell, Layout};
use super::ops::{FormulaStep, Math, Op, OpKind, OpTables};
use super::places::{Counter, CounterRule, Sensaphone, Timer, TimerRule};
use super::resume_bits::ResumeBits;
use super::role::WordBitWritten;
use crate::isa::{BlockId, StageId};

/// Operations of one kind that execute one after the other: `first..first + count` of their table.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Batch {
    pub kind: OpKind,
    pub first: u32,
    pub count: u32,
}

/// The effect of a termination pass on one instruction.
#[derive(Clone, Debug)]
pub enum PassStep {
    /// OUT, PD, ND and output parameters: the bit goes OFF.
    BitOff(u32),
    /// The same for a bit of a word.
    WordBitOff(WordBitWritten),
    /// An edge history goes OFF.
    HistoryOff(u32),
    /// CNT, CNTDN, UDC.
    Counter(Counter, CounterRule),
    /// The timers with termination logic.
    Timer(Timer, TimerRule),
    /// TMRAG: only its time is held.
    HoldTimer(Timer),
    /// CTU: its enable bit and history.
    CountUp(Sensaphone),
    /// CTD.
    CountDown(Sensaphone),
    /// A recurrent ENTASK: the Task is disabled.
    DisableTask(BlockId),
    /// Executes the MATH with this index in `picks`: it reads the preset of the next step from an
    /// array.
    Pick(u32),
}

impl PassStep {
    /// The bit that the step turns OFF.
    pub fn bit_off(&self) -> Option<Cell> {
        if let PassStep::BitOff(bit) = self {
            return Some(Cell::Bit(BitCell(*bit)));
        }
        if let PassStep::WordBitOff(bit) = self {
            return Some(Cell::WordBit(bit.0));
        }
        None
    }
}

/// All operations and terminations of a program.
#[derive(Clone, Debug, Default)]
pub struct Tables {
    /// The operations, one table for each kind.
    pub ops: OpTables,
    /// The steps of all formulas.
    pub steps: Vec<FormulaStep>,
    /// The largest number of slots that a formula needs.
    pub slots: u32,
    /// Batches of all elements, in order of execution.
    pub batches: Vec<Batch>,
    /// Terminations of all elements, in file order.
    pub terminations: Vec<PassStep>,
    /// The MATHs that read an element of an array for a pass or an ENTASK.
    pub picks: Vec<Math>,
    /// The Stages that JMP, SGDIVRG and SGCONVRG list, instruction by instruction.
    pub stage_lists: Vec<StageId>,
}

/// An element: a block's own rungs, or a Stage.
#[derive(Clone, Debug)]
pub struct ElementCode {
    /// Its batches.
    pub batches: Range<u32>,
    /// Its terminations.
    pub terminations: Range<u32>,
    /// Whether it has a rung: an element without rungs is never terminated.
    pub has_rungs: bool,
}

/// When a block executes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockRole {
    /// A Program; `autostart`: from the first scan on.
    Program {
        /// Whether it runs from the start.
        autostart: bool,
    },
    /// A Task that ENTASK starts.
    Task,
    /// Built-in: once, in the first scan.
    FirstScan,
    /// Built-in: every scan, before the Programs.
    TopOfScan,
    /// Built-in: every scan, after the Programs.
    BottomOfScan,
    /// Built-in: once, in the last scan.
    LastScan,
    /// A subroutine, which has no turn: CALL executes it.
    Subroutine,
}

/// A block.
#[derive(Clone, Debug)]
pub struct BlockCode {
    /// When it executes.
    pub role: BlockRole,
    /// Its own rungs.
    pub own: ElementCode,
    /// Its Stages, the initial one first.
    pub stages: Range<u32>,
}

/// A whole program for an [`Engine`](super::Engine).
#[derive(Clone, Debug)]
pub struct EngineProgram {
    /// The cells of all addresses.
    pub layout: Layout,
    /// Number of all bits: the public ones and the program's own.
    pub bit_count: u32,
    /// Number of all words: the public ones and the program's constants.
    pub word_count: u32,
    /// The values of bits after a cold start; all others are OFF.
    pub initial_bits: Vec<(BitCell, bool)>,
    /// The values of words after a cold start; all others are 0. Those of private words are
    /// constants.
    pub initial_words: Vec<(WordCell, i32)>,
    /// Operations, batches, terminations.
    pub tables: Tables,
    /// Blocks, by `BlockId`.
    pub blocks: Vec<BlockCode>,
    /// Stages, by `StageId`.
    pub stages: Vec<ElementCode>,
    /// The order of the turns: built-in tasks at their places, all other blocks but subroutines
    /// once.
    pub order: Vec<BlockId>,
    /// The subroutines, in file order.
    pub subroutines: Vec<BlockId>,
    /// The Programs whose Stages are retained.
    pub kept: Vec<ResumeBits>,
}

impl Tables {
    /// The operations of a batch, in order of execution.
    pub fn ops_of(&self, batch: Batch) -> impl Iterator<Item = Op> + '_ {
        let places = batch.first as usize..(batch.first + batch.count) as usize;
        places.map(move |at| self.ops.op(batch.kind, at))
    }

    /// The steps of the formula of a batch's `nth` MATH. In columns, the steps of all formulas of
    /// the batch alternate.
    pub fn formula(&self, batch: Batch, nth: u32) -> Vec<FormulaStep> {
        let math = &self.ops.math[(batch.first + nth) as usize];
        let in_columns = batch.kind == OpKind::Columns;
        let (first, apart) =
            if in_columns { (math.first + nth, batch.count as usize) } else { (math.first, 1) };
        let steps = self.steps[first as usize..].iter().step_by(apart);
        steps.take(math.count as usize).copied().collect()
    }
}

impl EngineProgram {
    /// The block with this number.
    pub(super) fn block(&self, id: BlockId) -> &BlockCode {
        &self.blocks[id.0 as usize]
    }

    /// The Stages of a block.
    pub(super) fn stages_of(&self, id: BlockId) -> impl Iterator<Item = StageId> + use<> {
        self.block(id).stages.clone().map(StageId)
    }
}
