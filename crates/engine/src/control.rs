//! Control instructions as data: they start, stop and switch blocks and Stages, and call
//! subroutines. `blocks` executes them.
//!
//! The scheduler in `lower` moves no operation past a control operation, because a control
//! operation can end the block's execution or switch bits that other operations read.

use super::power::Power;
use crate::isa::{BlockId, StageId};

/// A control instruction with its rung's power.
#[derive(Clone, Copy, Debug)]
pub struct Control {
    /// The rung's power.
    pub leg: Power,
    /// Its action while the rung is ON (ENTASK and RESTART: see their variants).
    pub kind: ControlKind,
}

/// Several Stages: `first..first + count` of the program's `stage_lists`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct StageList {
    pub first: u32,
    pub count: u32,
}

impl StageList {
    /// The indices in `stage_lists`.
    pub fn places(self) -> std::ops::Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

/// The control instructions.
#[derive(Clone, Copy, Debug)]
pub enum ControlKind {
    /// RUN of a Program.
    Run(BlockId),
    /// RESTART of a Program, at the rising edge.
    Restart(RestartState),
    /// HALT of a Program or Task.
    Halt(BlockId),
    /// EXIT of the Program that contains it.
    Exit,
    /// Run-once ENTASK: the Task, and the cell of the edge history.
    EnableOnce {
        /// The Task.
        task: BlockId,
        /// The cell of the edge history.
        history: u32,
    },
    /// Recurrent ENTASK.
    EnableEvery {
        /// The Task.
        task: BlockId,
        /// The word of the interval, ms.
        every: u32,
        /// The index in `picks` of the MATH that reads the interval from an array.
        pick: Option<u32>,
    },
    /// JMP and SGDIVRG: from the instruction's Stage to these Stages.
    Jump(StageList),
    /// SGSET.
    StageOn(StageId),
    /// SGRST.
    StageOff(StageId),
    /// SGCONVRG: when all of these are ON, they go OFF and the target comes ON.
    Converge {
        /// The Stages that must be ON.
        from: StageList,
        /// The target.
        to: StageId,
    },
    /// STOP: the next scan is the last.
    Stop,
    /// CALL of a subroutine, by its index in the program's `subroutines`.
    Call(u32),
    /// RETURN: ends the subroutine's execution.
    Return,
    /// Before an instruction that may end a subroutine's execution: adds the time since the last
    /// execution to what the timers behind have missed.
    KeepTime {
        /// A private word: the time that they have missed, in ms.
        missed_ms: u32,
    },
    /// Behind it: gives the timers behind the time that they have missed.
    GiveTime {
        /// The word of its `KeepTime`.
        missed_ms: u32,
    },
}

impl ControlKind {
    /// Whether it also acts while its rung is OFF: it stores its edge's history, disables its Task,
    /// or keeps the time that timers have missed.
    #[inline(always)]
    pub(super) fn acts_while_off(&self) -> bool {
        match self {
            ControlKind::Restart(_)
            | ControlKind::EnableOnce { .. }
            | ControlKind::EnableEvery { .. }
            | ControlKind::KeepTime { .. }
            | ControlKind::GiveTime { .. } => true,
            ControlKind::Run(_)
            | ControlKind::Halt(_)
            | ControlKind::Exit
            | ControlKind::Jump(_)
            | ControlKind::StageOn(_)
            | ControlKind::StageOff(_)
            | ControlKind::Converge { .. }
            | ControlKind::Stop
            | ControlKind::Call(_)
            | ControlKind::Return => false,
        }
    }
}

/// RESTART's Program and the cell of its edge history.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct RestartState {
    pub program: BlockId,
    pub history: u32,
}

/// What follows a control instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AfterControl {
    /// The next operation.
    Continue,
    /// The end of the subroutine's execution.
    Return,
    /// The execution of a subroutine, by its index in the program's `subroutines`.
    Call(u32),
    /// The end of the block's execution.
    EndBlock,
}

impl AfterControl {
    /// The end of the block's execution, or the next operation.
    pub fn end_block_if(ends: bool) -> AfterControl {
        if ends { AfterControl::EndBlock } else { AfterControl::Continue }
    }
}
