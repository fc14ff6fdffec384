//! The state of blocks and Stages in a state of the search.
//!
//! For `form`. What no later scan can tell apart is stored alike:
//!
//! - The time since an element's last execution is 0 while no timer of the element times. Only a
//!   timer that times adds it, and a timer begins to time in an execution that adds nothing. The
//!   time that a RETURN has withheld belongs to the timers behind it, and the first execution that
//!   reaches them ends it: it is 0 while none of the element's timers times.
//! - That a block has its first turn before it matters while it runs, and for a Task only if it
//!   recurs; starting a block sets it anew. So is all of a Task's recurrence.
//! - A recurrent Task executes when its number of whole intervals since its first execution
//!   changes; its turn comes in every scan. So the part of an interval that has passed decides.
//! - That an element has executed since its last pass matters if a pass in the cone may follow,
//!   and that a Stage's pass is due only if it has executed. The caller of a subroutine without
//!   such a pass does not matter.

use rungd_engine::isa::{Bit, BlockId, StageId};
use rungd_engine::ops::{Control, ControlKind, Op};
use rungd_engine::record::{FLAGS, RECORD, timer_state};
use rungd_engine::{
    BlockRole, BlockState, Cell, Element, ElementCode, Engine, EngineProgram, Slice, StageState,
};

use super::bytes::{ByteReader, ByteWriter};
use super::effects::{Effects, Owned};
use super::live::{all_operations, operations};

/// The place of a loaded state in time.
#[derive(Clone, Copy, Debug)]
pub(super) struct LoadedTime {
    /// The timestamp of its scan, ms.
    pub now_ms: u64,
}

/// The blocks and Stages of a cone.
#[derive(Debug)]
pub(super) struct StoredElements {
    /// The bits of Stages and of blocks that run.
    pub bits: Vec<u32>,
    blocks: Vec<StoredBlock>,
    stages: Vec<StoredStage>,
    /// Also among `blocks`.
    subroutines: Vec<StoredSubroutine>,
}

#[derive(Debug)]
struct StoredBlock {
    id: BlockId,
    role: BlockRole,
    running: u32,
    /// A pass in the cone may follow an execution.
    has_pass: bool,
    /// It is a Task that an instruction enables recurrently.
    recurs: bool,
    timed: TimedElement,
}

#[derive(Debug)]
struct StoredStage {
    id: StageId,
    has_pass: bool,
    timed: TimedElement,
}

#[derive(Debug)]
struct StoredSubroutine {
    /// Its index in the program.
    index: usize,
    id: BlockId,
}

/// The timers of an element.
#[derive(Clone, Debug)]
pub(super) struct TimersOf {
    /// For each timer, the bit that says that it times.
    running: Vec<u32>,
}

impl TimersOf {
    /// Whether any of them times.
    pub fn time(&self, bits: &[u8]) -> bool {
        self.running.iter().any(|bit| bits[*bit as usize] != 0)
    }
}

/// An element's timers, and the words of the times that the ends of its executions have
/// withheld.
#[derive(Debug)]
struct TimedElement {
    timers: TimersOf,
    withheld: Vec<u32>,
}

impl StoredElements {
    /// Those of a cone. `slice`: its known cells.
    pub fn new(code: &EngineProgram, slice: &Slice) -> StoredElements {
        let is_known = |bit: Bit| slice.knows(Cell::Bit(code.layout.bit(bit)));
        let passes = |element: &ElementCode| !element.terminations.is_empty();
        let is_subroutine = |id: &BlockId| code.subroutines.contains(id);
        let has_subroutine_pass =
            code.subroutines.iter().any(|id| passes(&code.blocks[id.0 as usize].own));
        let has_pass = |element: &ElementCode| passes(element) || has_subroutine_pass;
        let (recurring, effects) = (recurring(code), Effects::new(code));
        let known =
            (0..code.blocks.len() as u32).map(BlockId).filter(|id| is_known(Bit::Running(*id)));
        let block = |id: BlockId| {
            let block = &code.blocks[id.0 as usize];
            StoredBlock {
                id,
                role: block.role,
                running: code.layout.bit(Bit::Running(id)).0,
                has_pass: if is_subroutine(&id) {
                    passes(&block.own)
                } else {
                    has_pass(&block.own)
                },
                recurs: recurring.contains(&id),
                timed: TimedElement::new(&effects, &block.own),
            }
        };
        let blocks: Vec<StoredBlock> = known.map(block).collect();
        let stage = |id: StageId| {
            let stage = &code.stages[id.0 as usize];
            StoredStage { id, has_pass: has_pass(stage), timed: TimedElement::new(&effects, stage) }
        };
        let stages = (0..code.stages.len() as u32).map(StageId);
        let stages: Vec<StoredStage> =
            stages.filter(|id| is_known(Bit::Stage(*id))).map(stage).collect();
        let subroutine = |index: usize| StoredSubroutine { index, id: code.subroutines[index] };
        let has_caller = |stored: &StoredSubroutine| {
            blocks.iter().any(|block| block.id == stored.id && block.has_pass)
        };
        let running = blocks.iter().filter(|block| block.role != BlockRole::Subroutine);
        let stage_bits = stages.iter().map(|stage| code.layout.bit(Bit::Stage(stage.id)).0);
        StoredElements {
            bits: running.map(|block| block.running).chain(stage_bits).collect(),
            subroutines: (0..code.subroutines.len()).map(subroutine).filter(has_caller).collect(),
            blocks,
            stages,
        }
    }

    /// The timers that may get the time that a RETURN has withheld in a word; `None`: the word has
    /// no such time.
    pub fn withheld(&self, word: u32) -> Option<&TimersOf> {
        let timed = self.blocks.iter().map(|block| &block.timed);
        timed.clone().find(|timed| timed.withheld.contains(&word)).map(|timed| &timed.timers)
    }

    /// Whether any timer times, or a Task recurs.
    pub fn measure_time(&self, engine: &Engine) -> bool {
        let bits = engine.image().bits();
        let blocks = self.blocks.iter().map(|block| &block.timed);
        let mut timed = blocks.chain(self.stages.iter().map(|stage| &stage.timed));
        let recurs = |block: &StoredBlock| {
            block.recurs
                && bits[block.running as usize] != 0
                && engine.block_state(block.id).recurrent
        };
        timed.any(|timed| timed.timers.time(bits)) || self.blocks.iter().any(recurs)
    }

    /// Writes the state of all elements.
    pub fn save(&self, engine: &Engine, to: &mut ByteWriter) {
        let (bits, now_ms) = (engine.image().bits(), engine.now_ns() / 1_000_000);
        for block in &self.blocks {
            block.save(engine.block_state(block.id), SavedAt { bits, now_ms }, to);
        }
        for stage in &self.stages {
            let state = engine.stage_state(stage.id);
            if stage.has_pass {
                to.bit(state.executed);
                to.bit(state.executed && state.pass_due);
            }
            stage.timed.save(state.executed_ms, SavedAt { bits, now_ms }, to);
        }
        for subroutine in &self.subroutines {
            let executed = engine.block_state(subroutine.id).executed;
            to.number(caller_number(engine.caller(subroutine.id).filter(|_| executed)));
        }
    }

    /// Puts the state of all elements in an engine.
    pub fn load(&self, engine: &mut Engine, time: LoadedTime, from: &mut ByteReader) {
        for block in &self.blocks {
            let state = block.load(time, from);
            engine.put_block_state(block.id, state);
        }
        for stage in &self.stages {
            let mut state = StageState::default();
            if stage.has_pass {
                (state.executed, state.pass_due) = (from.bit(), from.bit());
            }
            state.executed_ms = time.now_ms - stage.timed.load(from);
            engine.put_stage_state(stage.id, state);
        }
        for subroutine in &self.subroutines {
            engine.put_caller(subroutine.index, caller(from.number()));
        }
    }
}

/// The memory and the time of a state that is saved.
#[derive(Clone, Copy)]
struct SavedAt<'i> {
    bits: &'i [u8],
    now_ms: u64,
}

impl StoredBlock {
    fn is_program(&self) -> bool {
        matches!(self.role, BlockRole::Program { .. })
    }

    fn save(&self, state: BlockState, at: SavedAt, to: &mut ByteWriter) {
        let runs = at.bits[self.running as usize] != 0;
        let recurs = runs && state.recurrent;
        if self.is_program() || self.has_pass {
            to.bit(state.pass_due);
            to.bit(state.executed && self.has_pass);
        }
        if self.is_program() || self.recurs {
            to.bit(state.first_turn && runs && (self.is_program() || recurs));
        }
        if self.recurs {
            let times = recurs && !state.first_turn;
            let since_ns = at.now_ms * 1_000_000 - if times { state.enabled_ns } else { 0 };
            let passed = since_ns.checked_rem(state.every_ns).filter(|_| times).unwrap_or(0);
            let intervals = since_ns.checked_div(state.every_ns).unwrap_or(state.intervals);
            debug_assert!(!times || intervals == state.intervals, "its turn comes in every scan");
            to.bit(recurs);
            to.number(if recurs { (state.every_ns / 1_000_000) as u32 } else { 0 });
            to.number((passed / 1_000_000) as u32);
        }
        self.timed.save(state.executed_ms, at, to);
    }

    fn load(&self, time: LoadedTime, from: &mut ByteReader) -> BlockState {
        let mut state = BlockState::default();
        if self.is_program() || self.has_pass {
            (state.pass_due, state.executed) = (from.bit(), from.bit());
        }
        if self.is_program() || self.recurs {
            state.first_turn = from.bit();
        }
        if self.recurs {
            state.recurrent = from.bit();
            state.every_ns = u64::from(from.number()) * 1_000_000;
            state.enabled_ns = (time.now_ms - u64::from(from.number())) * 1_000_000;
        }
        state.executed_ms = time.now_ms - self.timed.load(from);
        state
    }
}

impl TimedElement {
    fn new(effects: &Effects, element: &ElementCode) -> TimedElement {
        let mut timed = TimedElement { timers: TimersOf { running: Vec::new() }, withheld: vec![] };
        for op in operations(effects.program, element.batches.clone()) {
            if let Some(timer) = effects.effect(&op).owns.and_then(Owned::timer) {
                let state = timer.at * RECORD as u32 + FLAGS as u32;
                timed.timers.running.push(state + timer_state::RUNNING);
            }
            if let Op::Control(Control { kind: ControlKind::KeepTime { missed_ms }, .. }) = op {
                timed.withheld.push(missed_ms);
            }
        }
        timed
    }

    fn save(&self, executed_ms: u64, at: SavedAt, to: &mut ByteWriter) {
        if self.timers.running.is_empty() {
            return;
        }
        let since_ms = at.now_ms.saturating_sub(executed_ms).min(i32::MAX as u64);
        to.number(if self.timers.time(at.bits) { since_ms as u32 } else { 0 });
    }

    /// The time since the last execution, ms.
    fn load(&self, from: &mut ByteReader) -> u64 {
        if self.timers.running.is_empty() { 0 } else { u64::from(from.number()) }
    }
}

/// The Tasks that an instruction enables recurrently.
fn recurring(code: &EngineProgram) -> Vec<BlockId> {
    let tasks = all_operations(code).filter_map(|op| {
        let Op::Control(Control { kind: ControlKind::EnableEvery { task, .. }, .. }) = op else {
            return None;
        };
        Some(task)
    });
    tasks.collect()
}

/// An element as a number; 0: none.
fn caller_number(caller: Option<Element>) -> u32 {
    match caller {
        None => 0,
        Some(Element::Block(BlockId(at))) => 1 + 2 * at,
        Some(Element::Stage(StageId(at))) => 2 + 2 * at,
    }
}

fn caller(number: u32) -> Option<Element> {
    let at = number.checked_sub(1)?;
    Some(if at % 2 == 0 {
        Element::Block(BlockId(at / 2))
    } else {
        Element::Stage(StageId(at / 2))
    })
}
