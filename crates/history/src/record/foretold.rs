//! Expectations of the next entries of a section: the writer stores only the differences from them.
//!
//! `section` uses the expectations to write, `section_read` to read. Both update them with the same
//! entries in the same order, so both have the same expectations. `docs/record-format.md` describes
//! them under *Expectations*.

use std::collections::HashMap;

use rungd_base::byte_source::{ByteSource, put_number, put_signed};
use rungd_engine::{Cell, ScanTimes};

/// The deviations from the expected time that fit into one byte. A scan with such a deviation does
/// not move the grid.
pub(super) const NEAR: std::ops::RangeInclusive<i64> = -96..=95;

/// The expectations.
#[derive(Clone, Debug, Default)]
pub(super) struct Expectations {
    /// The time between two scans, µs.
    pub period_us: u64,
    /// The grid's time of the last scan, µs.
    pub grid_us: u64,
    /// Add it to a time in µs to get local time in µs.
    pub local_offset_us: i64,
    /// The scan times of the last scan.
    pub times: ScanTimes,
    /// The last bit and the last word that an entry named.
    cells: [u32; 2],
    /// The last number of each kind of origin.
    pub origins: [u64; 4],
    /// The last value that was written to each word.
    values: HashMap<u32, i32>,
}

impl Expectations {
    /// The expectations before the first entry.
    pub fn new(period_us: u64, grid_us: u64, local_offset_us: i64) -> Expectations {
        Expectations { period_us, grid_us, local_offset_us, ..Expectations::default() }
    }

    /// Appends the numbers that a reader needs at the start.
    pub fn put(&self, out: &mut Vec<u8>) {
        put_number(out, self.period_us);
        put_number(out, self.grid_us);
        put_signed(out, self.local_offset_us);
    }

    /// Reads the numbers that the writer had at the start.
    pub fn read(bytes: &mut ByteSource<'_>) -> Option<Expectations> {
        let (period_us, grid_us) = (bytes.number()?, bytes.number()?);
        let local_offset_us = bytes.signed()?;
        Some(Expectations::new(period_us, grid_us, local_offset_us))
    }

    fn due_us(&self) -> u64 {
        self.grid_us.wrapping_add(self.period_us)
    }

    /// The deviation of the time of a scan from the expected time, µs.
    pub fn deviation_us(&self, now_us: u64) -> i64 {
        now_us.wrapping_sub(self.due_us()) as i64
    }

    /// The time of a scan with a deviation.
    pub fn at_deviation(&self, deviation_us: i64) -> u64 {
        self.due_us().wrapping_add(deviation_us as u64)
    }

    /// The expected scan times for a scan time of the last scan.
    pub fn times_after(&self, last_us: i32) -> ScanTimes {
        let ScanTimes { mean_us, min_us, max_us, .. } = self.times;
        ScanTimes { mean_us, min_us: min_us.min(last_us), max_us: max_us.max(last_us), last_us }
    }

    /// Local time at a time, seconds since 1970 of the local clock.
    pub fn local_s(&self, now_us: u64) -> i64 {
        (now_us as i64).wrapping_add(self.local_offset_us).div_euclid(1_000_000)
    }

    /// Notes that a scan begins.
    pub fn scan(&mut self, now_us: u64, times: ScanTimes) {
        let near = NEAR.contains(&self.deviation_us(now_us));
        self.grid_us = if near { self.due_us() } else { now_us };
        self.times = times;
    }

    /// Notes that an entry names a cell; returns the cell of the same kind that was named before.
    pub fn cell(&mut self, cell: Cell) -> u32 {
        match cell {
            Cell::Bit(cell) => std::mem::replace(&mut self.cells[0], cell.0),
            Cell::Word(cell) => std::mem::replace(&mut self.cells[1], cell.0),
            Cell::WordBit(_) => unreachable!("a tape has whole words alone"),
        }
    }

    /// The last bit or word that an entry named.
    pub fn last_cell(&self, is_word: bool) -> u32 {
        self.cells[usize::from(is_word)]
    }

    /// Notes that a word gets a value; returns its value before.
    pub fn value(&mut self, word: u32, value: i32) -> i32 {
        self.values.insert(word, value).unwrap_or(0)
    }

    /// The last value that a word got.
    pub fn last_value(&self, word: u32) -> i32 {
        self.values.get(&word).copied().unwrap_or(0)
    }
}
