//! Messages of the scan thread to the log: small records through a ring that never blocks it.
//!
//! The scan thread writes numbers; the reader of the ring converts them to names and sentences. If
//! the reader is too slow, records are dropped and counted. Alarms and logged tags are compared
//! here in every scan, so the log misses no change and contains how long a bit was ON.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rtrb::{Consumer, Producer, RingBuffer};

use super::exchange::Mode;
use super::machine::ImageCells;
use super::statistics::Statistics;
use rungd_engine::{BitCell, BlockEvent, MathEvent, WordBitCell, WordCell};

/// The greatest number of records that wait for their reader; further ones are dropped.
const RECORDS_MAX: usize = 4096;
/// The same limit for reports of statistics, which come every few seconds at most.
const REPORTS_MAX: usize = 4;
/// Overruns after the first are summed up over this time.
const OVERRUN_SUMMARY_NS: u64 = 10_000_000_000;

/// An event and its scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanRecord {
    /// The number of the scan; the first scan of the process is 1.
    pub scan: u64,
    /// CLOCK_MONOTONIC.
    pub at_ns: u64,
    /// The event.
    pub what: RecordEvent,
}

/// For each watch of the new program, the watch of the old program that it continues.
#[derive(Clone, Debug, Default)]
#[allow(missing_docs)]
pub struct CarriedWatches {
    pub bits: Vec<Option<u32>>,
    pub words: Vec<Option<u32>>,
}

/// The event of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum RecordEvent {
    /// The mode changed.
    Mode(Mode),
    /// The event of a block or Stage.
    Block(BlockEvent),
    /// A MATH had a mishap.
    Math(MathEvent),
    /// The number of events of blocks in this scan that could not be reported.
    EventsLost(u32),
    /// A change of a watched bit (its position in [`WatchedCells::bits`], and behind these in
    /// `word_bits`), with the duration of its old state.
    Bit { watch: u32, on: bool, after_ns: u64 },
    /// A swap: the numbers in all later records belong to the new program.
    Swapped { generation: u32, swap_ns: u64 },
    /// The event of a field device (its number).
    Device { device: u32, edge: DeviceEdge },
    /// A change of a watched word (its position in [`WatchedCells::words`]).
    Word { watch: u32, from: i32, to: i32 },
    /// Scans that ended after the next grid point since the last such record, because they took
    /// long or began late.
    Overruns { count: u32, skipped: u64, scan_ns_max: u64, late_ns_max: u64 },
}

/// The event of a field device, as the scan sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceEdge {
    /// Its first good exchange.
    Present,
    /// No first exchange came within its `loss-after`.
    Absent,
    /// Its last good exchange is too long ago.
    Lost,
    /// It exchanges data again.
    Back {
        /// The time for which it was lost.
        lost_ns: u64,
        /// The scans in that time.
        scans: u64,
    },
}

/// The cells of which the log reports every change: alarms and tags with `log = "change"`.
#[derive(Clone, Debug, Default)]
#[allow(missing_docs)]
pub struct WatchedCells {
    pub bits: Vec<BitCell>,
    pub words: Vec<WordCell>,
    /// Bits of words: their watches follow those of `bits`.
    pub word_bits: Vec<WordBitCell>,
}

/// The scan thread's end.
pub(super) struct Journal {
    records: Producer<ScanRecord>,
    reports: Producer<Statistics>,
    dropped: Arc<AtomicU64>,
    /// A swap for which the ring had no place. It must come before every further record, because
    /// these have the numbers of the new program.
    untold: Option<ScanRecord>,
}

/// The reader's end.
pub(super) struct JournalReader {
    pub records: Consumer<ScanRecord>,
    pub reports: Consumer<Statistics>,
    pub dropped: Arc<AtomicU64>,
}

pub(super) fn journal() -> (Journal, JournalReader) {
    let (records, record_out) = RingBuffer::new(RECORDS_MAX);
    let (reports, report_out) = RingBuffer::new(REPORTS_MAX);
    let dropped = Arc::new(AtomicU64::new(0));
    let reader =
        JournalReader { records: record_out, reports: report_out, dropped: Arc::clone(&dropped) };
    (Journal { records, reports, dropped, untold: None }, reader)
}

impl Journal {
    pub fn push(&mut self, scan: u64, at_ns: u64, what: RecordEvent) {
        let record = ScanRecord { scan, at_ns, what };
        if let RecordEvent::Swapped { .. } = record.what {
            self.untold = Some(record);
            return self.catch_up();
        }
        self.catch_up();
        if self.untold.is_some() || self.records.push(record).is_err() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Tells the last swap if the ring had no place for it.
    pub fn catch_up(&mut self) {
        if let Some(record) = self.untold.take() {
            self.untold =
                self.records.push(record).err().map(|rtrb::PushError::Full(record)| record);
        }
    }

    pub fn report(&mut self, statistics: Statistics) {
        if self.reports.push(statistics).is_err() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// The last states of the watched cells.
pub(super) struct Watches {
    bits: Vec<(BitCell, bool, u64)>,
    word_bits: Vec<(WordBitCell, bool, u64)>,
    words: Vec<(WordCell, i32)>,
}

impl Watches {
    /// Begins with the memory of a cold start; an alarm that is ON in it is reported.
    pub fn new(watched: &WatchedCells, words: &[i32], now_ns: u64) -> Watches {
        Watches {
            bits: watched.bits.iter().map(|cell| (*cell, false, now_ns)).collect(),
            word_bits: watched.word_bits.iter().map(|cell| (*cell, false, now_ns)).collect(),
            words: watched.words.iter().map(|cell| (*cell, words[cell.0 as usize])).collect(),
        }
    }

    /// Continues the watches of the old program. A new watched bit is reported if it is ON; a new
    /// watched word is not.
    pub fn carry(&mut self, old: &Watches, carried: &CarriedWatches, words: &[i32], now_ns: u64) {
        let known = |from: &Option<u32>| {
            from.and_then(|at| old.state(at as usize)).unwrap_or((false, now_ns))
        };
        for (bit, from) in self.bits.iter_mut().zip(&carried.bits) {
            (bit.1, bit.2) = known(from);
        }
        let behind = carried.bits.get(self.bits.len()..).unwrap_or_default();
        for (bit, from) in self.word_bits.iter_mut().zip(behind) {
            (bit.1, bit.2) = known(from);
        }
        for (word, from) in self.words.iter_mut().zip(&carried.words) {
            let known = from.and_then(|at| old.words.get(at as usize));
            word.1 = known.map_or(words[word.0.0 as usize], |(_, value)| *value);
        }
    }

    /// The state of a watched bit, and since when it has it.
    fn state(&self, watch: usize) -> Option<(bool, u64)> {
        let plain = self.bits.get(watch).map(|(_, on, since_ns)| (*on, *since_ns));
        plain.or_else(|| {
            let (_, on, since_ns) = self.word_bits.get(watch.checked_sub(self.bits.len())?)?;
            Some((*on, *since_ns))
        })
    }

    /// Reports every change in an image.
    pub fn compare(
        &mut self,
        image: ImageCells<'_>,
        mut tell: impl FnMut(RecordEvent),
        now_ns: u64,
    ) {
        for (watch, (cell, on, since_ns)) in self.bits.iter_mut().enumerate() {
            let is_on = image.bits[cell.0 as usize] != 0;
            if is_on != *on {
                let after_ns = now_ns.saturating_sub(*since_ns);
                (*on, *since_ns) = (is_on, now_ns);
                tell(RecordEvent::Bit { watch: watch as u32, on: is_on, after_ns });
            }
        }
        let first = self.bits.len();
        for (watch, (bit, on, since_ns)) in self.word_bits.iter_mut().enumerate() {
            let is_on = bit.is_on(image.words[bit.word.0 as usize]);
            if is_on != *on {
                let after_ns = now_ns.saturating_sub(*since_ns);
                (*on, *since_ns) = (is_on, now_ns);
                tell(RecordEvent::Bit { watch: (first + watch) as u32, on: is_on, after_ns });
            }
        }
        for (watch, (cell, value)) in self.words.iter_mut().enumerate() {
            let to = image.words[cell.0 as usize];
            if to != *value {
                let from = std::mem::replace(value, to);
                tell(RecordEvent::Word { watch: watch as u32, from, to });
            }
        }
    }
}

/// Sums up overruns, so that a controller that always overruns does not fill its log.
#[derive(Default)]
pub(super) struct OverrunSummary {
    count: u32,
    skipped: u64,
    scan_ns_max: u64,
    late_ns_max: u64,
    told_ns: Option<u64>,
}

impl OverrunSummary {
    pub fn add(&mut self, skipped: u64, scan_ns: u64, late_ns: u64) {
        self.count = self.count.saturating_add(1);
        self.skipped += skipped;
        self.scan_ns_max = self.scan_ns_max.max(scan_ns);
        self.late_ns_max = self.late_ns_max.max(late_ns);
    }

    /// The report that is due: the first overrun at once, later overruns as sums.
    pub fn due(&mut self, now_ns: u64) -> Option<RecordEvent> {
        let quiet = self.told_ns.is_some_and(|told| now_ns < told + OVERRUN_SUMMARY_NS);
        if self.count == 0 || quiet { None } else { self.take(now_ns) }
    }

    /// The overruns that have not been reported.
    pub fn take(&mut self, now_ns: u64) -> Option<RecordEvent> {
        if self.count == 0 {
            return None;
        }
        let OverrunSummary { count, skipped, scan_ns_max, late_ns_max, .. } =
            std::mem::replace(self, OverrunSummary { told_ns: Some(now_ns), ..Self::default() });
        Some(RecordEvent::Overruns { count, skipped, scan_ns_max, late_ns_max })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_change_is_recorded_once_with_the_duration_of_the_previous_value() {
        let watched = WatchedCells {
            bits: vec![BitCell(1)],
            words: vec![WordCell(0)],
            ..WatchedCells::default()
        };
        let mut watches = Watches::new(&watched, &[5], 100);
        let mut told = Vec::new();
        for (bit, word, now_ns) in [(0, 5, 110), (1, 6, 120), (1, 6, 130), (0, 5, 150)] {
            let image = ImageCells { bits: &[9, bit], words: &[word] };
            watches.compare(image, |what| told.push(what), now_ns);
        }
        let bit = |on, after_ns| RecordEvent::Bit { watch: 0, on, after_ns };
        let word = |from, to| RecordEvent::Word { watch: 0, from, to };
        assert_eq!(told, [bit(true, 20), word(5, 6), bit(false, 30), word(6, 5)]);
    }

    #[test]
    fn the_first_overrun_is_reported_at_once_and_later_overruns_are_summed() {
        let s = 1_000_000_000;
        let mut summary = OverrunSummary::default();
        assert_eq!(summary.due(0), None);
        let due = |count, skipped, scan_ns_max, late_ns_max| {
            Some(RecordEvent::Overruns { count, skipped, scan_ns_max, late_ns_max })
        };
        summary.add(1, 7, 0);
        assert_eq!(summary.due(0), due(1, 1, 7, 0));
        summary.add(2, 9, 1);
        summary.add(1, 8, 5);
        assert_eq!(summary.due(9 * s), None);
        assert_eq!(summary.due(10 * s), due(2, 3, 9, 5));
        assert_eq!(summary.due(30 * s), None);
    }

    #[test]
    fn dropped_records_are_counted() {
        let (mut journal, reader) = journal();
        for scan in 0..RECORDS_MAX as u64 + 3 {
            journal.push(scan, 0, RecordEvent::EventsLost(1));
        }
        assert_eq!(reader.dropped.load(Ordering::Relaxed), 3);
    }
}
