//! The turns of blocks and Stages, and the subroutines that they call, as in the engine's `blocks`.

use super::encoder::Encoder;
use super::held::OwnNumber;
use super::number::Number;
use crate::aig::Literal;
use crate::events::ScanEvent;
use crate::gates::Held;
use rungd_engine::isa::{Bit, BlockId, ElementId, StageId};
use rungd_engine::ops::{Control, ControlKind, Op, OpKind};
use rungd_engine::{Batch, BlockRole, Element, ElementCode};

impl Encoder<'_> {
    /// Begins the last scan if a stop was requested: `LastScan` starts. Returns whether it is the
    /// last scan.
    pub(super) fn begin_last_scan(&mut self) -> Literal {
        let last = self.last_scan();
        self.stop_requested = last;
        if self.written.stops {
            let stopped = self.scan_latch(false, Held::Stopped);
            self.constrain(!stopped);
        }
        last
    }

    /// What the next scan knows of a stop.
    pub(super) fn end_last_scan(&mut self) {
        if self.written.stops {
            let (last, continues) = (self.last_scan(), self.any_event(ScanEvent::continues));
            let next = self.scan_latch(false, Held::LastScan);
            let stopped = self.scan_latch(false, Held::Stopped);
            let requested = self.graph.and(self.stop_requested, !continues);
            self.set_next(next, requested);
            let ends = self.graph.and(last, !continues);
            self.set_next(stopped, ends);
        }
    }

    /// Steps 4 to 7: all turns.
    pub(super) fn turns(&mut self, last: Literal) {
        let code = self.code;
        for id in &code.order {
            if code.blocks[id.0 as usize].role == BlockRole::LastScan {
                self.under(last, |scan| scan.mark_started(*id));
            }
        }
        for id in &code.order {
            self.turn(*id);
        }
    }

    fn turn(&mut self, id: BlockId) {
        let due = self.take_own(Held::PassDue(id));
        self.under(due, |scan| scan.pass_block(id));
        let runs = self.running(id);
        self.under(runs, |scan| match scan.code.blocks[id.0 as usize].role {
            BlockRole::Program { .. } => scan.turn_program(id),
            BlockRole::TopOfScan | BlockRole::BottomOfScan => {
                scan.execute_own(id);
            }
            BlockRole::Task => scan.turn_task(id),
            BlockRole::FirstScan | BlockRole::LastScan => scan.run_once(id),
            BlockRole::Subroutine => unreachable!("a subroutine has no turn"),
        });
    }

    fn turn_program(&mut self, id: BlockId) {
        let stages = self.stages_of(id);
        if !stages.is_empty() {
            let first = self.take_own(Held::FirstTurn(id));
            self.under(first, |scan| {
                for (at, stage) in stages.iter().enumerate() {
                    scan.switch_stage(*stage, Literal::constant(at == 0));
                }
            });
        }
        let mut ended = self.execute_own(id);
        for stage in stages {
            ended = self.under(!ended, |scan| {
                let due = scan.take_own(Held::StagePassDue(stage));
                scan.under(due, |scan| scan.pass_stage(stage));
                let on = scan.bit(scan.code.layout.bit(Bit::Stage(stage)).0);
                let ends = scan.under(on, |scan| scan.execute_stage(id, stage));
                scan.graph.or(ended, ends)
            });
        }
    }

    fn turn_task(&mut self, id: BlockId) {
        let always = self.written.recurrent.contains_key(&id) && !self.written.once.contains(&id);
        let recurrent = if always { Literal::TRUE } else { self.own(Held::Recurrent(id)) };
        self.under(!recurrent, |scan| scan.run_once(id));
        self.under(recurrent, |scan| scan.turn_recurrent(id));
    }

    /// The turn of a Task that is enabled recurrently. The phase is the time since the beginning of
    /// the current interval, ms.
    fn turn_recurrent(&mut self, id: BlockId) {
        if self.guard == Literal::FALSE {
            return;
        }
        let fixed = self.written.interval(id).map(i128::from);
        let high = fixed.unwrap_or(i32::MAX.into());
        let first = self.take_own(Held::FirstTurn(id));
        let every = match fixed {
            Some(every) => Number::constant(every),
            None => self.own_number(OwnNumber::Interval(id), high),
        };
        let phase = self.own_number(OwnNumber::Phase(id), high);
        let period = Number::constant(self.model.period_ms().into());
        let passed = match self.late {
            None => period.clone(),
            Some(_) => self.since().mul(&mut self.graph, &period),
        };
        let later = phase.add(&mut self.graph, &passed);
        let passes = !later.less(&mut self.graph, &every);
        let rest = match self.late {
            None => later.sub(&mut self.graph, &every).within(0, high),
            Some(_) => self.modulo(&later, &every, self.model.late_max).within(0, high),
        };
        let graph = &mut self.graph;
        let later = Number::mux(graph, passes, &rest, &later).within(0, high);
        // An interval of at most one period passes in every scan; then the phase does not matter.
        let is_short = !period.less(graph, &every);
        let starts_anew = graph.or(first, is_short);
        let later = Number::mux(graph, starts_anew, &Number::constant(0), &later);
        let passes = graph.or(passes, starts_anew);
        self.put_own_number(OwnNumber::Phase(id), &later, high);
        self.under(passes, |scan| scan.execute_own(id));
    }

    fn run_once(&mut self, id: BlockId) {
        if self.guard == Literal::FALSE {
            return;
        }
        let ended = self.execute_own(id);
        self.under(!ended, |scan| {
            scan.put_running(id, Literal::FALSE);
            scan.put_bit(scan.code.layout.bit(Bit::Done(id)).0, Literal::TRUE);
            scan.put_own_if(Literal::TRUE, Held::PassDue(id), Literal::TRUE);
        });
    }

    /// Executes a block's own rungs; returns when an instruction ends the block's execution.
    fn execute_own(&mut self, id: BlockId) -> Literal {
        let code = &self.code.blocks[id.0 as usize].own;
        self.execute(ElementId { block: id, stage: None }, code, Held::Executed(id))
    }

    fn execute_stage(&mut self, block: BlockId, stage: StageId) -> Literal {
        let code = &self.code.stages[stage.0 as usize];
        let element = ElementId { block, stage: Some(stage) };
        self.execute(element, code, Held::StageExecuted(stage))
    }

    /// Executes an element in its own turn.
    fn execute(&mut self, element: ElementId, code: &ElementCode, executed: Held) -> Literal {
        if self.guard == Literal::FALSE {
            return Literal::FALSE;
        }
        if code.has_rungs {
            self.put_own_if(Literal::TRUE, executed, Literal::TRUE);
        }
        self.elapsed = self.time_of(element, code);
        self.execute_all(code, element)
    }

    /// Executes an element's batches in the turn of an element.
    fn execute_all(&mut self, code: &ElementCode, element: ElementId) -> Literal {
        let (execution, guard) = (self.next_execution(), self.guard);
        let mut ended = Literal::FALSE;
        for at in code.batches.clone() {
            self.batches.push(at);
            let batch = self.code.tables.batches[at as usize];
            let ends = self.batch(batch, element);
            ended = self.graph.or(ended, ends);
            self.batches.pop();
        }
        self.guard = guard;
        self.execution = execution;
        ended
    }

    /// Executes a batch; narrows the guard to what follows it. Returns when the block's execution
    /// ends.
    fn batch(&mut self, batch: Batch, element: ElementId) -> Literal {
        if batch.kind == OpKind::Control {
            return self.controls(batch, element);
        }
        if batch.kind == OpKind::Math || batch.kind == OpKind::Columns {
            self.maths(batch);
        } else {
            self.code.tables.ops_of(batch).for_each(|op| self.op(&op));
        }
        Literal::FALSE
    }

    /// Executes a subroutine in the turn of an element; returns when the block's execution ends.
    pub(super) fn call(&mut self, subroutine: u32, element: ElementId) -> Literal {
        if self.guard == Literal::FALSE {
            return Literal::FALSE;
        }
        let id = self.code.subroutines[subroutine as usize];
        let code = &self.code.blocks[id.0 as usize].own;
        self.put_caller(subroutine, Element::from(element));
        self.put_running(id, Literal::constant(code.has_rungs));
        if code.has_rungs {
            self.put_own_if(Literal::TRUE, Held::Executed(id), Literal::TRUE);
        }
        let own = ElementId { block: id, stage: None };
        let elapsed = self.time_of(own, code);
        let before = std::mem::replace(&mut self.elapsed, elapsed);
        let ended = self.execute_all(code, element);
        self.elapsed = before;
        ended
    }

    /// The elements that may call a subroutine: those with a state.
    fn put_caller(&mut self, subroutine: u32, element: Element) {
        let caller = Held::Caller(subroutine, element);
        let others: Vec<Held> = (self.callers.get(&subroutine).into_iter().flatten())
            .map(|other| Held::Caller(subroutine, *other))
            .collect();
        for other in others {
            let is_caller = Literal::constant(other == caller);
            self.put_own_if(Literal::TRUE, other, is_caller);
        }
    }

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
                if restart.program == element.block {
                    return self.ends(rises);
                }
            }
            ControlKind::EnableOnce { task, history } => {
                let rises = self.rises(history, on);
                self.under(rises, |scan| scan.enable_once(task));
            }
            ControlKind::EnableEvery { task, every, pick } => {
                let runs = self.running(task);
                let enables = self.graph.and(on, !runs);
                self.under(enables, |scan| scan.enable_every(task, every, pick));
                self.under(!on, |scan| scan.halt(task));
            }
            ControlKind::Run(program) => self.under(on, |scan| scan.start_program(program)),
            ControlKind::Halt(block) => {
                self.under(on, |scan| scan.halt(block));
                if block == element.block {
                    return self.ends(on);
                }
            }
            ControlKind::Exit => {
                self.under(on, |scan| scan.halt(element.block));
                return self.ends(on);
            }
            ControlKind::StageOn(stage) => {
                self.under(on, |scan| scan.switch_stage(stage, Literal::TRUE))
            }
            ControlKind::StageOff(stage) => self.under(on, |scan| scan.leave_stage(stage)),
            ControlKind::Stop => {
                let stops = self.graph.and(self.guard, on);
                self.stop_requested = self.graph.or(self.stop_requested, stops);
            }
            ControlKind::Jump(targets) => self.under(on, |scan| scan.jump(targets, element)),
            ControlKind::Converge { from, to } => self.under(on, |scan| scan.converge(from, to)),
            ControlKind::Call(subroutine) => {
                let ended = self.under(on, |scan| scan.call(subroutine, element));
                return self.ends(ended);
            }
            // It ends the subroutine's execution, not that of the block.
            ControlKind::Return => self.guard = self.graph.and(self.guard, !on),
            ControlKind::KeepTime { missed_ms } => self.keep_time(missed_ms),
            ControlKind::GiveTime { missed_ms } => self.give_time(missed_ms),
        }
        Literal::FALSE
    }

    /// Narrows the guard to what follows an end of the execution; returns when it ends.
    fn ends(&mut self, condition: Literal) -> Literal {
        let ends = self.graph.and(self.guard, condition);
        self.guard = self.graph.and(self.guard, !condition);
        ends
    }
}
