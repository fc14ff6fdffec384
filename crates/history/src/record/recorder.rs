//! The recorder: makes blocks from the entries of the tape, in order.
//!
//! The daemon's thread passes it every entry, with the state that belongs to the entry. A state
//! ends a section and begins the next. Lost entries make a gap: the next section does not follow.
//! Deliberately absent: the use of the blocks.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::block::{BlockHead, RecordBlock, StateHash, hash_of};
use super::codes::ENTRIES_MAX;
use super::program::RecordedProgram;
use super::section::SectionBody;
use super::who::WhoNotes;
use rungd_engine::{EngineCall, EngineState};
use rungd_runtime::exchange::Mode;
use rungd_runtime::{Origin, TapeEntry};

/// A section with this number of entries ends at the next scan: about a second of the busiest
/// plant.
const SECTION_ENTRIES: usize = ENTRIES_MAX / 2;

/// The time on the caller's clocks when the caller takes an entry from the tape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TapeClock {
    /// Now, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// Add it to a monotonic time to get ns since 1970 (UTC).
    pub unix_offset_ns: i64,
}

/// Makes blocks of entries.
pub struct Recorder {
    programs: BTreeMap<u32, Arc<RecordedProgram>>,
    open: Option<OpenSection>,
    /// The number of the next section.
    sequence: u64,
    /// Steps lost since the last section.
    lost: u64,
    /// The tape has a new program, but its first state has not come yet.
    awaits_state: bool,
    who: WhoNotes,
}

/// The section that is being made.
#[derive(Clone)]
struct OpenSection {
    generation: u32,
    /// The bytes of the state at its start; `None`: it is the state at the end of the section
    /// before.
    state: Option<Vec<u8>>,
    follows: bool,
    lost: u64,
    mode: Mode,
    clock: TapeClock,
    number: u64,
    entries: Vec<TapeEntry>,
    /// The mode, and the number of the next scan, after the entries.
    now: (Mode, u64),
    scans: u32,
    /// The times of its first and last scan or start of RUN, monotonic.
    times_ns: Option<(u64, u64)>,
}

impl Recorder {
    /// A recorder for the first program of the process, number 0.
    pub fn new(program: RecordedProgram) -> Recorder {
        let mut recorder = Recorder {
            programs: BTreeMap::new(),
            open: None,
            sequence: 0,
            lost: 0,
            awaits_state: false,
            who: WhoNotes::default(),
        };
        recorder.program(program);
        recorder
    }

    /// Adds a program, before its first state comes. Drops the programs that are older than the
    /// program on the tape.
    pub fn program(&mut self, program: RecordedProgram) {
        let now = self.open.as_ref().map_or(0, |open| open.generation);
        self.programs.retain(|generation, _| *generation >= now);
        self.programs.insert(program.generation, Arc::new(program));
    }

    /// Adds the name of the sender for an origin. Call it before the entry of the origin is taken,
    /// or at most one section later.
    pub fn note(&mut self, origin: Origin, who: impl Into<String>) {
        self.who.note(origin, who.into());
    }

    /// Takes the next entry, with the state that belongs to it; returns the block that the entry
    /// ends.
    pub fn take(
        &mut self,
        entry: TapeEntry,
        state: Option<&EngineState>,
        clock: TapeClock,
    ) -> Option<RecordBlock> {
        match entry {
            TapeEntry::State { generation, number, mode } => {
                let state = state.map(|state| {
                    let mut bytes = Vec::new();
                    state.write(&mut bytes);
                    bytes
                });
                self.state(state, OpenSection::new(generation, number, mode, clock))
            }
            TapeEntry::Lost { steps } => {
                self.lost = self.lost.saturating_add(steps);
                None
            }
            TapeEntry::Call(_)
            | TapeEntry::Origin(_)
            | TapeEntry::Number(_)
            | TapeEntry::Mode(_)
            | TapeEntry::Swap { .. } => {
                if self.awaits_state {
                    // The state of the new program did not come in time.
                    let is_scan = matches!(entry, TapeEntry::Call(EngineCall::Begin { .. }));
                    self.lost = self.lost.saturating_add(u64::from(is_scan));
                    return None;
                }
                self.awaits_state = matches!(entry, TapeEntry::Swap { .. });
                let block = self.split(entry, clock);
                if let Some(open) = &mut self.open {
                    open.take(entry);
                }
                block
            }
        }
    }

    /// Ends the section here without a state, so that it can be written to the disk. The next
    /// section continues from its end. Call it when the tape is empty.
    pub fn flush(&mut self, clock: TapeClock) -> Option<RecordBlock> {
        let is_due = |open: &&OpenSection| !open.entries.is_empty() && !self.awaits_state;
        let open = self.open.as_ref().filter(is_due)?;
        let (mode, number) = open.now;
        let mut next = OpenSection::new(open.generation, number, mode, clock);
        let block = self.close(None);
        next.follows = block.is_some();
        // Without a block, the next section has no state to continue from.
        self.open = block.is_some().then_some(next);
        block
    }

    /// The current section as a block, for a reader. The section continues; its final block has the
    /// same number. Call it when the tape is empty.
    pub fn under_way(&self) -> Option<RecordBlock> {
        let is_due = |open: &&OpenSection| !open.entries.is_empty() && !self.awaits_state;
        let open = self.open.as_ref().filter(is_due)?;
        self.block(open.clone(), None, &mut self.who.clone())
    }

    fn state(&mut self, state: Option<Vec<u8>>, mut next: OpenSection) -> Option<RecordBlock> {
        let lost = std::mem::take(&mut self.lost);
        self.awaits_state = false;
        let hash = state.as_deref().map(hash_of).filter(|_| lost == 0);
        let block = self.close(hash);
        next.follows = lost == 0 && block.is_some();
        next.lost = lost;
        self.open = state.map(|state| OpenSection { state: Some(state), ..next });
        block
    }

    /// Ends the section before this entry, if it is long enough.
    fn split(&mut self, entry: TapeEntry, clock: TapeClock) -> Option<RecordBlock> {
        let entries = &self.open.as_ref()?.entries;
        let begins = match entry {
            TapeEntry::Number(_) => true,
            TapeEntry::Call(EngineCall::Begin { .. }) => {
                !matches!(entries.last(), Some(TapeEntry::Number(_)))
            }
            TapeEntry::Call(_)
            | TapeEntry::Origin(_)
            | TapeEntry::Mode(_)
            | TapeEntry::Swap { .. }
            | TapeEntry::State { .. }
            | TapeEntry::Lost { .. } => false,
        };
        let is_due = entries.len() >= SECTION_ENTRIES && begins || entries.len() == ENTRIES_MAX;
        if is_due { self.flush(clock) } else { None }
    }

    /// Makes a block from the open section; `None` if its program is unknown.
    fn close(&mut self, hash: Option<StateHash>) -> Option<RecordBlock> {
        let open = self.open.take()?;
        let mut who = std::mem::take(&mut self.who);
        let block = self.block(open, hash, &mut who);
        self.who = who;
        self.sequence += u64::from(block.is_some());
        block
    }

    fn block(
        &self,
        open: OpenSection,
        hash: Option<StateHash>,
        who: &mut WhoNotes,
    ) -> Option<RecordBlock> {
        let program = self.programs.get(&open.generation)?.clone();
        let swapped = open.entries.iter().any(|entry| matches!(entry, TapeEntry::Swap { .. }));
        let unix_ns = |time_ns| open.clock.unix_offset_ns.saturating_add_unsigned(time_ns);
        let times = open.times_ns.map(|(first, last)| (unix_ns(first), unix_ns(last)));
        let (begin_ns, end_ns) = times.unwrap_or((open.clock.unix_ns, open.clock.unix_ns));
        let head = BlockHead {
            sequence: self.sequence,
            number: open.number,
            scans: open.scans,
            begin_ns,
            end_ns,
            follows: open.follows,
            end_hash: hash.filter(|_| !swapped),
        };
        let section = SectionBody {
            mode: open.mode,
            unix_offset_ns: open.clock.unix_offset_ns,
            lost: open.lost,
            who: who.of_section(&open.entries),
            entries: open.entries,
        };
        Some(RecordBlock::new(program, head, open.state.as_deref(), &section))
    }
}

impl OpenSection {
    fn new(generation: u32, number: u64, mode: Mode, clock: TapeClock) -> OpenSection {
        OpenSection {
            generation,
            state: None,
            follows: false,
            lost: 0,
            mode,
            clock,
            number,
            entries: Vec::new(),
            now: (mode, number),
            scans: 0,
            times_ns: None,
        }
    }

    fn take(&mut self, entry: TapeEntry) {
        self.entries.push(entry);
        match entry {
            TapeEntry::Number(number) => self.now.1 = number,
            TapeEntry::Mode(mode) => self.now.0 = mode,
            TapeEntry::Call(EngineCall::Start { now_ns }) => self.passes(now_ns),
            TapeEntry::Call(EngineCall::Begin { now_ns, .. }) => {
                self.passes(now_ns);
                self.now.1 = self.now.1.wrapping_add(1);
                self.scans = self.scans.saturating_add(1);
            }
            TapeEntry::Call(_)
            | TapeEntry::Origin(_)
            | TapeEntry::Swap { .. }
            | TapeEntry::State { .. }
            | TapeEntry::Lost { .. } => {}
        }
    }

    fn passes(&mut self, now_ns: u64) {
        let first = self.times_ns.map_or(now_ns, |(first, _)| first);
        self.times_ns = Some((first, now_ns));
    }
}
