//! A section of the tape: a state, and the entries after it until the next state.
//!
//! `record` makes sections of the tape, stores them and reads them again; `observe` executes them
//! again. The entries of a section contain no state; [`numbered_calls`] adds the number of its scan
//! to each call.

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

/// A call of a section, with the scan in which it is made.
#[derive(Clone, Copy, Debug)]
pub struct NumberedCall {
    /// Its entry.
    pub entry: usize,
    /// The call.
    pub call: EngineCall,
    /// The number of the scan that began last; the first of a process is 1.
    pub number: u64,
    /// The timestamp of that scan, ns; 0 before the first scan of the section.
    pub now_ns: u64,
}

/// The calls of a section, in order. `number`: the number of its first scan.
pub fn numbered_calls(
    entries: &[TapeEntry],
    number: u64,
) -> impl Iterator<Item = NumberedCall> + use<'_> {
    let (mut next, mut number, mut now_ns) = (number, number.saturating_sub(1), 0);
    entries.iter().enumerate().filter_map(move |(entry, of)| {
        let call = match *of {
            TapeEntry::Call(call) => call,
            TapeEntry::Number(number) => {
                next = number;
                return None;
            }
            TapeEntry::Origin(_)
            | TapeEntry::Mode(_)
            | TapeEntry::Swap { .. }
            | TapeEntry::State { .. }
            | TapeEntry::Lost { .. } => return None,
        };
        if let EngineCall::Begin { now_ns: begin_ns, .. } = call {
            (number, now_ns) = (next, begin_ns);
            next = next.saturating_add(1);
        }
        Some(NumberedCall { entry, call, number, now_ns })
    })
}

impl TapeSection {
    /// The time at its start, ns of the scans' clock. If no scan of the process came before it: the
    /// time of its first scan.
    pub fn begin_ns(&self) -> u64 {
        let mut begins = scan_begins(&self.entries, self.start.number);
        match self.state.now_ns() {
            0 => begins.next().map_or(0, |first| first.now_ns),
            now_ns => now_ns,
        }
    }
}

/// The starts of scans in a section, in order. `number`: the number of its first scan.
pub fn scan_begins(
    entries: &[TapeEntry],
    number: u64,
) -> impl Iterator<Item = NumberedCall> + use<'_> {
    numbered_calls(entries, number).filter(|of| matches!(of.call, EngineCall::Begin { .. }))
}
