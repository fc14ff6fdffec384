//! Termination passes, as in the engine's `termination`. Those behind the last scan are left out:
//! no scan follows them.

use super::encoder::Encoder;
use crate::aig::Literal;
use crate::gates::Held;
use rungd_engine::isa::{BlockId, StageId};
use rungd_engine::{Element, ElementCode, PassStep};

impl Encoder<'_> {
    /// A block's pass; then its Stages go OFF.
    pub(super) fn pass_block(&mut self, id: BlockId) {
        if self.guard == Literal::FALSE {
            return;
        }
        let executed = self.take_own(Held::Executed(id));
        self.under(executed, |scan| {
            scan.pass(&scan.code.blocks[id.0 as usize].own);
            scan.pass_subroutines(Element::Block(id));
        });
        let stages = self.stages_of(id);
        for stage in &stages {
            self.pass_stage(*stage);
            self.put_own_if(Literal::TRUE, Held::StagePassDue(*stage), Literal::FALSE);
        }
        for stage in stages {
            self.switch_stage(stage, Literal::FALSE);
        }
    }

    /// A Stage's pass, if it executed since its last pass.
    pub(super) fn pass_stage(&mut self, stage: StageId) {
        if self.guard == Literal::FALSE {
            return;
        }
        let executed = self.take_own(Held::StageExecuted(stage));
        self.under(executed, |scan| {
            scan.pass(&scan.code.stages[stage.0 as usize]);
            scan.pass_subroutines(Element::Stage(stage));
        });
    }

    /// The passes of the subroutines that an element executed.
    fn pass_subroutines(&mut self, caller: Element) {
        for at in 0..self.code.subroutines.len() {
            let number = at as u32;
            if !self.callers.get(&number).is_some_and(|callers| callers.contains(&caller)) {
                continue;
            }
            let called = self.own(Held::Caller(number, caller));
            self.under(called, |scan| scan.pass_subroutine(scan.code.subroutines[at]));
        }
    }

    fn pass_subroutine(&mut self, id: BlockId) {
        let executed = self.take_own(Held::Executed(id));
        self.under(executed, |scan| {
            scan.put_running(id, Literal::FALSE);
            scan.pass(&scan.code.blocks[id.0 as usize].own);
        });
    }

    pub(super) fn pass(&mut self, code: &ElementCode) {
        if self.guard == Literal::FALSE {
            return;
        }
        let execution = self.next_execution();
        for at in code.terminations.clone() {
            let code = self.code;
            self.pass_step(&code.tables.terminations[at as usize]);
        }
        self.execution = execution;
    }

    fn pass_step(&mut self, step: &PassStep) {
        match step {
            PassStep::BitOff(bit) | PassStep::HistoryOff(bit) => {
                self.put_bit(*bit, Literal::FALSE);
            }
            PassStep::WordBitOff(bit) => {
                self.put_word_bit_if(Literal::TRUE, bit.0, Literal::FALSE);
            }
            PassStep::Counter(counter, rule) => self.terminate_counter(*counter, rule),
            PassStep::Timer(timer, rule) => self.terminate_timer(*timer, *rule),
            PassStep::HoldTimer(timer) => self.hold_timer(*timer),
            PassStep::CountUp(counter) => self.terminate_up(counter),
            PassStep::CountDown(counter) => self.terminate_down(counter),
            PassStep::DisableTask(task) => self.halt(*task),
            PassStep::Pick(pick) => self.picked(*pick),
        }
    }
}
