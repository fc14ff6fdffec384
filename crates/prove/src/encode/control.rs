//! Control instructions, as in the engine's `blocks` and `machine`.

use super::Encoder;
use super::latches::OwnNumber;
use super::number::Number;
use crate::aig::Literal;
use crate::gates::Held;
use rungd_engine::Batch;
use rungd_engine::isa::{Bit, BlockId, ElementId, StageId};
use rungd_engine::ops::{Control, ControlKind, Op, StageList};

impl Encoder<'_> {
    /// A batch of control instructions in the turn of an element; narrows the guard to what
    /// follows. Returns when the block's execution ends.
    pub(super) fn controls(&mut self, batch: Batch, element: ElementId) -> Literal {
        let mut ended = Literal::FALSE;
        for op in self.code.tables.ops_of(batch) {
            let Op::Control(control) = op else { unreachable!("a batch of control") };
            let ends = self.control(control, element);
            ended = self.graph.or(ended, ends);
        }
        ended
    }

    fn control(&mut self, control: Control, element: ElementId) -> Literal {
        let on = self.power(control.leg);
        match control.kind {
            ControlKind::Restart(restart) => {
                let rises = self.rises(restart.history, on);
                self.under(rises, |scan| {
                    scan.halt(restart.program);
                    scan.start_program(restart.program);
                });
                if restart.program == element.block { self.ends(rises) } else { Literal::FALSE }
            }
            ControlKind::EnableOnce { task, history } => {
                let rises = self.rises(history, on);
                self.under(rises, |scan| scan.enable_once(task));
                Literal::FALSE
            }
            ControlKind::EnableEvery { task, every, pick } => {
                let runs = self.running(task);
                let enables = self.graph.and(on, !runs);
                self.under(enables, |scan| scan.enable_every(task, every, pick));
                self.under(!on, |scan| scan.halt(task));
                Literal::FALSE
            }
            ControlKind::Run(program) => {
                self.under(on, |scan| scan.start_program(program));
                Literal::FALSE
            }
            ControlKind::Halt(block) => {
                self.under(on, |scan| scan.halt(block));
                if block == element.block { self.ends(on) } else { Literal::FALSE }
            }
            ControlKind::Exit => {
                self.under(on, |scan| scan.halt(element.block));
                self.ends(on)
            }
            ControlKind::StageOn(stage) => {
                self.under(on, |scan| scan.switch_stage(stage, Literal::TRUE));
                Literal::FALSE
            }
            ControlKind::StageOff(stage) => {
                self.under(on, |scan| scan.leave_stage(stage));
                Literal::FALSE
            }
            ControlKind::Stop => {
                let stops = self.graph.and(self.guard, on);
                self.stop_requested = self.graph.or(self.stop_requested, stops);
                Literal::FALSE
            }
            ControlKind::Jump(targets) => {
                self.under(on, |scan| scan.jump(targets, element));
                Literal::FALSE
            }
            ControlKind::Converge { from, to } => {
                self.under(on, |scan| scan.converge(from, to));
                Literal::FALSE
            }
            ControlKind::Call(subroutine) => {
                let ended = self.under(on, |scan| scan.call(subroutine, element));
                self.ends(ended)
            }
            ControlKind::Return { missed_ms } => {
                self.return_if(on, missed_ms);
                Literal::FALSE
            }
        }
    }

    /// Narrows the guard to what follows an end of the execution; returns when it ends.
    fn ends(&mut self, condition: Literal) -> Literal {
        let ends = self.graph.and(self.guard, condition);
        self.guard = self.graph.and(self.guard, !condition);
        ends
    }

    /// RETURN: ends the subroutine's execution, not that of the block.
    fn return_if(&mut self, on: Literal, missed_ms: u32) {
        let missed = self.word(missed_ms);
        let elapsed = self.elapsed_ms.clone().expect("an element with RETURN asks for the time");
        let elapsed = elapsed.add(&mut self.graph, &missed);
        let elapsed = elapsed.clamp(&mut self.graph, i32::MIN, i32::MAX);
        let missed = self.choose(on, &elapsed, &Number::constant(0));
        self.put_word(missed_ms, missed);
        self.elapsed_ms = Some(elapsed);
        self.guard = self.graph.and(self.guard, !on);
    }

    fn rises(&mut self, history: u32, on: Literal) -> Literal {
        let before = self.bit(history);
        self.put_bit(history, on);
        self.graph.and(on, !before)
    }

    /// Stops a block.
    pub(super) fn halt(&mut self, id: BlockId) {
        let runs = self.running(id);
        self.put_own_if(runs, Held::PassDue(id), Literal::TRUE);
        self.put_running(id, Literal::FALSE);
    }

    /// Starts a Program, unless it runs.
    fn start_program(&mut self, id: BlockId) {
        let runs = self.running(id);
        self.under(!runs, |scan| scan.mark_started(id));
    }

    pub(super) fn mark_started(&mut self, id: BlockId) {
        self.put_running(id, Literal::TRUE);
        self.put_bit(self.code.layout.bit(Bit::Done(id)).0, Literal::FALSE);
        self.put_own_if(Literal::TRUE, Held::FirstTurn(id), Literal::TRUE);
    }

    fn enable_once(&mut self, task: BlockId) {
        let runs = self.running(task);
        self.under(!runs, |scan| {
            scan.put_own_if(Literal::TRUE, Held::Recurrent(task), Literal::FALSE);
            scan.mark_started(task);
        });
    }

    fn enable_every(&mut self, task: BlockId, every: u32, pick: Option<u32>) {
        if let Some(pick) = pick {
            self.picked(pick);
        }
        let every = self.word(every).clamp(&mut self.graph, 0, i32::MAX);
        self.put_own_number(OwnNumber::Interval(task), &every, i32::MAX.into());
        self.put_own_if(Literal::TRUE, Held::Recurrent(task), Literal::TRUE);
        self.mark_started(task);
    }

    /// Turns a Stage's bit ON or OFF.
    pub(super) fn switch_stage(&mut self, stage: StageId, on: Literal) {
        self.put_bit(self.code.layout.bit(Bit::Stage(stage)).0, on);
    }

    /// Turns a Stage OFF and marks its pass as due.
    fn leave_stage(&mut self, stage: StageId) {
        let on = self.stage_on(stage);
        self.put_own_if(on, Held::StagePassDue(stage), Literal::TRUE);
        self.switch_stage(stage, Literal::FALSE);
    }

    fn stage_on(&mut self, stage: StageId) -> Literal {
        self.bit(self.code.layout.bit(Bit::Stage(stage)).0)
    }

    fn listed(&self, list: StageList) -> &[StageId] {
        &self.code.tables.stage_lists[list.places()]
    }

    fn jump(&mut self, targets: StageList, element: ElementId) {
        let Some(from) = element.stage else { return };
        self.put_own_if(Literal::TRUE, Held::StagePassDue(from), Literal::TRUE);
        let targets = self.listed(targets).to_vec();
        self.switch_stage(from, Literal::constant(targets.contains(&from)));
        for target in targets {
            self.switch_stage(target, Literal::TRUE);
        }
    }

    fn converge(&mut self, from: StageList, to: StageId) {
        let from = self.listed(from).to_vec();
        let mut all = Literal::TRUE;
        for stage in &from {
            let on = self.stage_on(*stage);
            all = self.graph.and(all, on);
        }
        self.under(all, |scan| {
            from.iter().for_each(|stage| scan.leave_stage(*stage));
            scan.switch_stage(to, Literal::TRUE);
        });
    }
}
