//! Writes the entries of a section as bytes. Most entries differ little from the expectation.
//!
//! `block` packs the bytes and puts them into a segment; `section_read` reads them.
//! `docs/record-format.md` describes them under *Entries*. A quiet scan takes less than two bytes:
//! the deviation of its time from the expected time, and the scan time before it (`quiet`).

use super::codes::{code, scan_flag};
use super::foretold::{Expectations, NEAR};
use super::quiet::{QuietRun, QuietScan};
use rungd_base::byte_source::{put_number, put_signed, put_text};
use rungd_engine::{BitCell, Cell, EngineCall, ScanTimes, WordCell};
use rungd_runtime::exchange::{FaultReason, Mode, StopReason};
use rungd_runtime::{Origin, TapeEntry};

/// The content of a section, without its state and its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SectionBody {
    /// The mode at its start.
    pub mode: Mode,
    /// Add it to a monotonic time to get ns since 1970 (UTC).
    pub unix_offset_ns: i64,
    /// The number of steps that were lost right before it.
    pub lost: u64,
    /// The names of the senders for origins of this section or of the section before it.
    pub who: Vec<(Origin, String)>,
    /// The entries: at most `ENTRIES_MAX`, without states.
    pub entries: Vec<TapeEntry>,
}

impl SectionBody {
    /// The section as bytes.
    pub fn write(&self) -> Vec<u8> {
        let mut out = Vec::new();
        put_mode(&mut out, self.mode);
        put_signed(&mut out, self.unix_offset_ns);
        put_number(&mut out, self.lost);
        put_number(&mut out, self.who.len() as u64);
        for (origin, who) in &self.who {
            let (kind, number) = numbered(*origin);
            out.push(kind);
            put_number(&mut out, number);
            put_text(&mut out, who);
        }
        let quiet = QuietRun::default();
        let mut writer = EntryWriter { foretold: foretold(&self.entries), out, quiet };
        writer.foretold.put(&mut writer.out);
        let mut entries = self.entries.as_slice();
        while let Some((entry, rest)) = entries.split_first() {
            entries = writer.entry(entry, rest);
        }
        writer.quiet.put(&mut writer.out);
        writer.out
    }
}

/// The origin's kind and number.
pub(super) fn numbered(origin: Origin) -> (u8, u64) {
    match origin {
        Origin::Inputs => (0, 0),
        Origin::Device(number) => (1, number.into()),
        Origin::Batch(ticket) => (2, ticket.0),
        Origin::Command(id) => (3, id.0),
    }
}

fn put_mode(out: &mut Vec<u8>, mode: Mode) {
    let number = match mode {
        Mode::Run => 0,
        Mode::Stop(StopReason::NotStarted) => 1,
        Mode::Stop(StopReason::Instruction) => 2,
        Mode::Stop(StopReason::Signal) => 3,
        Mode::Stop(StopReason::ScanLimit) => 4,
        Mode::Stop(StopReason::Operator) => 5,
        Mode::Stop(StopReason::CommandLine) => 6,
        Mode::Stop(StopReason::RestartGuard) => 7,
        Mode::Stop(StopReason::NothingRestored) => 8,
        Mode::Fault(FaultReason::ScanTooLong { .. }) => 16,
        Mode::Fault(FaultReason::ScanNeverEnds) => 17,
        Mode::Fault(FaultReason::ScanNeverBegins) => 18,
        Mode::Fault(FaultReason::EnginePanic) => 19,
        Mode::Fault(FaultReason::ScanThreadGone) => 20,
    };
    out.push(number);
    if let Mode::Fault(FaultReason::ScanTooLong { scan_us }) = mode {
        put_number(out, scan_us.into());
    }
}

/// The times of the scans, in order, ns, with local time.
fn scans(entries: &[TapeEntry]) -> impl Iterator<Item = (u64, i64)> {
    entries.iter().filter_map(|entry| match entry.call()? {
        EngineCall::Begin { now_ns, local_s, .. } => Some((now_ns, local_s)),
        EngineCall::Start { .. }
        | EngineCall::RequestStop
        | EngineCall::Write(..)
        | EngineCall::Execute
        | EngineCall::Terminate
        | EngineCall::Force(..)
        | EngineCall::Release(_) => None,
    })
}

/// The expectations that fit these entries best.
fn foretold(entries: &[TapeEntry]) -> Expectations {
    let times: Vec<u64> = scans(entries).map(|(now_ns, _)| now_ns / 1000).collect();
    let period_us = period_us(&times);
    let grid_us = times.first().map_or(0, |first| first.wrapping_sub(period_us));
    Expectations::new(period_us, grid_us, local_offset_us(entries))
}

/// The mean time between scans, without unusual gaps.
fn period_us(times: &[u64]) -> u64 {
    let mut gaps: Vec<u64> = times.windows(2).map(|pair| pair[1].wrapping_sub(pair[0])).collect();
    if gaps.is_empty() {
        return 0;
    }
    let middle = gaps.len() / 2;
    let usual = *gaps.select_nth_unstable(middle).1;
    let near = gaps.iter().filter(|gap| gap.abs_diff(usual) < 500);
    let (sum, count) = near.fold((0, 0), |(sum, count), gap| (sum + u128::from(*gap), count + 1));
    ((sum + count / 2) / count) as u64
}

/// The offset of local time that fits as many of the first scans as possible.
fn local_offset_us(entries: &[TapeEntry]) -> i64 {
    let (mut low, mut high) = (i128::MIN, i128::MAX);
    for (now_ns, local_s) in scans(entries) {
        let least = i128::from(local_s) * 1_000_000 - i128::from(now_ns / 1000);
        let most = least + 999_999;
        if least > high || most < low {
            break;
        }
        (low, high) = (low.max(least), high.min(most));
    }
    i64::try_from(low).unwrap_or(0)
}

/// The bytes of the entries so far, and the expectation of the next entry.
struct EntryWriter {
    out: Vec<u8>,
    foretold: Expectations,
    /// The quiet scans right after these bytes.
    quiet: QuietRun,
}

impl EntryWriter {
    /// Writes an entry, and perhaps the next one with it; returns the entries that are left.
    fn entry<'e>(&mut self, entry: &TapeEntry, rest: &'e [TapeEntry]) -> &'e [TapeEntry] {
        if !matches!(entry, TapeEntry::Call(EngineCall::Begin { .. })) {
            self.quiet.put(&mut self.out);
        }
        match *entry {
            TapeEntry::Call(EngineCall::Begin { now_ns, times, local_s }) => {
                let executes = rest.first() == Some(&TapeEntry::Call(EngineCall::Execute));
                self.scan(now_ns, times, local_s, executes);
                return &rest[usize::from(executes)..];
            }
            TapeEntry::Call(call) => self.call(call),
            TapeEntry::Origin(origin) => {
                let (kind, number) = numbered(origin);
                let last = &mut self.foretold.origins[usize::from(kind)];
                let change = number.wrapping_sub(std::mem::replace(last, number));
                self.out.extend([code::ORIGIN, kind]);
                put_signed(&mut self.out, change as i64);
            }
            TapeEntry::Number(number) => self.numbered(code::NUMBER, number),
            TapeEntry::Mode(mode) => {
                self.out.push(code::MODE);
                put_mode(&mut self.out, mode);
            }
            TapeEntry::Swap { generation } => self.numbered(code::SWAP, generation.into()),
            TapeEntry::Lost { steps } => self.numbered(code::LOST, steps),
            // A state is never among the entries of a section.
            TapeEntry::State { .. } => {}
        }
        rest
    }

    fn numbered(&mut self, code: u8, number: u64) {
        self.out.push(code);
        put_number(&mut self.out, number);
    }

    fn scan(&mut self, now_ns: u64, times: ScanTimes, local_s: i64, executes: bool) {
        let (now_us, ns) = (now_ns / 1000, now_ns % 1000);
        let foretold = &self.foretold;
        let deviation_us = foretold.deviation_us(now_us);
        let change_us = i64::from(times.last_us) - i64::from(foretold.times.last_us);
        let expected = foretold.times_after(times.last_us);
        let local_change = local_s.wrapping_sub(foretold.local_s(now_us));
        let extremes = (times.min_us, times.max_us) != (expected.min_us, expected.max_us);
        let mean_change = i64::from(times.mean_us) - i64::from(expected.mean_us);
        let flags = [
            (mean_change != 0, scan_flag::MEAN),
            (extremes, scan_flag::EXTREMES),
            (local_change != 0, scan_flag::LOCAL),
            (ns != 0, scan_flag::NANOSECONDS),
            (executes, scan_flag::EXECUTES),
        ];
        let flags = flags.iter().filter(|(is, _)| *is).fold(0, |all, (_, flag)| all | flag);
        let scan = QuietScan { deviation_us, last_us: times.last_us };
        let before_us = foretold.times.last_us;
        let is_quiet = flags == scan_flag::EXECUTES && NEAR.contains(&deviation_us);
        if !is_quiet || !self.quiet.takes(scan, before_us) {
            self.quiet.put(&mut self.out);
            // An empty run accepts every quiet scan.
            let _ = is_quiet && self.quiet.takes(scan, before_us);
        }
        let out = &mut self.out;
        if !is_quiet {
            out.extend([code::SCAN, flags]);
            put_signed(out, deviation_us);
            put_signed(out, change_us);
            if mean_change != 0 {
                put_signed(out, mean_change);
            }
            if extremes {
                put_signed(out, times.min_us.into());
                put_signed(out, times.max_us.into());
            }
            if local_change != 0 {
                put_signed(out, local_change);
            }
            if ns != 0 {
                put_number(out, ns);
            }
        }
        self.foretold.scan(now_us, times);
    }

    fn call(&mut self, call: EngineCall) {
        let by_bit = |value, off, on| if value == 0 { off } else { on };
        match call {
            // It is written with the entry after it.
            EngineCall::Begin { .. } => {}
            EngineCall::Execute => self.out.push(code::EXECUTE),
            EngineCall::Start { now_ns } => self.numbered(code::START, now_ns),
            EngineCall::RequestStop => self.out.push(code::REQUEST_STOP),
            EngineCall::Terminate => self.out.push(code::TERMINATE),
            EngineCall::Write(cell @ Cell::Bit(_), value) => {
                self.cell(by_bit(value, code::BIT_OFF, code::BIT_ON), cell);
            }
            EngineCall::Write(cell @ Cell::Word(_), value) => self.word(code::WORD, cell, value),
            EngineCall::Force(cell @ Cell::Bit(_), value) => {
                self.cell(by_bit(value, code::FORCE_OFF, code::FORCE_ON), cell);
            }
            EngineCall::Force(cell @ Cell::Word(_), value) => {
                self.word(code::FORCE_WORD, cell, value);
            }
            EngineCall::Release(cell @ Cell::Bit(_)) => self.cell(code::RELEASE_BIT, cell),
            EngineCall::Release(cell @ Cell::Word(_)) => self.cell(code::RELEASE_WORD, cell),
            EngineCall::Write(Cell::WordBit(_), _)
            | EngineCall::Force(Cell::WordBit(_), _)
            | EngineCall::Release(Cell::WordBit(_)) => {
                unreachable!("the scan thread writes a bit of a word as its word")
            }
        }
    }

    fn cell(&mut self, code: u8, cell: Cell) {
        let number = match cell {
            Cell::Bit(BitCell(number)) | Cell::Word(WordCell(number)) => number,
            Cell::WordBit(_) => unreachable!("the calls before have whole words alone"),
        };
        let change = i64::from(number) - i64::from(self.foretold.cell(cell));
        self.out.push(code);
        put_signed(&mut self.out, change);
    }

    fn word(&mut self, code: u8, cell: Cell, value: i32) {
        self.cell(code, cell);
        let before = self.foretold.value(self.foretold.last_cell(true), value);
        put_signed(&mut self.out, i64::from(value) - i64::from(before));
    }
}
