//! The engine and its scan, as the simulator and the scan thread call them.
//!
//! Behaviour: `docs/semantics.md`, section 4 (scan order, stop and start) and 6 (status). The
//! caller passes the timestamp, the inputs and the queued writes, and reads the image afterwards.
//! Steps 8 and 9 (publishing images, outputs and statistics) are the caller's work.

use super::events::{BlockEvent, Element, Events, MathEvent};
use super::eye::{NoObserver, ScanObserver, ScanStep};
use super::image::{BitCell, Image, WordCell};
use super::layout::{Cell, WordBitCell};
use super::machine::{BlockState, Machine, StageState};
use super::math::Calculator;
use super::memory::Memory;
use super::program::{BlockRole, EngineProgram};
use super::reach::{FarReach, ForcedReach, NearReach, Reach};
use crate::isa::status::{dst, st};
use crate::isa::{Bit, BitSpace, BlockId, Word, WordSpace};
use rungd_base::calendar::LocalTime;

/// Scan times for the status words, µs, since the start of RUN. All 0 in a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct ScanTimes {
    pub mean_us: i32,
    pub min_us: i32,
    pub max_us: i32,
    pub last_us: i32,
}

/// How a scan ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanEnd {
    /// It was the last scan: call `terminate` next.
    pub last: bool,
}

/// A loaded program with its memory, ready to be scanned.
#[derive(Debug)]
pub struct Engine {
    pub(super) machine: Machine,
    pub(super) start_ns: u64,
    pub(super) scans: u64,
    pub(super) last: bool,
    /// The words that its states do not have in their bytes: those that the recording that it
    /// executes again does not have.
    pub(super) absent_words: std::ops::Range<usize>,
}

impl Engine {
    /// Allocates everything; memory is as after a cold start. Call [`Engine::start`] next.
    pub fn new(program: EngineProgram) -> Engine {
        let mut image = Image::new(program.bit_count as usize, program.word_count as usize);
        for (cell, on) in &program.initial_bits {
            image.bits[cell.0 as usize] = u8::from(*on);
        }
        for (cell, value) in &program.initial_words {
            image.words[cell.0 as usize] = *value;
        }
        let memory = Memory { image, elapsed_ms: 0 };
        let status = program.layout.bit(Bit::Space(BitSpace::St, 0));
        let machine = Machine {
            blocks: vec![BlockState::default(); program.blocks.len()].into(),
            stages: vec![StageState::default(); program.stages.len()].into(),
            callers: vec![None; program.subroutines.len()].into(),
            events: Events::new(),
            now_ns: 0,
            stop_requested: false,
            calculator: Calculator::new(program.tables.slots, status.0),
            program,
            memory,
        };
        let mut engine = Engine { machine, start_ns: 0, scans: 0, last: false, absent_words: 0..0 };
        // `$On` is ON in STOP too.
        let BitCell(on) = engine.machine.program.layout.bit(Bit::Space(BitSpace::St, st::ON));
        engine.machine.memory.image.bits[on as usize] = 1;
        engine
    }

    /// STOP → RUN, with memory unchanged: `Main`, autostart Programs and built-in Tasks start.
    /// Programs whose Stages are retained go on where they were.
    pub fn start(&mut self, now_ns: u64) {
        self.start_ns = now_ns;
        self.scans = 0;
        self.last = false;
        let machine = &mut self.machine;
        machine.stop_requested = false;
        machine.events.clear();
        for at in 0..machine.program.order.len() {
            let id = machine.program.order[at];
            let role = machine.program.block(id).role;
            let starts = match role {
                BlockRole::Program { .. } if machine.restore_program(id) => false,
                BlockRole::Program { autostart } => autostart,
                BlockRole::Task | BlockRole::LastScan | BlockRole::Subroutine => false,
                BlockRole::FirstScan | BlockRole::TopOfScan | BlockRole::BottomOfScan => true,
            };
            if starts {
                machine.mark_started(id);
            }
        }
    }

    /// Makes the next scan the last one.
    pub fn request_stop(&mut self) {
        self.machine.stop_requested = true;
    }

    /// Whether a stop was requested: the next scan is the last one, or the last one has begun.
    pub fn stops(&self) -> bool {
        self.machine.stop_requested
    }

    /// Step 1: the timestamp (ns, monotonic), clock bits, status words. Inputs and queued writes
    /// come next. Only the ladder uses local time; no duration is measured with it.
    pub fn begin_scan(&mut self, now_ns: u64, times: &ScanTimes, local: &LocalTime) {
        self.last = self.machine.stop_requested;
        self.machine.now_ns = now_ns;
        if self.scans > 0 {
            self.machine.events.clear();
        }
        self.put_status_bits(now_ns.saturating_sub(self.start_ns));
        let mut words = [0; dst::COUNT_0_2];
        words[dst::SCAN_COUNTER as usize] = scan_counter(self.scans);
        words[dst::SCAN_TIME_US as usize] = times.mean_us;
        words[dst::MIN_SCAN_TIME_US as usize] = times.min_us;
        words[dst::MAX_SCAN_TIME_US as usize] = times.max_us;
        words[dst::LAST_SCAN_TIME_US as usize] = times.last_us;
        words[dst::YEAR as usize] = local.year;
        words[dst::MONTH as usize] = local.month;
        words[dst::DAY as usize] = local.day;
        words[dst::WEEKDAY as usize] = local.weekday;
        words[dst::HOUR as usize] = local.hour;
        words[dst::MINUTE as usize] = local.minute;
        words[dst::SECOND as usize] = local.second;
        let Machine { program, memory, .. } = &mut self.machine;
        let WordCell(first) = program.layout.word(Word::Space(WordSpace::Dst, 0));
        memory.image.put_words(first, &words);
        // `$DownSeconds` is in memory since the start of the process.
        let WordCell(day) = program.layout.word(Word::Space(WordSpace::Dst, dst::DAY_NUMBER));
        memory.image.put_words(day, &[local.day_number, local.second_of_day]);
    }

    fn put_status_bits(&mut self, since_start_ns: u64) {
        let mut bits = [0; st::COUNT];
        let mut put = |n: u32, on: bool| bits[n as usize] = u8::from(on);
        put(st::FIRST_SCAN, self.scans == 0);
        put(st::ON, true);
        put(st::ONE_MINUTE, first_half(since_start_ns, 60_000));
        put(st::ONE_SECOND, first_half(since_start_ns, 1_000));
        put(st::HUNDRED_MS, first_half(since_start_ns, 100));
        put(st::FIFTY_MS, first_half(since_start_ns, 50));
        put(st::SCAN_TOGGLE, self.scans % 2 == 1);
        put(st::LAST_SCAN, self.last);
        put(st::FORCES_ACTIVE, self.machine.memory.image.forces() > 0);
        let first = self.machine.program.layout.bit(Bit::Space(BitSpace::St, 0)).0;
        self.machine.memory.image.put_bits(first, &bits);
    }

    /// Step 2: the state of input `Xn`. Discarded while it is forced.
    pub fn set_input(&mut self, n: u32, on: bool) {
        let cell = self.machine.program.layout.bit(Bit::Space(BitSpace::X, n));
        self.write_bit(cell, on);
    }

    /// Of 64 inputs from `Xn` on: those whose value in memory is not the given one. The lowest bit
    /// is that of `Xn`.
    pub fn differing_inputs(&self, n: u32, values: u64) -> u64 {
        self.machine.memory.image.packed(self.input_cell(n)) ^ values
    }

    /// Step 3: one queued write of a public bit. Discarded while it is forced.
    pub fn write_bit(&mut self, cell: BitCell, on: bool) {
        self.change_bit(cell, on);
    }

    /// Step 3: one queued write of a public word. `value` must be within the word's range.
    /// Discarded while it is forced.
    pub fn write_word(&mut self, cell: WordCell, value: i32) {
        self.change_word(cell, value);
    }

    /// Does the same as [`Engine::write_bit`]; returns whether the write changed the bit.
    pub fn change_bit(&mut self, cell: BitCell, on: bool) -> bool {
        self.machine.memory.image.write_bit(cell, on)
    }

    /// Does the same as [`Engine::write_word`]; returns whether the write changed the word.
    pub fn change_word(&mut self, cell: WordCell, value: i32) -> bool {
        self.machine.memory.image.write_word(cell, value)
    }

    /// Step 3: one queued write of a bit of a public word, in the word as it now is. Discarded
    /// while the word is forced. Returns whether the write changed the word.
    pub fn change_word_bit(&mut self, bit: WordBitCell, on: bool) -> bool {
        let content = self.machine.memory.image.word(bit.word);
        self.change_word(bit.word, bit.put(content, on))
    }

    /// Steps 4 to 7: the built-in Tasks, Programs and Tasks, each at its turn.
    pub fn execute(&mut self) -> ScanEnd {
        let image = &self.machine.memory.image;
        match (image.forces(), image.is_near()) {
            (0, true) => self.execute_with::<NearReach>(&mut NoObserver),
            (0, false) => self.execute_with::<FarReach>(&mut NoObserver),
            _ => self.execute_with::<ForcedReach>(&mut NoObserver),
        }
    }

    /// Does the same as [`Engine::execute`]; `eye` sees each step.
    pub(crate) fn execute_seen(&mut self, eye: &mut impl ScanObserver) -> ScanEnd {
        self.execute_with::<ForcedReach>(eye)
    }

    fn execute_with<R: Reach>(&mut self, eye: &mut impl ScanObserver) -> ScanEnd {
        if self.last {
            self.start_last_scan_task();
        }
        for at in 0..self.machine.program.order.len() {
            let id = self.machine.program.order[at];
            self.machine.turn::<R>(id, eye);
        }
        self.machine.keep_stages();
        self.scans = self.scans.saturating_add(1);
        ScanEnd { last: self.last }
    }

    /// Starts `LastScan`. It is Running from the start of the last scan until it has executed, as
    /// `FirstScan` is in the first scan.
    fn start_last_scan_task(&mut self) {
        for at in 0..self.machine.program.order.len() {
            let id = self.machine.program.order[at];
            if self.machine.program.block(id).role == BlockRole::LastScan {
                self.machine.mark_started(id);
            }
        }
    }

    /// Call after the last scan: runs the pass of every element that executed since its last pass,
    /// in scan order. Afterwards no block is Running.
    pub fn terminate(&mut self) {
        // This is rare, so it is not compiled for near reach.
        match self.machine.memory.image.forces() {
            0 => self.terminate_with::<FarReach>(&mut NoObserver),
            _ => self.terminate_with::<ForcedReach>(&mut NoObserver),
        }
    }

    /// Does the same as [`Engine::terminate`]; `eye` sees each step.
    pub(crate) fn terminate_seen(&mut self, eye: &mut impl ScanObserver) {
        self.terminate_with::<ForcedReach>(eye);
    }

    fn terminate_with<R: Reach>(&mut self, eye: &mut impl ScanObserver) {
        self.machine.events.clear();
        for at in 0..self.machine.program.order.len() {
            let id = self.machine.program.order[at];
            eye.before(ScanStep::Turn(id), &self.machine.memory.image);
            self.machine.pass_block::<R>(id, eye);
            eye.after(ScanStep::Turn(id), &self.machine.memory.image);
        }
        self.machine.pass_subroutines::<R>(None, eye);
        for at in 0..self.machine.blocks.len() {
            self.machine.halt(BlockId(at as u32));
            let state = &mut self.machine.blocks[at];
            state.pass_due = false;
            state.first_turn = false;
        }
    }

    /// Sets a cell to its saved value. Call before the first scan.
    pub fn restore(&mut self, cell: Cell, value: i32) {
        match cell {
            Cell::Bit(bit) => self.machine.memory.image.put_bits(bit.0, &[u8::from(value != 0)]),
            Cell::Word(word) => self.machine.memory.image.put_words(word.0, &[value]),
            Cell::WordBit(bit) => {
                self.change_word_bit(bit, value != 0);
            }
        }
    }

    /// Sets `$DownSeconds` for the life of the process. Call before the first scan.
    pub fn put_down_seconds(&mut self, seconds: i32) {
        let word = Word::Space(WordSpace::Dst, dst::DOWN_SECONDS);
        let WordCell(cell) = self.machine.program.layout.word(word);
        self.machine.memory.image.put_words(cell, &[seconds]);
    }

    /// Terminates everything with termination logic. Call before the first scan, if the restored
    /// memory was saved without a termination pass.
    pub fn terminate_all(&mut self) {
        let Machine { program, blocks, stages, callers, .. } = &mut self.machine;
        for (state, code) in blocks.iter_mut().zip(&program.blocks) {
            state.executed = code.own.has_rungs;
        }
        for (state, code) in stages.iter_mut().zip(&program.stages) {
            state.executed = code.has_rungs;
        }
        callers.fill(None);
        self.terminate();
        self.machine.events.clear();
    }

    /// Forces a public bit: it keeps this value until the force is released.
    pub fn force_bit(&mut self, cell: BitCell, on: bool) {
        self.machine.memory.image.force_bit(cell, on);
        self.show_forces();
    }

    /// Forces a public word.
    pub fn force_word(&mut self, cell: WordCell, value: i32) {
        self.machine.memory.image.force_word(cell, value);
        self.show_forces();
    }

    /// Releases a bit's force; the bit keeps its value until it is written.
    pub fn release_bit(&mut self, cell: BitCell) {
        self.machine.memory.image.release_bit(cell);
        self.show_forces();
    }

    /// Releases a word's force.
    pub fn release_word(&mut self, cell: WordCell) {
        self.machine.memory.image.release_word(cell);
        self.show_forces();
    }

    /// Updates `$ForcesActive`, so that it is also correct in STOP, in which no scan begins.
    pub(super) fn show_forces(&mut self) {
        let active = Bit::Space(BitSpace::St, st::FORCES_ACTIVE);
        let BitCell(cell) = self.machine.program.layout.bit(active);
        let on = self.machine.memory.image.forces() > 0;
        self.machine.memory.image.put_bits(cell, &[u8::from(on)]);
    }

    /// The memory.
    pub fn image(&self) -> &Image {
        &self.machine.memory.image
    }

    /// The events of blocks and Stages since `begin_scan` (or in `terminate`).
    pub fn events(&self) -> &[BlockEvent] {
        self.machine.events.list()
    }

    /// The MATHs that had a mishap since `begin_scan`.
    pub fn maths(&self) -> &[MathEvent] {
        self.machine.events.maths()
    }

    /// The number of events that did not fit into the lists.
    pub fn events_dropped(&self) -> u32 {
        self.machine.events.dropped()
    }

    /// The timestamp of the last scan, ns.
    pub fn now_ns(&self) -> u64 {
        self.machine.now_ns
    }

    /// The cell of input `Xn`.
    pub fn input_cell(&self, n: u32) -> BitCell {
        self.machine.program.layout.bit(Bit::Space(BitSpace::X, n))
    }

    /// Whether a block was started and has not had its first turn yet.
    pub fn has_first_turn_due(&self, block: BlockId) -> bool {
        self.machine.blocks[block.0 as usize].first_turn
    }

    /// The element in whose turn a subroutine was executed last.
    pub fn caller(&self, subroutine: BlockId) -> Option<Element> {
        let at = self.machine.program.subroutines.iter().position(|id| *id == subroutine)?;
        self.machine.callers[at]
    }

    /// The program.
    pub fn program(&self) -> &EngineProgram {
        &self.machine.program
    }
}

/// A clock bit: ON for the first half of the period, OFF for the second.
#[inline(always)]
fn first_half(since_start_ns: u64, period_ms: u64) -> bool {
    let period_ns = period_ms * 1_000_000;
    since_start_ns % period_ns < period_ns / 2
}

/// The value of `$ScanCounter` after this number of scans: after 2147483647 it goes on at 0.
fn scan_counter(scans: u64) -> i32 {
    (scans & i32::MAX as u64) as i32
}
