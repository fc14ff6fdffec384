//! Executes the turns of Programs, Tasks and Stages, and the instructions that start and stop them.
//!
//! Called by `scan`. Behaviour: `docs/semantics.md`, section 4. A stop only *marks* an element: the
//! termination pass runs at the element's next turn, which may still come in the same scan. So
//! every turn begins with the pass, if one is due.

use std::ops::Range;

use super::control::{ControlKind, RestartState, StageList};
use super::events::{BlockEvent, Element, Events, MathEvent};
use super::eye::{Deed, Eye};
use super::image::BitCell;
use super::math::{Calculator, Maths};
use super::memory::Memory;
use super::ops::OpKind;
use super::program::{BlockRole, Program};
use super::reach::{Far, Reach};
use crate::isa::{Bit, BlockId, ElementId, StageId};

/// The state of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct BlockState {
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
pub(super) struct StageState {
    /// It was left or turned OFF since its last turn: its pass is due.
    pub pass_due: bool,
    /// It executed since its last pass.
    pub executed: bool,
    /// Timestamp of its last execution, whole ms.
    pub executed_ms: u64,
}

impl BlockState {
    /// Starts the time of its own rungs at `now_ms`, unless they executed since their last pass.
    pub fn count_from(&mut self, now_ms: u64) {
        if !self.executed {
            self.executed_ms = now_ms;
        }
    }

    /// Changes the interval of a recurrently enabled Task. Multiples of the new interval count from
    /// the same first execution.
    pub fn change_interval(&mut self, every_ms: i32, now_ns: u64) {
        if self.recurrent {
            self.every_ns = u64::from(every_ms.max(0).unsigned_abs()) * 1_000_000;
            let since_ns = now_ns.saturating_sub(self.enabled_ns);
            self.intervals = since_ns.checked_div(self.every_ns).unwrap_or(0);
        }
    }
}

impl StageState {
    /// Does the same as [`BlockState::count_from`], for a Stage.
    pub fn count_from(&mut self, now_ms: u64) {
        if !self.executed {
            self.executed_ms = now_ms;
        }
    }
}

/// A program, its memory and the state of its blocks.
#[derive(Debug)]
pub(super) struct Machine {
    pub program: Program,
    pub memory: Memory,
    pub calculator: Calculator,
    pub blocks: Box<[BlockState]>,
    pub stages: Box<[StageState]>,
    pub events: Events,
    pub now_ns: u64,
    pub stop_requested: bool,
}

impl Machine {
    #[inline(always)]
    pub fn bit_of(&self, bit: Bit) -> bool {
        self.memory.image.bit(self.program.layout.bit(bit))
    }

    /// Writes the bit of a block or Stage; these bits cannot be forced.
    pub fn put_bit(&mut self, bit: Bit, on: bool) {
        let BitCell(cell) = self.program.layout.bit(bit);
        self.memory.image.bits[cell as usize] = u8::from(on);
    }

    pub fn is_running(&self, id: BlockId) -> bool {
        self.bit_of(Bit::Running(id))
    }

    fn state(&mut self, id: BlockId) -> &mut BlockState {
        &mut self.blocks[id.0 as usize]
    }

    fn stage_state(&mut self, id: StageId) -> &mut StageState {
        &mut self.stages[id.0 as usize]
    }

    /// A block's turn in the scan: its pass if one is due, then its execution if it runs.
    pub fn turn<R: Reach>(&mut self, id: BlockId, eye: &mut impl Eye) {
        eye.before(Deed::Turn(id), &self.memory.image);
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
            }
        }
        eye.after(Deed::Turn(id), &self.memory.image);
    }

    fn turn_program<R: Reach>(&mut self, id: BlockId, eye: &mut impl Eye) {
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

    fn turn_task<R: Reach>(&mut self, id: BlockId, eye: &mut impl Eye) {
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
    fn run_once<R: Reach>(&mut self, id: BlockId, eye: &mut impl Eye) {
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
    fn execute_own<R: Reach>(&mut self, id: BlockId, eye: &mut impl Eye) -> bool {
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
        eye: &mut impl Eye,
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
        eye: &mut impl Eye,
    ) -> bool {
        let seen =
            Deed::Element(element.stage.map_or(Element::Block(element.block), Element::Stage));
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
        eye: &mut impl Eye,
    ) -> bool {
        let mut maths_told = self.events.maths().len();
        let mut at = eye.next(batches.clone());
        while at < batches.end {
            eye.before(Deed::Batch(at), &self.memory.image);
            let batch = self.program.tables.batches[at as usize];
            let places = batch.first as usize..batch.first as usize + batch.count as usize;
            if batch.kind < OpKind::Math {
                let view = self.memory.view::<R>();
                self.program.tables.ops.run::<R>(batch.kind, places, view);
            } else if batch.kind < OpKind::Control {
                let in_columns = batch.kind == OpKind::Columns;
                self.calculate::<R>(places, in_columns, maths_told);
            } else {
                let goes_on = self.control_all(places, element);
                maths_told = self.events.maths().len();
                if !goes_on {
                    eye.after(Deed::Batch(at), &self.memory.image);
                    return false;
                }
            }
            eye.after(Deed::Batch(at), &self.memory.image);
            at = eye.next(at + 1..batches.end);
        }
        true
    }

    /// Executes a batch of control instructions; returns `false` if an instruction ended the
    /// block's execution.
    #[inline(always)]
    fn control_all(&mut self, at: Range<usize>, element: ElementId) -> bool {
        for at in at {
            let control = &self.program.tables.ops.control[at];
            let on = self.memory.image.power(control.leg);
            // Few of a scan's control instructions have something to do.
            if (on || control.kind.acts_while_off()) && !self.control(at, on, element) {
                return false;
            }
        }
        true
    }

    /// Executes a batch of MATHs. Their mishaps are inserted in the order of their rungs, behind
    /// the first `told` events.
    fn calculate<R: Reach>(&mut self, at: Range<usize>, in_columns: bool, told: usize) {
        let Machine { program: Program { tables, .. }, memory, calculator, events, .. } = self;
        let maths = Maths { maths: &tables.ops.math[at], steps: &tables.steps };
        let report = |math, mishaps| events.insert_math(MathEvent { math, mishaps }, told);
        if in_columns {
            calculator.run_columns::<R>(maths, memory.view::<R>(), report);
        } else {
            calculator.run::<R>(maths, memory.view::<R>(), report);
        }
    }

    /// Reads an element of an array outside of the batches, for a pass or an ENTASK. Writes only
    /// private words and status bits, which are never forced.
    pub fn pick(&mut self, pick: u32) {
        let Machine { program: Program { tables, .. }, memory, calculator, events, .. } = self;
        let pick = pick as usize;
        let maths = Maths { maths: &tables.picks[pick..=pick], steps: &tables.steps };
        calculator.run::<Far>(maths, memory.view::<Far>(), |math, mishaps| {
            events.push_math(MathEvent { math, mishaps });
        });
    }

    /// Executes a control instruction that acts with this power of its rung; returns `false` if it
    /// ended its block's execution.
    #[inline(never)]
    fn control(&mut self, at: usize, on: bool, element: ElementId) -> bool {
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
                return block != element.block;
            }
            ControlKind::Exit => {
                self.halt(element.block);
                return false;
            }
            ControlKind::StageOn(stage) => self.switch_stage(stage, true),
            ControlKind::StageOff(stage) => self.leave_stage(stage),
            ControlKind::Stop => self.stop_requested = true,
            ControlKind::Jump(targets) => self.jump(targets, element),
            ControlKind::Converge { from, to } => self.converge(from, to),
        }
        true
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

    pub fn start_program(&mut self, id: BlockId) {
        if !self.is_running(id) {
            self.mark_started(id);
        }
    }

    pub fn mark_started(&mut self, id: BlockId) {
        self.put_bit(Bit::Running(id), true);
        self.put_bit(Bit::Done(id), false);
        self.state(id).first_turn = true;
        self.events.push(BlockEvent::Started(id));
    }

    fn restart(&mut self, restart: RestartState, on: bool, element: ElementId) -> bool {
        if !self.rises(restart.history, on) {
            return true;
        }
        self.halt(restart.program);
        self.start_program(restart.program);
        restart.program != element.block
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

    /// Turns a Stage's bit ON or OFF. Does not mark its pass as due.
    #[inline(always)]
    pub fn switch_stage(&mut self, stage: StageId, on: bool) {
        if self.bit_of(Bit::Stage(stage)) != on {
            self.put_bit(Bit::Stage(stage), on);
            let event = if on { BlockEvent::StageOn(stage) } else { BlockEvent::StageOff(stage) };
            self.events.push(event);
        }
    }

    fn leave_stage(&mut self, stage: StageId) {
        if self.bit_of(Bit::Stage(stage)) {
            self.switch_stage(stage, false);
            self.stage_state(stage).pass_due = true;
        }
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

    /// Records the event that a pass ran.
    pub fn terminated(&mut self, element: Element) {
        self.events.push(BlockEvent::Terminated(element));
    }
}

/// Whole ms from an element's last execution to this one. Stores this execution's timestamp.
fn elapsed_ms(executed_ms: &mut u64, now_ns: u64) -> i32 {
    let now_ms = now_ns / 1_000_000;
    let elapsed = now_ms.saturating_sub(std::mem::replace(executed_ms, now_ms));
    i32::try_from(elapsed).unwrap_or(i32::MAX)
}
