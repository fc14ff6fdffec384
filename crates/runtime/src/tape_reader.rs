//! The reader's end of the tape, for an ordinary thread: entries in order, each state with its
//! entry.
//!
//! The reader decides how fast it reads; a slow reader loses whole steps, never parts of a step.
//! The states that it gives back are filled again. Everything is allocated here, at the start.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rtrb::{Consumer, Producer, RingBuffer};

use super::mode::{Mode, StopReason};
use super::origin::Origin;
use super::tape::{HandedState, SPARE_STATES, STEP_ENTRIES_MAX, Tape, TapeEntry, Taped};
use rungd_engine::{Engine, EngineState};

/// The number of entries between the two ends: some seconds of a busy plant.
const ENTRIES: usize = 4 * STEP_ENTRIES_MAX;

/// The reader's end of a tape.
pub struct TapeReader {
    entries: Consumer<TapeEntry>,
    states: Consumer<HandedState>,
    spares: Producer<Box<EngineState>>,
    unheard: Arc<AtomicU64>,
}

/// Gives an engine a tape, which begins with its present state. Call before the first scan.
pub fn tape(engine: Engine) -> (Taped, TapeReader) {
    tape_of(engine, ENTRIES)
}

/// Does the same as [`tape`], with room for `entries` entries.
pub fn tape_of(engine: Engine, entries: usize) -> (Taped, TapeReader) {
    let (mut entry_in, entries) = RingBuffer::new(entries);
    let (mut state_in, states) = RingBuffer::new(4 * SPARE_STATES);
    let (mut spare_in, spares) = RingBuffer::new(2 * SPARE_STATES);
    for _ in 0..SPARE_STATES {
        let _ = spare_in.push(Box::new(EngineState::of(&engine)));
    }
    let _ = state_in.push(HandedState::State(Box::new(EngineState::of(&engine))));
    let mode = Mode::Stop(StopReason::NotStarted);
    let unheard = Arc::new(AtomicU64::new(0));
    let _ = entry_in.push(TapeEntry::State { generation: 0, number: 1, mode });
    let tape = Tape {
        entries: entry_in,
        states: state_in,
        spares,
        step: Vec::with_capacity(STEP_ENTRIES_MAX),
        overflow: false,
        lost: 0,
        unheard: Arc::clone(&unheard),
        needs_state: false,
        next_state_ns: 0,
        number: 1,
        generation: 0,
        mode,
        origin: (Origin::Inputs, false),
        broken: false,
    };
    (Taped::with_tape(engine, tape), TapeReader { entries, states, spares: spare_in, unheard })
}

impl TapeReader {
    /// The next entry, with the state that belongs to a [`TapeEntry::State`].
    pub fn take(&mut self) -> Option<(TapeEntry, Option<Box<EngineState>>)> {
        let entry = self.entries.pop().ok()?;
        let state = match entry {
            TapeEntry::State { .. } => self.state(),
            TapeEntry::Call(_)
            | TapeEntry::Origin(_)
            | TapeEntry::Number(_)
            | TapeEntry::Mode(_)
            | TapeEntry::Swap { .. }
            | TapeEntry::Lost { .. } => None,
        };
        Some((entry, state))
    }

    fn state(&mut self) -> Option<Box<EngineState>> {
        loop {
            match self.states.pop().ok()? {
                HandedState::State(state) => return Some(state),
                HandedState::Outlived(state) => drop(state),
            }
        }
    }

    /// Gives a state back, to be filled again.
    pub fn give_back(&mut self, state: Box<EngineState>) {
        // A full ring has enough spares: this one is dropped.
        let _ = self.spares.push(state);
    }

    /// The number of steps that were lost at the end of the tape, which no entry reports. To be
    /// read after the scan thread has ended.
    pub fn unheard(&self) -> u64 {
        self.unheard.load(Ordering::Relaxed)
    }

    /// Whether no further entry comes: the scan thread has ended, and all its entries were read.
    pub fn is_over(&self) -> bool {
        self.entries.is_abandoned() && self.entries.is_empty()
    }
}
