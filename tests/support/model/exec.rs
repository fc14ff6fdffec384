//! The scan: the order of execution, the turns of blocks and Stages, termination passes, the stop.

use super::counters::CounterState;
use super::place::{Area, Loc, Member, Memory};
use super::program::{Block, Contact, Instr, Kind, Program, Rung};
use super::timers::TimerState;
use std::collections::BTreeMap;

/// The state of a block's own rungs or of a Stage for the termination pass.
#[derive(Clone, Default)]
struct ElementState {
    /// Whether at least one rung has executed since the last pass.
    executed: bool,
    /// Whether the Stage was left or turned OFF: it terminates at its next turn.
    due: bool,
}

#[derive(Clone, Default)]
struct BlockState {
    /// Whether the block was stopped: it terminates at its next turn.
    due: bool,
    /// Whether the Program was started and has not had a turn since.
    fresh: bool,
    elements: Vec<ElementState>,
    /// The block and element in whose turn a subroutine was executed last.
    caller: Option<(usize, usize)>,
    /// The interval of a recurrent Task; `None` for a run-once Task.
    interval: Option<i64>,
    /// The timestamp of a recurrent Task's first execution, and of the next one due.
    schedule: Option<(i64, i64)>,
}

pub struct Sim<'a> {
    pub program: &'a Program,
    pub memory: Memory,
    pub now: i64,
    /// Year, month, day, weekday, hour, minute, second.
    pub local: [i64; 10],
    pub counters: BTreeMap<usize, CounterState>,
    pub timers: BTreeMap<usize, TimerState>,
    histories: Vec<bool>,
    blocks: Vec<BlockState>,
    /// Whether STOP was executed: the next scan is the last.
    pub stop_asked: bool,
    /// The block that is executing, and whether it has ended itself.
    current: usize,
    ended: bool,
    /// Whether the subroutine that is executing has returned.
    pub returned: bool,
    /// Whether contacts are computed, which touch no status bit.
    pub quiet: bool,
}

impl<'a> Sim<'a> {
    pub fn new(program: &'a Program) -> Sim<'a> {
        let mut memory = Memory::default();
        for (loc, value) in &program.initial {
            memory.put_whole(*loc, *value);
        }
        for (loc, low, high) in &program.limits {
            memory.limits.insert(*loc, (*low, *high));
        }
        let states = program.blocks.iter().map(|block| BlockState {
            elements: vec![ElementState::default(); block.elements.len()],
            ..BlockState::default()
        });
        let mut sim = Sim {
            program,
            memory,
            now: 0,
            local: [0; 10],
            counters: BTreeMap::new(),
            timers: BTreeMap::new(),
            histories: vec![false; program.histories],
            blocks: states.collect(),
            stop_asked: false,
            current: 0,
            ended: false,
            returned: false,
            quiet: false,
        };
        for (number, block) in program.blocks.iter().enumerate() {
            let builtin = matches!(block.kind, Kind::FirstScan | Kind::TopOfScan);
            let builtin = builtin || block.kind == Kind::BottomOfScan;
            if builtin || block.autostart || is_main(block) {
                sim.set_running(number, true);
                sim.blocks[number].fresh = true;
            }
        }
        sim
    }

    /// Executes one scan; `inputs` are X, `writes` the queued writes.
    pub fn scan(
        &mut self,
        number: i64,
        now: i64,
        last: bool,
        inputs: &[(Loc, i64)],
        writes: &[(Loc, i64)],
    ) {
        self.now = now;
        self.status(number, last);
        for (loc, value) in inputs.iter().chain(writes) {
            self.memory.put_whole(*loc, *value);
        }
        self.builtin(Kind::FirstScan);
        self.builtin(Kind::TopOfScan);
        for block in self.program.order.clone() {
            self.turn(block);
        }
        self.builtin(Kind::BottomOfScan);
        if last {
            self.builtin(Kind::LastScan);
        }
    }

    fn status(&mut self, number: i64, last: bool) {
        let first_half = |period: i64| self.now % period < period / 2;
        let bits = [
            number == 0,
            true,
            false,
            first_half(60_000),
            first_half(1000),
            first_half(100),
            first_half(50),
            number % 2 == 1,
            last,
            false,
            false,
            false,
            false,
            false,
        ];
        for (index, on) in bits.into_iter().enumerate() {
            self.memory.put_bit(Loc::whole(Area::St, index), on);
        }
        self.memory.put(Loc::whole(Area::Dst, 0), number % 2_147_483_648);
        for (index, value) in self.local.into_iter().enumerate() {
            self.memory.put(Loc::whole(Area::Dst, 5 + index), value);
        }
        if last {
            for (number, block) in self.program.blocks.iter().enumerate() {
                if block.kind == Kind::LastScan {
                    self.set_running(number, true);
                }
            }
        }
    }

    fn builtin(&mut self, kind: Kind) {
        for number in 0..self.program.blocks.len() {
            if self.program.blocks[number].kind == kind {
                self.turn(number);
            }
        }
    }

    /// A block's turn: its pass if one is due, then its execution if the block runs.
    fn turn(&mut self, block: usize) {
        if self.blocks[block].due {
            self.block_pass(block);
        }
        if !self.running(block) {
            return;
        }
        self.current = block;
        self.ended = false;
        match self.program.blocks[block].kind {
            Kind::Program => self.run_program(block),
            Kind::TopOfScan | Kind::BottomOfScan => self.run_element(block, 0),
            Kind::Task if self.blocks[block].interval.is_some() => self.run_recurrent(block),
            Kind::Task | Kind::FirstScan | Kind::LastScan => {
                self.run_element(block, 0);
                if !self.ended {
                    self.set_running(block, false);
                    self.memory.put_bit(Loc::of(Area::Block, block, Member::Done), true);
                    self.blocks[block].due = true;
                }
            }
            Kind::Subroutine => panic!("a subroutine has no turn"),
        }
    }

    fn run_program(&mut self, block: usize) {
        let elements = self.blocks[block].elements.len();
        if std::mem::take(&mut self.blocks[block].fresh) {
            for stage in 1..elements {
                self.memory.put_bit(stage_bit(block, stage), stage == 1);
            }
        }
        self.run_element(block, 0);
        for stage in 1..elements {
            if self.ended {
                return;
            }
            if self.blocks[block].elements[stage].due {
                self.element_pass(block, stage);
            }
            if self.memory.bit(stage_bit(block, stage)) {
                self.run_element(block, stage);
            }
        }
    }

    fn run_recurrent(&mut self, block: usize) {
        let interval = self.blocks[block].interval.unwrap_or(0);
        let first = match self.blocks[block].schedule {
            Some((_, next)) if self.now < next => return,
            Some((first, _)) => first,
            None => self.now,
        };
        let mut next = self.now;
        if interval > 0 {
            next = first + ((self.now - first) / interval + 1) * interval;
        }
        self.blocks[block].schedule = Some((first, next));
        self.run_element(block, 0);
    }

    fn run_element(&mut self, block: usize, element: usize) {
        let program = self.program;
        for rung in &program.blocks[block].elements[element] {
            if self.ended {
                return;
            }
            self.blocks[block].elements[element].executed = true;
            self.run_rung(rung, element);
        }
    }

    /// CALL: the rungs of the subroutine, in the turn of the element that is executing.
    pub fn call_subroutine(&mut self, subroutine: usize, element: usize) {
        let program = self.program;
        for rung in &program.blocks[subroutine].elements[0] {
            if self.leaves() {
                break;
            }
            self.blocks[subroutine].elements[0].executed = true;
            self.blocks[subroutine].caller = Some((self.current, element));
            self.run_rung(rung, element);
        }
        self.returned = false;
    }

    /// Whether nothing that follows here executes any more.
    fn leaves(&self) -> bool {
        self.ended || self.returned
    }

    fn run_rung(&mut self, rung: &Rung, element: usize) {
        let legs: Vec<bool> = rung.legs.iter().map(|leg| self.contact(leg)).collect();
        self.run_instrs(&rung.instrs, element, &legs);
        for branch in &rung.branches {
            if self.leaves() {
                return;
            }
            let branch_power = self.contact(&branch.when);
            let power = legs.first().copied().unwrap_or(false) && branch_power;
            self.run_instrs(&branch.instrs, element, &[power]);
        }
    }

    fn run_instrs(&mut self, instrs: &[Instr], element: usize, legs: &[bool]) {
        for instr in instrs {
            if self.leaves() {
                return;
            }
            self.execute(instr, self.current, element, legs);
        }
    }

    /// The pass of a block: its own rungs, and each Stage that executed.
    fn block_pass(&mut self, block: usize) {
        self.blocks[block].due = false;
        for element in 0..self.blocks[block].elements.len() {
            self.element_pass(block, element);
        }
        for stage in 1..self.blocks[block].elements.len() {
            self.memory.put_bit(stage_bit(block, stage), false);
        }
    }

    fn element_pass(&mut self, block: usize, element: usize) {
        let state = &mut self.blocks[block].elements[element];
        state.due = false;
        if !std::mem::take(&mut state.executed) {
            return;
        }
        self.terminate_rungs(block, element);
        for subroutine in 0..self.blocks.len() {
            let state = &mut self.blocks[subroutine];
            if state.caller == Some((block, element))
                && std::mem::take(&mut state.elements[0].executed)
            {
                self.terminate_rungs(subroutine, 0);
            }
        }
    }

    fn terminate_rungs(&mut self, block: usize, element: usize) {
        let program = self.program;
        for rung in &program.blocks[block].elements[element] {
            for leg in &rung.legs {
                self.forget_contact(leg);
            }
            for instr in &rung.instrs {
                self.terminate(instr);
            }
            for branch in &rung.branches {
                self.forget_contact(&branch.when);
                for instr in &branch.instrs {
                    self.terminate(instr);
                }
            }
        }
    }

    /// RUN→STOP: every element that executed has its pass, in scan order.
    pub fn stop(&mut self) {
        for block in 0..self.blocks.len() {
            self.set_running(block, false);
        }
        let of_kind = |kind: Kind| {
            let blocks = self.program.blocks.iter().enumerate();
            blocks.filter(move |(_, b)| b.kind == kind).map(|(n, _)| n).collect::<Vec<_>>()
        };
        let mut order = of_kind(Kind::FirstScan);
        order.extend(of_kind(Kind::TopOfScan));
        order.extend(&self.program.order);
        order.extend(of_kind(Kind::BottomOfScan));
        order.extend(of_kind(Kind::LastScan));
        for block in order {
            self.block_pass(block);
        }
    }

    pub fn running(&self, block: usize) -> bool {
        self.memory.bit(Loc::of(Area::Block, block, Member::Running))
    }

    fn set_running(&mut self, block: usize, on: bool) {
        self.memory.put_bit(Loc::of(Area::Block, block, Member::Running), on);
    }

    /// RUN: a Program that runs already is not changed.
    pub fn start_program(&mut self, block: usize) {
        if !self.running(block) {
            self.set_running(block, true);
            self.blocks[block].fresh = true;
        }
    }

    /// ENTASK: a Task that runs already is not changed.
    pub fn start_task(&mut self, block: usize, interval: Option<i64>) {
        if !self.running(block) {
            self.set_running(block, true);
            self.memory.put_bit(Loc::of(Area::Block, block, Member::Done), false);
            self.blocks[block].interval = interval;
            self.blocks[block].schedule = None;
        }
    }

    /// The effect of EXIT, HALT, the first half of RESTART, and an ENTASK that went OFF.
    pub fn stop_block(&mut self, block: usize) {
        if self.running(block) {
            self.set_running(block, false);
            self.blocks[block].due = true;
        }
    }

    /// Ends the executing block for this scan: its remaining rungs do not execute.
    pub fn end_current(&mut self) {
        self.ended = true;
    }

    pub fn is_stage_on(&self, block: usize, stage: usize) -> bool {
        self.memory.bit(stage_bit(block, stage))
    }

    pub fn stage_on(&mut self, block: usize, stage: usize) {
        self.memory.put_bit(stage_bit(block, stage), true);
    }

    pub fn stage_off(&mut self, block: usize, stage: usize) {
        if self.is_stage_on(block, stage) {
            self.memory.put_bit(stage_bit(block, stage), false);
            self.blocks[block].elements[stage].due = true;
        }
    }

    /// JMP and SGDIVRG: the Stage goes OFF, its targets go ON.
    pub fn jump(&mut self, block: usize, from: usize, targets: &[usize]) {
        self.memory.put_bit(stage_bit(block, from), false);
        self.blocks[block].elements[from].due = true;
        for target in targets {
            self.stage_on(block, *target);
        }
    }

    /// Whether there is a rising edge relative to a history, which is updated.
    pub fn edge(&mut self, history: usize, on: bool) -> bool {
        let before = std::mem::replace(&mut self.histories[history], on);
        on && !before
    }

    /// Whether there is a falling edge relative to a history, which is updated.
    pub fn falling_edge(&mut self, history: usize, on: bool) -> bool {
        let before = std::mem::replace(&mut self.histories[history], on);
        before && !on
    }

    /// Sets both edge histories of an instruction to OFF.
    pub fn forget(&mut self, instr: &Instr) {
        for history in instr.history {
            self.histories[history] = false;
        }
    }

    fn forget_contact(&mut self, contact: &Contact) {
        match contact {
            Contact::Edge { history, of, .. } => {
                self.histories[*history] = false;
                self.forget_contact(of);
            }
            Contact::Not(inner) => self.forget_contact(inner),
            Contact::All(items) | Contact::Any(items) => {
                items.iter().for_each(|item| self.forget_contact(item));
            }
            Contact::Bit(_)
            | Contact::Element(..)
            | Contact::Compare(..)
            | Contact::Computed(_) => {}
        }
    }
}

fn is_main(block: &Block) -> bool {
    block.kind == Kind::Program && block.name == "Main"
}

fn stage_bit(block: usize, stage: usize) -> Loc {
    Loc::of(Area::Block, block, Member::Stage(stage))
}
