//! Executes the turns of Programs, Tasks and Stages, the subroutines that they call, and the
//! instructions that start and stop them.
//!
//! Called by `scan`; `machine` has the states. Behaviour: `docs/semantics.md`, section 4. A stop
//! only *marks* an element: the termination pass runs at the element's next turn, which may still
//! come in the same scan. So every turn begins with the pass, if one is due.

use std::ops::Range;

use super::control::{AfterControl, ControlKind, RestartState, StageList};
use super::events::{BlockEvent, Element, MathEvent};
use super::eye::{ScanObserver, ScanStep};
use super::machine::Machine;
use super::math::Maths;
use super::ops::OpKind;
use super::program::{BlockRole, EngineProgram};
use super::reach::Reach;
use crate::isa::{Bit, BlockId, ElementId, StageId};

impl Machine {
    /// A block's turn in the scan: its pass if one is due, then its execution if it runs.
    pub fn turn<R: Reach>(&mut self, id: BlockId, eye: &mut impl ScanObserver) {
        eye.before(ScanStep::Turn(id), &self.memory.image);
        if std::mem::take(&mut self.state(id).pass_due) {
            self.pass_block::<R>(id, eye);
        }
        if self.is_running(id) {
            match self.program.block(id).role {
                BlockRole::Program { .. } => self.turn_program::<R>(id, eye),
                BlockRole::TopOfScan | BlockRole::BottomOfScan => {
                    self.execute_own::<R>(id, eye);
                }
                BlockRole::Task => self.turn_task::<R>(id, eye),
                BlockRole::FirstScan | BlockRole::LastScan => self.run_once::<R>(id, eye),
                BlockRole::Subroutine => unreachable!("a subroutine has no turn"),
            }
        }
        eye.after(ScanStep::Turn(id), &self.memory.image);
    }

    fn turn_program<R: Reach>(&mut self, id: BlockId, eye: &mut impl ScanObserver) {
        if std::mem::take(&mut self.state(id).first_turn) {
            self.enter_initial_stage(id);
        }
        if !self.execute_own::<R>(id, eye) {
            return;
        }
        for stage in self.program.stages_of(id) {
            if std::mem::take(&mut self.stage_state(stage).pass_due) {
                self.pass_stage::<R>(stage, eye);
            }
            if self.bit_of(Bit::Stage(stage)) && !self.execute_stage::<R>(id, stage, eye) {
                return;
            }
        }
    }

    fn enter_initial_stage(&mut self, id: BlockId) {
        for (at, stage) in self.program.stages_of(id).enumerate() {
            self.switch_stage(stage, at == 0);
        }
    }

    fn turn_task<R: Reach>(&mut self, id: BlockId, eye: &mut impl ScanObserver) {
        if !self.state(id).recurrent {
            return self.run_once::<R>(id, eye);
        }
        let now_ns = self.now_ns;
        let state = self.state(id);
        if std::mem::take(&mut state.first_turn) {
            state.enabled_ns = now_ns;
            state.intervals = 0;
        } else if let Some(intervals) =
            now_ns.saturating_sub(state.enabled_ns).checked_div(state.every_ns)
        {
            if intervals == state.intervals {
                return;
            }
            state.intervals = intervals;
        }
        self.execute_own::<R>(id, eye);
    }

    /// Executes a run-once Task. Afterwards the Task is done and its pass is due, unless it halted
    /// itself.
    fn run_once<R: Reach>(&mut self, id: BlockId, eye: &mut impl ScanObserver) {
        if !self.execute_own::<R>(id, eye) {
            return;
        }
        self.put_bit(Bit::Running(id), false);
        self.put_bit(Bit::Done(id), true);
        self.state(id).pass_due = true;
        self.events.push(BlockEvent::Completed(id));
    }

    /// Executes a block's own rungs; returns `false` if an instruction ended the block's execution.
    #[inline(always)]
    fn execute_own<R: Reach>(&mut self, id: BlockId, eye: &mut impl ScanObserver) -> bool {
        let code = &self.program.blocks[id.0 as usize].own;
        let state = &mut self.blocks[id.0 as usize];
        state.executed |= code.has_rungs;
        self.memory.elapsed_ms = elapsed_ms(&mut state.executed_ms, self.now_ns);
        let batches = code.batches.clone();
        self.execute::<R>(batches, ElementId { block: id, stage: None }, eye)
    }

    fn execute_stage<R: Reach>(
        &mut self,
        block: BlockId,
        stage: StageId,
        eye: &mut impl ScanObserver,
    ) -> bool {
        let code = &self.program.stages[stage.0 as usize];
        let state = &mut self.stages[stage.0 as usize];
        state.executed |= code.has_rungs;
        self.memory.elapsed_ms = elapsed_ms(&mut state.executed_ms, self.now_ns);
        let batches = code.batches.clone();
        self.execute::<R>(batches, ElementId { block, stage: Some(stage) }, eye)
    }

    /// Executes an element; returns `false` if an instruction ended the block's execution.
    #[inline(always)]
    fn execute<R: Reach>(
        &mut self,
        batches: Range<u32>,
        element: ElementId,
        eye: &mut impl ScanObserver,
    ) -> bool {
        let seen = ScanStep::Element(Element::from(element));
        eye.before(seen, &self.memory.image);
        // Many Programs have no rungs outside of their Stages.
        let goes_on = batches.is_empty() || self.execute_all::<R>(batches, element, eye);
        eye.after(seen, &self.memory.image);
        goes_on
    }

    /// Executes an element's batches; returns `false` if an instruction ended the block's
    /// execution.
    #[inline(never)]
    fn execute_all<R: Reach>(
        &mut self,
        batches: Range<u32>,
        element: ElementId,
        eye: &mut impl ScanObserver,
    ) -> bool {
        let mut maths_told = self.events.maths().len();
        let mut at = eye.next(batches.clone());
        while at < batches.end {
            eye.before(ScanStep::Batch(at), &self.memory.image);
            let batch = self.program.tables.batches[at as usize];
            let places = batch.first as usize..batch.first as usize + batch.count as usize;
            if batch.kind < OpKind::Math {
                let view = self.memory.view::<R>();
                self.program.tables.ops.run::<R>(batch.kind, places, view);
            } else if batch.kind < OpKind::Control {
                let in_columns = batch.kind == OpKind::Columns;
                self.calculate::<R>(places, in_columns, maths_told);
            } else {
                let after = self.control_all(places, element);
                if after != AfterControl::Continue
                    && let Some(continues) = self.follow::<R>(after, element, eye)
                {
                    eye.after(ScanStep::Batch(at), &self.memory.image);
                    return continues;
                }
                maths_told = self.events.maths().len();
            }
            eye.after(ScanStep::Batch(at), &self.memory.image);
            at = eye.next(at + 1..batches.end);
        }
        true
    }

    /// Executes a subroutine, or ends an execution: `Some` with whether the block's continues.
    #[cold]
    fn follow<R: Reach>(
        &mut self,
        after: AfterControl,
        element: ElementId,
        eye: &mut impl ScanObserver,
    ) -> Option<bool> {
        match after {
            AfterControl::Continue => None,
            AfterControl::Return => Some(true),
            AfterControl::EndBlock => Some(false),
            AfterControl::Call(subroutine) => {
                let continues = self.call::<R>(subroutine, element, eye);
                (!continues).then_some(false)
            }
        }
    }

    /// Executes a subroutine in the turn of an element; returns `false` if an instruction ended the
    /// block's execution. Until its pass, its `.Running`, which no ladder can name, is ON: a reload
    /// reports it. Behaviour: `docs/semantics.md`, *Subroutines*.
    fn call<R: Reach>(
        &mut self,
        subroutine: u32,
        element: ElementId,
        eye: &mut impl ScanObserver,
    ) -> bool {
        let id = self.program.subroutines[subroutine as usize];
        self.callers[subroutine as usize] = Some(Element::from(element));
        self.put_bit(Bit::Running(id), self.program.block(id).own.has_rungs);
        let code = &self.program.blocks[id.0 as usize].own;
        let state = &mut self.blocks[id.0 as usize];
        state.executed |= code.has_rungs;
        let elapsed_before = self.memory.elapsed_ms;
        self.memory.elapsed_ms = elapsed_ms(&mut state.executed_ms, self.now_ns);
        let (batches, seen) = (code.batches.clone(), ScanStep::Element(Element::Block(id)));
        eye.before(seen, &self.memory.image);
        let continues = self.execute_all::<R>(batches, element, eye);
        eye.after(seen, &self.memory.image);
        self.memory.elapsed_ms = elapsed_before;
        continues
    }

    /// Executes a batch of control instructions, up to one after which something else follows than
    /// the next operation.
    #[inline(always)]
    fn control_all(&mut self, at: Range<usize>, element: ElementId) -> AfterControl {
        for at in at {
            let control = &self.program.tables.ops.control[at];
            let on = self.memory.image.power(control.leg);
            // Few of a scan's control instructions have something to do.
            if on || control.kind.acts_while_off() {
                let after = self.control(at, on, element);
                if after != AfterControl::Continue {
                    return after;
                }
            }
        }
        AfterControl::Continue
    }

    /// Executes a batch of MATHs. Their mishaps are inserted in the order of their rungs, behind
    /// the first `told` events.
    fn calculate<R: Reach>(&mut self, at: Range<usize>, in_columns: bool, told: usize) {
        let Machine { program: EngineProgram { tables, .. }, memory, calculator, events, .. } =
            self;
        let maths = Maths { maths: &tables.ops.math[at], steps: &tables.steps };
        let report = |math, mishaps| events.insert_math(MathEvent { math, mishaps }, told);
        if in_columns {
            calculator.run_columns::<R>(maths, memory.view::<R>(), report);
        } else {
            calculator.run::<R>(maths, memory.view::<R>(), report);
        }
    }

    /// Executes a control instruction that acts with this power of its rung, in the turn of an
    /// element.
    #[inline(never)]
    fn control(&mut self, at: usize, on: bool, element: ElementId) -> AfterControl {
        match self.program.tables.ops.control[at].kind {
            ControlKind::Restart(restart) => return self.restart(restart, on, element),
            ControlKind::EnableOnce { task, history } => self.enable_once(task, history, on),
            ControlKind::EnableEvery { task, every, pick } => {
                if let Some(pick) = pick.filter(|_| on && !self.is_running(task)) {
                    self.pick(pick);
                }
                self.enable_every(task, every, on);
            }
            ControlKind::Run(program) => self.start_program(program),
            ControlKind::Halt(block) => {
                self.halt(block);
                return AfterControl::end_block_if(block == element.block);
            }
            ControlKind::Exit => {
                self.halt(element.block);
                return AfterControl::EndBlock;
            }
            ControlKind::StageOn(stage) => self.switch_stage(stage, true),
            ControlKind::StageOff(stage) => self.leave_stage(stage),
            ControlKind::Stop => self.stop_requested = true,
            ControlKind::Jump(targets) => self.jump(targets, element),
            ControlKind::Converge { from, to } => self.converge(from, to),
            ControlKind::Call(subroutine) => return AfterControl::Call(subroutine),
            ControlKind::Return => return AfterControl::Return,
            ControlKind::KeepTime { missed_ms } => {
                let elapsed_ms = self.memory.elapsed_ms;
                let missed_ms = &mut self.memory.image.words[missed_ms as usize];
                *missed_ms = missed_ms.saturating_add(elapsed_ms);
            }
            ControlKind::GiveTime { missed_ms } => {
                let missed_ms = &mut self.memory.image.words[missed_ms as usize];
                self.memory.elapsed_ms = std::mem::take(missed_ms);
            }
        }
        AfterControl::Continue
    }

    fn restart(&mut self, restart: RestartState, on: bool, element: ElementId) -> AfterControl {
        if !self.rises(restart.history, on) {
            return AfterControl::Continue;
        }
        self.halt(restart.program);
        self.start_program(restart.program);
        AfterControl::end_block_if(restart.program == element.block)
    }

    fn enable_once(&mut self, task: BlockId, history: u32, on: bool) {
        if self.rises(history, on) && !self.is_running(task) {
            self.state(task).recurrent = false;
            self.mark_started(task);
        }
    }

    fn enable_every(&mut self, task: BlockId, every: u32, on: bool) {
        match (on, self.is_running(task)) {
            (true, false) => {
                let every_ms = self.memory.image.words[every as usize].max(0);
                let state = self.state(task);
                state.recurrent = true;
                state.every_ns = u64::from(every_ms.unsigned_abs()) * 1_000_000;
                self.mark_started(task);
            }
            (false, true) => self.halt(task),
            _ => {}
        }
    }

    fn rises(&mut self, history: u32, on: bool) -> bool {
        let history = &mut self.memory.image.bits[history as usize];
        std::mem::replace(history, u8::from(on)) == 0 && on
    }

    /// JMP, SGDIVRG: turns the Stage of the instruction OFF, marks its pass as due, and turns the
    /// targets ON.
    fn jump(&mut self, targets: StageList, element: ElementId) {
        let Some(from) = element.stage else { return };
        self.stage_state(from).pass_due = true;
        let stays = self.program.tables.stage_lists[targets.places()].contains(&from);
        self.switch_stage(from, stays);
        for at in targets.places() {
            self.switch_stage(self.program.tables.stage_lists[at], true);
        }
    }

    /// SGCONVRG: if all Stages of `from` are ON, turns them OFF and the target ON.
    fn converge(&mut self, from: StageList, to: StageId) {
        let stages = &self.program.tables.stage_lists[from.places()];
        if !stages.iter().all(|stage| self.bit_of(Bit::Stage(*stage))) {
            return;
        }
        for at in from.places() {
            self.leave_stage(self.program.tables.stage_lists[at]);
        }
        self.switch_stage(to, true);
    }
}

/// Whole ms from an element's last execution to this one. Stores this execution's timestamp.
fn elapsed_ms(executed_ms: &mut u64, now_ns: u64) -> i32 {
    let now_ms = now_ns / 1_000_000;
    let elapsed = now_ms.saturating_sub(std::mem::replace(executed_ms, now_ms));
    i32::try_from(elapsed).unwrap_or(i32::MAX)
}
