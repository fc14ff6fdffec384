//! The tape: the calls of the engine, from the scan thread to a reader.
//!
//! [`Taped`] is between the scanner and the engine. It hands every call on, and keeps those that a
//! replay needs: a write that changes nothing is not among them. At the end of a step the entries
//! go into a ring, as a whole or not at all. Once a second a copy of the engine's state goes with
//! them, in a box that was allocated before. The scan thread never waits: if the ring is full, the
//! step is lost, the loss is counted, and the tape continues with the next state that it can hand
//! over.
//!
//! The reader's end is in `tape_reader`. Deliberately absent: names, bytes, files.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rtrb::{Consumer, Producer};

use super::machine::{ImageCells, ScanStart, ScannedMachine};
use super::mode::{FaultReason, Mode};
use super::origin::Origin;
use rungd_base::calendar::LocalTime;
use rungd_engine::{
    BitCell, BlockEvent, Cell, Engine, EngineCall, EngineState, MathEvent, Transfer, WordCell,
};

/// The maximum number of entries of one step. (A scan applies at most 8,192 queued writes; the rest
/// is for inputs.)
pub(super) const STEP_ENTRIES_MAX: usize = 1 << 15;

/// The number of states that circulate.
pub(super) const SPARE_STATES: usize = 4;

/// The time between two states on the tape.
const STATE_EVERY_NS: u64 = 1_000_000_000;

/// One entry of the tape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TapeEntry {
    /// A call of the engine.
    Call(EngineCall),
    /// The origin of the writes, forces and releases that follow, until the next scan begins.
    Origin(Origin),
    /// The number of the scan that begins next (the first of a process is 1), if it is not one more
    /// than the number of the scan before.
    Number(u64),
    /// The controller enters a mode.
    Mode(Mode),
    /// A new program continues with the memory of the old one.
    Swap {
        /// Its number.
        generation: u32,
    },
    /// The state of the engine at this place. The reader receives it with the entry.
    State {
        /// The number of its program.
        generation: u32,
        /// The number of the next scan; the first of a process is 1.
        number: u64,
        /// The mode.
        mode: Mode,
    },
    /// Steps are missing here. A state follows immediately.
    Lost {
        /// The number of missing steps: scans, and commands outside of scans.
        steps: u64,
    },
}

impl TapeEntry {
    /// The call, if it is one.
    pub fn call(self) -> Option<EngineCall> {
        if let TapeEntry::Call(call) = self { Some(call) } else { None }
    }

    /// The mode that is entered, if one is.
    pub fn mode(self) -> Option<Mode> {
        if let TapeEntry::Mode(mode) = self { Some(mode) } else { None }
    }

    /// The origin of the changes that follow, if it tells one.
    pub fn origin(self) -> Option<Origin> {
        if let TapeEntry::Origin(origin) = self { Some(origin) } else { None }
    }
}

/// A state on its way to the reader.
#[derive(Debug)]
pub(super) enum HandedState {
    /// Belongs to a [`TapeEntry::State`].
    State(Box<EngineState>),
    /// A state of an earlier program, to be dropped.
    Outlived(Box<EngineState>),
}

/// The scan thread's end of the tape.
pub(super) struct Tape {
    pub entries: Producer<TapeEntry>,
    pub states: Producer<HandedState>,
    pub spares: Consumer<Box<EngineState>>,
    /// The entries of this step.
    pub step: Vec<TapeEntry>,
    /// The step has more entries than the buffer has room for.
    pub overflow: bool,
    /// Steps lost since the last entry in the ring.
    pub lost: u64,
    /// The same number, for the reader of a tape that has ended.
    pub unheard: Arc<AtomicU64>,
    /// A state must be handed over before the next step.
    pub needs_state: bool,
    pub next_state_ns: u64,
    /// The number of the next scan, if it follows the last one.
    pub number: u64,
    pub generation: u32,
    pub mode: Mode,
    /// The origin of the present changes, and whether the tape contains it.
    pub origin: (Origin, bool),
    /// The engine panicked: nothing is handed over any more.
    pub broken: bool,
}

/// Spare states. Each is a box, because a box goes through the rings without being copied.
#[allow(clippy::vec_box)]
type SpareStates = Vec<Box<EngineState>>;

/// An engine with a tape; without one it is the engine alone.
pub struct Taped {
    engine: Engine,
    tape: Option<Box<Tape>>,
    /// Spare states of this program's shape.
    fresh: SpareStates,
    local: LocalSecond,
}

/// The local time of the last scan: for the scans of one second it is computed once.
#[derive(Debug)]
struct LocalSecond {
    seconds: i64,
    time: LocalTime,
}

impl LocalSecond {
    fn of(seconds: i64) -> LocalSecond {
        LocalSecond { seconds, time: LocalTime::of(seconds) }
    }
}

impl Taped {
    /// An engine without a tape. It may get one by a [`ScannedMachine::adopt`] or at the start.
    pub fn new(engine: Engine) -> Taped {
        Taped { engine, tape: None, fresh: Vec::new(), local: LocalSecond::of(0) }
    }

    /// An engine with a tape.
    pub(super) fn with_tape(engine: Engine, tape: Tape) -> Taped {
        Taped { engine, tape: Some(Box::new(tape)), fresh: Vec::new(), local: LocalSecond::of(0) }
    }

    /// Adds spare states, so that a tape can continue with this engine's program.
    pub fn with_spares(mut self) -> Taped {
        self.fresh = (0..SPARE_STATES).map(|_| Box::new(EngineState::of(&self.engine))).collect();
        self
    }

    /// The engine.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The engine; its tape ends.
    pub fn into_engine(self) -> Engine {
        self.engine
    }

    fn keep(&mut self, entry: TapeEntry) {
        if let Some(tape) = &mut self.tape {
            tape.keep(entry);
        }
    }

    /// Keeps a write that has changed memory.
    fn keep_write(&mut self, cell: Cell, value: i32) {
        if let Some(tape) = &mut self.tape {
            tape.keep_from(EngineCall::Write(cell, value));
        }
    }
}

impl Tape {
    fn keep(&mut self, entry: TapeEntry) {
        if self.step.len() < STEP_ENTRIES_MAX {
            self.step.push(entry);
        } else {
            self.overflow = true;
        }
    }

    /// Keeps a call with its origin.
    fn keep_from(&mut self, call: EngineCall) {
        let (origin, told) = self.origin;
        if !told {
            self.origin.1 = true;
            self.keep(TapeEntry::Origin(origin));
        }
        self.keep(TapeEntry::Call(call));
    }

    /// Hands the step over, or counts it as lost.
    fn hand_over_step(&mut self) {
        // Room for the loss and the state beside the step.
        let fits = !self.overflow && self.entries.slots() >= self.step.len() + 2;
        if self.needs_state || !fits {
            if !self.step.is_empty() {
                self.lost += 1;
                self.unheard.store(self.lost, Ordering::Relaxed);
                self.needs_state = true;
            }
            self.step.clear();
            self.overflow = false;
        } else {
            self.push_step();
        }
    }

    /// Hands a state over if one is due.
    fn hand_over_state(&mut self, engine: &Engine, fresh: &mut SpareStates) {
        let now_ns = engine.now_ns();
        let is_due = self.needs_state || now_ns >= self.next_state_ns;
        if is_due && !self.broken && self.push_state(engine, fresh) {
            self.next_state_ns = now_ns.saturating_add(STATE_EVERY_NS);
        }
    }

    fn push_step(&mut self) {
        if let Ok(chunk) = self.entries.write_chunk_uninit(self.step.len()) {
            chunk.fill_from_iter(self.step.drain(..));
        }
    }

    /// Hands a state over; false if there is no spare state, or no room.
    fn push_state(&mut self, engine: &Engine, fresh: &mut SpareStates) -> bool {
        if self.entries.slots() < 2 || self.states.slots() == 0 {
            return false;
        }
        let Some(mut state) = self.spare(engine, fresh) else { return false };
        state.copy_from(engine);
        if self.lost > 0 {
            let lost = TapeEntry::Lost { steps: std::mem::take(&mut self.lost) };
            let _ = self.entries.push(lost);
            self.unheard.store(0, Ordering::Relaxed);
        }
        self.needs_state = false;
        // The state first: when the reader has the entry, the state is there.
        push_or_forget(&mut self.states, HandedState::State(state));
        let Tape { generation, number, mode, .. } = *self;
        let _ = self.entries.push(TapeEntry::State { generation, number, mode });
        true
    }

    /// A spare state of this program. States of earlier programs are returned, to be dropped
    /// elsewhere.
    fn spare(&mut self, engine: &Engine, fresh: &mut SpareStates) -> Option<Box<EngineState>> {
        if let Some(state) = fresh.pop() {
            return Some(state);
        }
        while self.states.slots() > 1 {
            let state = self.spares.pop().ok()?;
            if state.fits(engine.program()) {
                return Some(state);
            }
            push_or_forget(&mut self.states, HandedState::Outlived(state));
        }
        None
    }
}

/// Hands a box over. Without room its memory is leaked, because the scan thread must not free; the
/// callers have checked that there is room.
fn push_or_forget(ring: &mut Producer<HandedState>, handed: HandedState) {
    if let Err(rtrb::PushError::Full(kept)) = ring.push(handed) {
        std::mem::forget(kept);
    }
}

/// A time for the tape: whole microseconds.
fn whole_us(now_ns: u64) -> u64 {
    now_ns / 1000 * 1000
}

impl ScannedMachine for Taped {
    fn start(&mut self, now_ns: u64) {
        let now_ns = whole_us(now_ns);
        self.keep(TapeEntry::Call(EngineCall::Start { now_ns }));
        self.engine.start(now_ns);
    }

    fn begin_scan(&mut self, start: &ScanStart) {
        let start = ScanStart { now_ns: whole_us(start.now_ns), ..*start };
        if let Some(tape) = &mut self.tape {
            if tape.number != start.number {
                tape.keep(TapeEntry::Number(start.number));
            }
            tape.number = start.number + 1;
            tape.origin = (Origin::Inputs, false);
            let ScanStart { now_ns, times, local_s, .. } = start;
            tape.keep(TapeEntry::Call(EngineCall::Begin { now_ns, times, local_s }));
        }
        if self.local.seconds != start.local_s {
            self.local = LocalSecond::of(start.local_s);
        }
        self.engine.begin_scan(start.now_ns, &start.times, &self.local.time);
    }

    fn set_input(&mut self, x: u32, on: bool) {
        let cell = self.engine.input_cell(x);
        self.write_bit(cell, on);
    }

    fn differing_inputs(&self, first: u32, values: u64) -> u64 {
        self.engine.differing_inputs(first, values)
    }

    fn write_bit(&mut self, cell: BitCell, on: bool) {
        if self.engine.change_bit(cell, on) {
            self.keep_write(Cell::Bit(cell), i32::from(on));
        }
    }

    fn write_word(&mut self, cell: WordCell, value: i32) {
        if self.engine.change_word(cell, value) {
            self.keep_write(Cell::Word(cell), value);
        }
    }

    fn execute(&mut self) -> bool {
        self.keep(TapeEntry::Call(EngineCall::Execute));
        self.engine.execute().last
    }

    fn request_stop(&mut self) {
        self.keep(TapeEntry::Call(EngineCall::RequestStop));
        self.engine.request_stop();
    }

    fn stops(&self) -> bool {
        self.engine.stops()
    }

    fn terminate(&mut self) {
        self.keep(TapeEntry::Call(EngineCall::Terminate));
        self.engine.terminate();
    }

    fn force(&mut self, cell: Cell, value: i32) {
        if let Some(tape) = &mut self.tape {
            tape.keep_from(EngineCall::Force(cell, value));
        }
        ScannedMachine::force(&mut self.engine, cell, value);
    }

    fn release(&mut self, cell: Cell) {
        if let Some(tape) = &mut self.tape {
            tape.keep_from(EngineCall::Release(cell));
        }
        ScannedMachine::release(&mut self.engine, cell);
    }

    fn adopt(&mut self, old: &mut Taped, transfer: &Transfer, running: bool, forces: &[Cell]) {
        if let Some(tape) = &mut old.tape {
            // Requests a last state of the old program: it verifies a replay of all that is before
            // it.
            tape.next_state_ns = 0;
        }
        old.settle();
        self.engine.adopt(&mut old.engine, transfer, running, forces);
        self.tape = old.tape.take();
    }

    fn image(&self) -> ImageCells<'_> {
        ScannedMachine::image(&self.engine)
    }

    fn events(&self) -> (&[BlockEvent], u32) {
        ScannedMachine::events(&self.engine)
    }

    fn maths(&self) -> &[MathEvent] {
        self.engine.maths()
    }

    fn comes_from(&mut self, origin: Origin) {
        if let Some(tape) = &mut self.tape
            && tape.origin.0 != origin
        {
            tape.origin = (origin, false);
        }
    }

    fn enters(&mut self, mode: Mode) {
        let Some(tape) = &mut self.tape else { return };
        tape.mode = mode;
        if mode == Mode::Fault(FaultReason::EnginePanic) {
            // The scan that panicked has no end, and no scan continues with its memory.
            tape.step.clear();
            tape.broken = true;
        }
        if mode != Mode::Run {
            // The state after the passes verifies a replay of the passes.
            tape.next_state_ns = 0;
        }
        tape.keep(TapeEntry::Mode(mode));
    }

    fn swapped(&mut self, generation: u32) {
        let Taped { engine, tape, fresh, .. } = self;
        if let Some(tape) = tape {
            tape.keep(TapeEntry::Swap { generation });
            tape.generation = generation;
            tape.hand_over_step();
            // The calls that follow belong to the new program, so a state of it must come before
            // them.
            tape.needs_state = true;
            tape.hand_over_state(engine, fresh);
        }
    }

    fn settle(&mut self) {
        let Taped { engine, tape, fresh, .. } = self;
        if let Some(tape) = tape {
            tape.hand_over_step();
            tape.hand_over_state(engine, fresh);
        }
    }
}
