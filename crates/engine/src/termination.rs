//! The termination pass over an element. Called by `blocks`, `scan` and `transfer`.
//!
//! Behaviour: `docs/semantics.md`, section 4, the table of the pass, and *Subroutines*. An element
//! has a pass only if at least one of its rungs executed since its last pass; it covers the
//! subroutines that the element executed.

use super::events::Element;
use super::eye::{ScanObserver, ScanStep};
use super::machine::Machine;
use super::program::{ElementCode, PassStep};
use super::reach::Reach;
use super::role::{BitOwn, BitWritten, WordBitWritten, WordRead, WordWritten};
use crate::isa::{Bit, BlockId, StageId};

impl Machine {
    /// A block's pass: over its own rungs, then over the Stages that executed; then turns its
    /// Stages OFF.
    pub fn pass_block<R: Reach>(&mut self, id: BlockId, eye: &mut impl ScanObserver) {
        if std::mem::take(&mut self.blocks[id.0 as usize].executed) {
            let code = self.program.block(id).own.clone();
            self.pass::<R>(&code, eye);
            self.pass_subroutines::<R>(Some(Element::Block(id)), eye);
            self.terminated(Element::Block(id));
        }
        for stage in self.program.stages_of(id) {
            self.pass_stage::<R>(stage, eye);
            self.stages[stage.0 as usize].pass_due = false;
        }
        for stage in self.program.stages_of(id) {
            self.switch_stage(stage, false);
        }
    }

    /// A Stage's pass, if it executed since its last pass.
    pub fn pass_stage<R: Reach>(&mut self, stage: StageId, eye: &mut impl ScanObserver) {
        if std::mem::take(&mut self.stages[stage.0 as usize].executed) {
            let code = self.program.stages[stage.0 as usize].clone();
            self.pass::<R>(&code, eye);
            self.pass_subroutines::<R>(Some(Element::Stage(stage)), eye);
            self.terminated(Element::Stage(stage));
        }
    }

    /// The passes of the subroutines that an element executed, in file order; `None`: of those that
    /// no element has executed, after memory was restored.
    pub fn pass_subroutines<R: Reach>(
        &mut self,
        caller: Option<Element>,
        eye: &mut impl ScanObserver,
    ) {
        for at in 0..self.callers.len() {
            if self.callers[at] == caller {
                self.pass_subroutine::<R>(at, eye);
            }
        }
    }

    /// The pass of a subroutine, by its index, if it executed since its last pass.
    pub fn pass_subroutine<R: Reach>(&mut self, at: usize, eye: &mut impl ScanObserver) {
        let id = self.program.subroutines[at];
        if std::mem::take(&mut self.state(id).executed) {
            self.put_bit(Bit::Running(id), false);
            let code = self.program.block(id).own.clone();
            self.pass::<R>(&code, eye);
        }
    }

    pub(super) fn pass<R: Reach>(&mut self, code: &ElementCode, eye: &mut impl ScanObserver) {
        for at in code.terminations.clone() {
            eye.before(ScanStep::Pass(at), &self.memory.image);
            self.pass_step::<R>(at as usize);
            eye.after(ScanStep::Pass(at), &self.memory.image);
        }
    }

    fn pass_step<R: Reach>(&mut self, at: usize) {
        if let PassStep::DisableTask(task) = self.program.tables.terminations[at] {
            return self.halt(task);
        }
        if let PassStep::Pick(pick) = self.program.tables.terminations[at] {
            return self.pick(pick);
        }
        let mut view = self.memory.view::<R>();
        match &self.program.tables.terminations[at] {
            PassStep::BitOff(bit) => view.put_bit(BitWritten(*bit), 0),
            PassStep::WordBitOff(WordBitWritten(bit)) => {
                let content = view.word(WordRead(bit.word.0));
                view.put_word(WordWritten(bit.word.0), bit.put(content, false));
            }
            PassStep::HistoryOff(cell) => view.put_own(BitOwn(*cell), 0),
            PassStep::Counter(counter, rule) => counter.terminate(&mut view, rule),
            PassStep::Timer(timer, rule) => timer.terminate(&mut view, *rule),
            PassStep::HoldTimer(timer) => timer.hold(&mut view),
            PassStep::CountUp(counter) => counter.terminate_up(&mut view),
            PassStep::CountDown(counter) => counter.terminate_down(&mut view),
            PassStep::DisableTask(_) | PassStep::Pick(_) => unreachable!("handled above"),
        }
    }
}
