//! Reads the entries of a section from its bytes: the inverse of `section`.
//!
//! Bytes from outside never cause a panic, and the result has at most `ENTRIES_MAX` entries.

use super::codes::{ENTRIES_MAX, code, scan_flag};
use super::foretold::Expectations;
use super::quiet::{self, QuietScan};
use super::section::SectionBody;
use rungd_base::byte_source::ByteSource;
use rungd_engine::{BitCell, Cell, EngineCall, ScanTimes, TIME_END_NS, WordCell};
use rungd_language::source::wording::escaped;
use rungd_runtime::command::CommandId;
use rungd_runtime::exchange::{FaultReason, Mode, StopReason, Ticket};
use rungd_runtime::{Origin, TapeEntry};

impl SectionBody {
    /// Reads a section that fills all of `bytes`; `None`: these bytes are not a section.
    pub fn read(bytes: &[u8]) -> Option<SectionBody> {
        let mut bytes = ByteSource(bytes);
        let mode = mode(&mut bytes)?;
        let unix_offset_ns = bytes.signed()?;
        let lost = bytes.number()?;
        let mut who = Vec::new();
        for _ in 0..bytes.number().filter(|count| *count <= ENTRIES_MAX as u64)? {
            let (kind, number) = (bytes.byte()?, bytes.number()?);
            // The name is printed in lines of a report.
            who.push((origin(kind, number)?, escaped(&bytes.text()?).into_owned()));
        }
        let foretold = Expectations::read(&mut bytes)?;
        let mut reader = EntryReader { bytes, foretold, entries: Vec::new() };
        while !reader.bytes.0.is_empty() {
            reader.entry()?;
            if reader.entries.len() > ENTRIES_MAX {
                return None;
            }
        }
        Some(SectionBody { mode, unix_offset_ns, lost, who, entries: reader.entries })
    }
}

fn origin(kind: u8, number: u64) -> Option<Origin> {
    match kind {
        0 if number == 0 => Some(Origin::Inputs),
        1 => number.try_into().ok().map(Origin::Device),
        2 => Some(Origin::Batch(Ticket(number))),
        3 => Some(Origin::Command(CommandId(number))),
        _ => None,
    }
}

fn mode(bytes: &mut ByteSource<'_>) -> Option<Mode> {
    Some(match bytes.byte()? {
        0 => Mode::Run,
        1 => Mode::Stop(StopReason::NotStarted),
        2 => Mode::Stop(StopReason::Instruction),
        3 => Mode::Stop(StopReason::Signal),
        4 => Mode::Stop(StopReason::ScanLimit),
        5 => Mode::Stop(StopReason::Operator),
        6 => Mode::Stop(StopReason::CommandLine),
        7 => Mode::Stop(StopReason::RestartGuard),
        8 => Mode::Stop(StopReason::NothingRestored),
        16 => Mode::Fault(FaultReason::ScanTooLong { scan_us: bytes.small()? }),
        17 => Mode::Fault(FaultReason::ScanNeverEnds),
        18 => Mode::Fault(FaultReason::ScanNeverBegins),
        19 => Mode::Fault(FaultReason::EnginePanic),
        20 => Mode::Fault(FaultReason::ScanThreadGone),
        _ => return None,
    })
}

/// A time, if it is less than `TIME_END_NS`.
fn time_ns(time_ns: u64) -> Option<u64> {
    (time_ns < TIME_END_NS).then_some(time_ns)
}

/// The bytes that are left, and the entries so far.
struct EntryReader<'b> {
    bytes: ByteSource<'b>,
    foretold: Expectations,
    entries: Vec<TapeEntry>,
}

impl EntryReader<'_> {
    fn entry(&mut self) -> Option<()> {
        let first = self.bytes.byte()?;
        let entry = match first {
            ..code::SCAN => {
                let deviation_us = i64::from(first >> 1) ^ -i64::from(first & 1);
                return self.scan(scan_flag::EXECUTES, deviation_us);
            }
            code::SCAN => {
                let flags = self.bytes.byte()?;
                let deviation_us = self.bytes.signed()?;
                return self.scan(flags, deviation_us);
            }
            code::QUIET => {
                let scans = quiet::read(&mut self.bytes, self.foretold.times.last_us)?;
                return scans.into_iter().try_for_each(|scan| self.quiet(scan));
            }
            code::ORIGIN => TapeEntry::Origin(self.origin()?),
            code::NUMBER => TapeEntry::Number(self.bytes.number()?),
            code::MODE => TapeEntry::Mode(mode(&mut self.bytes)?),
            code::SWAP => TapeEntry::Swap { generation: self.bytes.small()? },
            code::LOST => TapeEntry::Lost { steps: self.bytes.number()? },
            other => TapeEntry::Call(self.call(other)?),
        };
        self.entries.push(entry);
        Some(())
    }

    fn origin(&mut self) -> Option<Origin> {
        let kind = self.bytes.byte()?;
        let change = self.bytes.signed()?;
        let number = self.foretold.origins.get_mut(usize::from(kind))?;
        *number = number.wrapping_add(change as u64);
        origin(kind, *number)
    }

    fn scan(&mut self, flags: u8, deviation_us: i64) -> Option<()> {
        let bytes = &mut self.bytes;
        let has = |flag| flags & flag != 0;
        let now_us = self.foretold.at_deviation(deviation_us);
        let last_us = i64::from(self.foretold.times.last_us).checked_add(bytes.signed()?)?;
        let ScanTimes { mut mean_us, mut min_us, mut max_us, last_us } =
            self.foretold.times_after(last_us.try_into().ok()?);
        if has(scan_flag::MEAN) {
            mean_us = i64::from(mean_us).checked_add(bytes.signed()?)?.try_into().ok()?;
        }
        if has(scan_flag::EXTREMES) {
            (min_us, max_us) = (bytes.small_signed()?, bytes.small_signed()?);
        }
        let local_change = if has(scan_flag::LOCAL) { bytes.signed()? } else { 0 };
        let ns = if has(scan_flag::NANOSECONDS) { bytes.number()? } else { 0 };
        let times = ScanTimes { mean_us, min_us, max_us, last_us };
        let local_s = self.foretold.local_s(now_us).wrapping_add(local_change);
        let now_ns = time_ns(now_us.checked_mul(1000)?.checked_add(ns)?)?;
        self.foretold.scan(now_us, times);
        self.entries.push(TapeEntry::Call(EngineCall::Begin { now_ns, times, local_s }));
        if has(scan_flag::EXECUTES) {
            self.entries.push(TapeEntry::Call(EngineCall::Execute));
        }
        (ns < 1000 && flags < scan_flag::EXECUTES << 1).then_some(())
    }

    fn quiet(&mut self, scan: QuietScan) -> Option<()> {
        let now_us = self.foretold.at_deviation(scan.deviation_us);
        let times = self.foretold.times_after(scan.last_us);
        let now_ns = time_ns(now_us.checked_mul(1000)?)?;
        let local_s = self.foretold.local_s(now_us);
        self.foretold.scan(now_us, times);
        self.entries.push(TapeEntry::Call(EngineCall::Begin { now_ns, times, local_s }));
        self.entries.push(TapeEntry::Call(EngineCall::Execute));
        Some(())
    }

    fn call(&mut self, first: u8) -> Option<EngineCall> {
        Some(match first {
            code::EXECUTE => EngineCall::Execute,
            code::START => EngineCall::Start { now_ns: time_ns(self.bytes.number()?)? },
            code::REQUEST_STOP => EngineCall::RequestStop,
            code::TERMINATE => EngineCall::Terminate,
            code::BIT_OFF => EngineCall::Write(self.cell(false)?, 0),
            code::BIT_ON => EngineCall::Write(self.cell(false)?, 1),
            code::WORD => {
                let (cell, value) = self.word()?;
                EngineCall::Write(cell, value)
            }
            code::FORCE_OFF => EngineCall::Force(self.cell(false)?, 0),
            code::FORCE_ON => EngineCall::Force(self.cell(false)?, 1),
            code::FORCE_WORD => {
                let (cell, value) = self.word()?;
                EngineCall::Force(cell, value)
            }
            code::RELEASE_BIT => EngineCall::Release(self.cell(false)?),
            code::RELEASE_WORD => EngineCall::Release(self.cell(true)?),
            _ => return None,
        })
    }

    fn cell(&mut self, is_word: bool) -> Option<Cell> {
        let last = i64::from(self.foretold.last_cell(is_word));
        let number = last.checked_add(self.bytes.signed()?)?.try_into().ok()?;
        let cell = if is_word { Cell::Word(WordCell(number)) } else { Cell::Bit(BitCell(number)) };
        self.foretold.cell(cell);
        Some(cell)
    }

    fn word(&mut self) -> Option<(Cell, i32)> {
        let cell = self.cell(true)?;
        let number = self.foretold.last_cell(true);
        let before = i64::from(self.foretold.last_value(number));
        let value = before.checked_add(self.bytes.signed()?)?.try_into().ok()?;
        self.foretold.value(number, value);
        Some((cell, value))
    }
}
