//! A section of the tape: a state, and the entries after it until the next state.
//!
//! `record` makes sections of the tape, stores them and reads them again; `observe` executes them
//! again. The entries of a section contain no state; [`TapeSection::steps`] adds the number and the
//! time of its scan to each entry.

use super::mode::Mode;
use super::origin::Origin;
use super::tape::TapeEntry;
use rungd_engine::{EngineCall, EngineState};

/// A state and the entries after it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TapeSection {
    /// How it begins.
    pub start: SectionStart,
    /// The state at its start.
    pub state: EngineState,
    /// The entries, in order.
    pub entries: Vec<TapeEntry>,
    /// The sender for each origin, for people: `root`, `Modbus client 10.0.0.7`.
    pub who: Vec<(Origin, String)>,
}

/// How a section begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SectionStart {
    /// The number of its program: one more with every reload.
    pub generation: u32,
    /// The number of the next scan; the first of a process is 1.
    pub number: u64,
    /// The mode.
    pub mode: Mode,
    /// The sum of it and a monotonic time is ns since 1970 (UTC).
    pub unix_offset_ns: i64,
    /// The number of steps that were lost right before it.
    pub lost: u64,
    /// Whether it continues where the section before it ended: the same process, and nothing lost.
    /// A swap may be between the two.
    pub follows: bool,
}

/// An entry of a section, with the scan in which it happens.
#[derive(Clone, Copy, Debug)]
pub struct TapeStep {
    /// Its index among the entries.
    pub at: usize,
    /// The entry.
    pub entry: TapeEntry,
    /// The number of the scan that began last; the first of a process is 1.
    pub number: u64,
    /// The timestamp of that scan, ns; before the first scan of the section, that of its start.
    pub now_ns: u64,
}

impl TapeStep {
    /// Whether a scan begins with it.
    pub fn begins_scan(&self) -> bool {
        matches!(self.entry, TapeEntry::Call(EngineCall::Begin { .. }))
    }
}

/// The entries of a section, in order. `number`: that of its first scan; `begin_ns`: the timestamp
/// of its start.
pub fn tape_steps(
    entries: &[TapeEntry],
    number: u64,
    begin_ns: u64,
) -> impl Iterator<Item = TapeStep> + use<'_> {
    let (mut next, mut now_ns) = (number, begin_ns);
    let mut number = next.saturating_sub(1);
    entries.iter().enumerate().map(move |(at, entry)| {
        if let TapeEntry::Number(number) = *entry {
            next = number;
        } else if let TapeEntry::Call(EngineCall::Begin { now_ns: begin_ns, .. }) = *entry {
            (number, now_ns) = (next, begin_ns);
            next = next.saturating_add(1);
        }
        TapeStep { at, entry: *entry, number, now_ns }
    })
}

impl SectionStart {
    /// A timestamp of the scans' clock as ns since 1970 (UTC).
    pub fn unix_ns(&self, now_ns: u64) -> i64 {
        self.unix_offset_ns.saturating_add_unsigned(now_ns)
    }
}

impl TapeSection {
    /// The entries, in order, each with its scan.
    pub fn steps(&self) -> impl Iterator<Item = TapeStep> + use<'_> {
        tape_steps(&self.entries, self.start.number, self.begin_ns())
    }

    /// The entries with which its scans begin, in order.
    pub fn begins(&self) -> impl Iterator<Item = TapeStep> + use<'_> {
        self.steps().filter(TapeStep::begins_scan)
    }

    /// The time at its start, ns of the scans' clock. If no scan of the process came before it: the
    /// time of its first scan.
    pub fn begin_ns(&self) -> u64 {
        let mut begins = tape_steps(&self.entries, 0, 0).filter(TapeStep::begins_scan);
        match self.state.now_ns() {
            0 => begins.next().map_or(0, |first| first.now_ns),
            now_ns => now_ns,
        }
    }
}

/// Whether the controller scans behind some entries, before which it had a mode.
pub fn runs_behind(mode: Mode, entries: &[TapeEntry]) -> bool {
    let mut runs = mode == Mode::Run;
    for entry in entries {
        match entry {
            TapeEntry::Call(EngineCall::Start { .. }) => runs = true,
            TapeEntry::Call(EngineCall::Terminate) => runs = false,
            TapeEntry::Mode(mode) => runs = *mode == Mode::Run,
            TapeEntry::Call(
                EngineCall::RequestStop
                | EngineCall::Begin { .. }
                | EngineCall::Write(..)
                | EngineCall::Execute
                | EngineCall::Force(..)
                | EngineCall::Release(_),
            )
            | TapeEntry::Origin(_)
            | TapeEntry::Number(_)
            | TapeEntry::Swap { .. }
            | TapeEntry::State { .. }
            | TapeEntry::Lost { .. } => {}
        }
    }
    runs
}
