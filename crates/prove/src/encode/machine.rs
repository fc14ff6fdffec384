//! Starts and stops of blocks, and Stages' bits, as in the engine's `machine`.

use super::encoder::Encoder;
use crate::aig::Literal;
use crate::gates::Held;
use rungd_engine::isa::{Bit, BlockId, StageId};

impl Encoder<'_> {
    pub(super) fn running(&mut self, id: BlockId) -> Literal {
        self.bit(self.code.layout.bit(Bit::Running(id)).0)
    }

    pub(super) fn put_running(&mut self, id: BlockId, on: Literal) {
        self.put_bit(self.code.layout.bit(Bit::Running(id)).0, on);
    }

    /// The Stages of a block.
    pub(super) fn stages_of(&self, id: BlockId) -> Vec<StageId> {
        self.code.blocks[id.0 as usize].stages.clone().map(StageId).collect()
    }

    /// Starts an execution whose private cells pass values; returns the one before.
    pub(super) fn next_execution(&mut self) -> u32 {
        self.executions += 1;
        std::mem::replace(&mut self.execution, self.executions)
    }

    /// Stops a block.
    pub(super) fn halt(&mut self, id: BlockId) {
        let runs = self.running(id);
        self.put_own_if(runs, Held::PassDue(id), Literal::TRUE);
        self.put_running(id, Literal::FALSE);
    }

    /// Starts a Program, unless it runs.
    pub(super) fn start_program(&mut self, id: BlockId) {
        let runs = self.running(id);
        self.under(!runs, |scan| scan.mark_started(id));
    }

    pub(super) fn mark_started(&mut self, id: BlockId) {
        self.put_running(id, Literal::TRUE);
        self.put_bit(self.code.layout.bit(Bit::Done(id)).0, Literal::FALSE);
        self.put_own_if(Literal::TRUE, Held::FirstTurn(id), Literal::TRUE);
    }

    /// Turns a Stage's bit ON or OFF.
    pub(super) fn switch_stage(&mut self, stage: StageId, on: Literal) {
        self.put_bit(self.code.layout.bit(Bit::Stage(stage)).0, on);
    }

    /// Turns a Stage OFF and marks its pass as due.
    pub(super) fn leave_stage(&mut self, stage: StageId) {
        let on = self.stage_on(stage);
        self.put_own_if(on, Held::StagePassDue(stage), Literal::TRUE);
        self.switch_stage(stage, Literal::FALSE);
    }

    pub(super) fn stage_on(&mut self, stage: StageId) -> Literal {
        self.bit(self.code.layout.bit(Bit::Stage(stage)).0)
    }
}
