//! A program with its memory and the states of its blocks and Stages. Also the steps that several
//! files share: start and stop of a block, a Stage's bit, the end of a pass, the read of an
//! element.
//!
//! `scan` makes the machine, `blocks` and `termination` execute it, `transfer` moves its states to
//! a new program, `state` and `state_bytes` store them. Behaviour: `docs/semantics.md`, section 4.

use super::events::{BlockEvent, Element, Events, MathEvent};
use super::image::BitCell;
use super::math::{Calculator, Maths};
use super::memory::Memory;
use super::program::EngineProgram;
use super::reach::FarReach;
use crate::isa::{Bit, BlockId, StageId};

/// The state of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlockState {
    /// It was stopped (or completed) since its last turn: its pass is due.
    pub pass_due: bool,
    /// It was started and has not had its first turn yet.
    pub first_turn: bool,
    /// Its own rungs executed since their last pass.
    pub executed: bool,
    /// Timestamp of the last execution of its own rungs, whole ms.
    pub executed_ms: u64,
    /// It is a Task that is enabled recurrently.
    pub recurrent: bool,
    /// Timestamp of a recurrent Task's first execution, ns.
    pub enabled_ns: u64,
    /// The interval, ns; 0: every scan.
    pub every_ns: u64,
    /// Number of intervals that had passed at its last execution.
    pub intervals: u64,
}

/// The state of a Stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageState {
    /// It was left or turned OFF since its last turn: its pass is due.
    pub pass_due: bool,
    /// It executed since its last pass.
    pub executed: bool,
    /// Timestamp of its last execution, whole ms.
    pub executed_ms: u64,
}

impl BlockState {
    /// Starts the time of its own rungs at `now_ms`, unless they executed since their last pass.
    pub(super) fn count_from(&mut self, now_ms: u64) {
        if !self.executed {
            self.executed_ms = now_ms;
        }
    }

    /// Changes the interval of a recurrently enabled Task. Multiples of the new interval count from
    /// the same first execution.
    pub(super) fn change_interval(&mut self, every_ms: i32, now_ns: u64) {
        if self.recurrent {
            self.every_ns = u64::from(every_ms.max(0).unsigned_abs()) * 1_000_000;
            let since_ns = now_ns.saturating_sub(self.enabled_ns);
            self.intervals = since_ns.checked_div(self.every_ns).unwrap_or(0);
        }
    }
}

impl StageState {
    /// Does the same as [`BlockState::count_from`], for a Stage.
    pub(super) fn count_from(&mut self, now_ms: u64) {
        if !self.executed {
            self.executed_ms = now_ms;
        }
    }
}

/// A program, its memory and the state of its blocks.
#[derive(Debug)]
pub(super) struct Machine {
    pub program: EngineProgram,
    pub memory: Memory,
    pub calculator: Calculator,
    pub blocks: Box<[BlockState]>,
    pub stages: Box<[StageState]>,
    /// By subroutine: the element whose turn it was at its last execution.
    pub callers: Box<[Option<Element>]>,
    pub events: Events,
    pub now_ns: u64,
    pub stop_requested: bool,
}

impl Machine {
    /// A bit of a block or Stage.
    #[inline(always)]
    pub fn bit_of(&self, bit: Bit) -> bool {
        self.memory.image.bit(self.program.layout.bit(bit))
    }

    /// Writes the bit of a block or Stage; these bits cannot be forced.
    pub fn put_bit(&mut self, bit: Bit, on: bool) {
        let BitCell(cell) = self.program.layout.bit(bit);
        self.memory.image.bits[cell as usize] = u8::from(on);
    }

    /// Whether a block runs.
    pub fn is_running(&self, id: BlockId) -> bool {
        self.bit_of(Bit::Running(id))
    }

    /// The state of a block.
    pub fn state(&mut self, id: BlockId) -> &mut BlockState {
        &mut self.blocks[id.0 as usize]
    }

    /// The state of a Stage.
    pub fn stage_state(&mut self, id: StageId) -> &mut StageState {
        &mut self.stages[id.0 as usize]
    }

    /// Stops a block (HALT, EXIT, a disabled Task): `.Running` goes OFF at once, the pass runs at
    /// the next turn.
    pub fn halt(&mut self, id: BlockId) {
        if self.is_running(id) {
            self.put_bit(Bit::Running(id), false);
            self.state(id).pass_due = true;
            self.events.push(BlockEvent::Stopped(id));
        }
    }

    /// Starts a Program, unless it runs.
    pub fn start_program(&mut self, id: BlockId) {
        if !self.is_running(id) {
            self.mark_started(id);
        }
    }

    /// Turns `.Running` ON and `.Done` OFF; the first turn follows.
    pub fn mark_started(&mut self, id: BlockId) {
        self.put_bit(Bit::Running(id), true);
        self.put_bit(Bit::Done(id), false);
        self.state(id).first_turn = true;
        self.events.push(BlockEvent::Started(id));
    }

    /// Turns a Stage's bit ON or OFF. Does not mark its pass as due.
    #[inline(always)]
    pub fn switch_stage(&mut self, stage: StageId, on: bool) {
        if self.bit_of(Bit::Stage(stage)) != on {
            self.put_bit(Bit::Stage(stage), on);
            let event = if on { BlockEvent::StageOn(stage) } else { BlockEvent::StageOff(stage) };
            self.events.push(event);
        }
    }

    /// Turns a Stage OFF and marks its pass as due.
    pub fn leave_stage(&mut self, stage: StageId) {
        if self.bit_of(Bit::Stage(stage)) {
            self.switch_stage(stage, false);
            self.stage_state(stage).pass_due = true;
        }
    }

    /// Reads an element of an array outside of the batches, for a pass or an ENTASK. Writes only
    /// private words and status bits, which are never forced.
    pub fn pick(&mut self, pick: u32) {
        let Machine { program: EngineProgram { tables, .. }, memory, calculator, events, .. } =
            self;
        let pick = pick as usize;
        let maths = Maths { maths: &tables.picks[pick..=pick], steps: &tables.steps };
        calculator.run::<FarReach>(maths, memory.view::<FarReach>(), |math, mishaps| {
            events.push_math(MathEvent { math, mishaps });
        });
    }

    /// Records the event that a pass ran.
    pub fn terminated(&mut self, element: Element) {
        self.events.push(BlockEvent::Terminated(element));
    }
}
