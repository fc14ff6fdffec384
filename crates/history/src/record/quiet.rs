//! A run of quiet scans: two small numbers for each scan, packed bit by bit.
//!
//! `section` collects them, `section_read` reads them. The delay and the duration of a scan are
//! random, and no compression makes random numbers smaller. So each number takes only the bits that
//! the range of its run needs. If whole bytes make a run shorter, it is written in whole bytes.

use super::codes::{ENTRIES_MAX, code};
use rungd_base::byte_source::{ByteSource, folded, put_number, put_signed};

/// A scan whose duration differs this much from that of the first scan of the run begins a new run.
const SPREAD_US_MAX: u32 = 64;

/// The maximum number of bits of a number in a run.
const WIDTH_MAX: u8 = 32;

/// A quiet scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct QuietScan {
    /// The deviation of its time from the expected time, µs.
    pub deviation_us: i64,
    /// The scan time before it, µs.
    pub last_us: i32,
}

/// Quiet scans that are not written yet.
#[derive(Debug, Default)]
pub(super) struct QuietRun {
    /// The scan time before the first scan.
    before_us: i32,
    scans: Vec<QuietScan>,
}

impl QuietRun {
    /// Adds a scan; returns false if the run must be written first. `before_us`: the scan time of
    /// the scan before it.
    pub fn takes(&mut self, scan: QuietScan, before_us: i32) -> bool {
        match self.scans.first() {
            None => self.before_us = before_us,
            Some(first) if first.last_us.abs_diff(scan.last_us) < SPREAD_US_MAX => {}
            Some(_) => return false,
        }
        self.scans.push(scan);
        true
    }

    /// Writes the run, and begins a new one.
    pub fn put(&mut self, out: &mut Vec<u8>) {
        let Some(first) = self.scans.first() else { return };
        let fold = |least: QuietScan, scan: &QuietScan| QuietScan {
            deviation_us: least.deviation_us.min(scan.deviation_us),
            last_us: least.last_us.min(scan.last_us),
        };
        let least = self.scans.iter().fold(*first, fold);
        let (plain, packed) = (self.plain(), self.packed(least));
        out.extend(if packed.len() < plain.len() { packed } else { plain });
        self.scans.clear();
    }

    /// The run with two numbers in whole bytes for each scan.
    fn plain(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let mut before_us = self.before_us;
        for scan in &self.scans {
            out.push(folded(scan.deviation_us) as u8);
            put_signed(&mut out, i64::from(scan.last_us) - i64::from(before_us));
            before_us = scan.last_us;
        }
        out
    }

    fn packed(&self, least: QuietScan) -> Vec<u8> {
        let above = |scan: &QuietScan| {
            let deviation_us = scan.deviation_us - least.deviation_us;
            [deviation_us as u64, u64::from(scan.last_us.abs_diff(least.last_us))]
        };
        let all = self.scans.iter().map(above);
        let bits = all.clone().fold([0, 0], |all, one| [all[0] | one[0], all[1] | one[1]]);
        let widths = bits.map(|bits| 64 - bits.leading_zeros() as u8);
        let mut out = vec![code::QUIET];
        put_number(&mut out, self.scans.len() as u64);
        put_signed(&mut out, least.deviation_us);
        put_signed(&mut out, i64::from(least.last_us) - i64::from(self.before_us));
        out.extend(widths);
        let (mut bits, mut count) = (0_u64, 0);
        for (number, width) in all.flat_map(|numbers| numbers.into_iter().zip(widths)) {
            bits |= number << count;
            count += width;
            while count >= 8 {
                out.push(bits as u8);
                (bits, count) = (bits >> 8, count - 8);
            }
        }
        if count > 0 {
            out.push(bits as u8);
        }
        out
    }
}

/// Reads a packed run after its code. `before_us`: the scan time of the scan before the run.
pub(super) fn read(bytes: &mut ByteSource<'_>, before_us: i32) -> Option<Vec<QuietScan>> {
    let count = usize::try_from(bytes.number()?).ok().filter(|count| *count <= ENTRIES_MAX / 2)?;
    let least_deviation_us = bytes.signed()?;
    let least_us = i64::from(before_us).checked_add(bytes.signed()?)?;
    let widths = [bytes.byte()?, bytes.byte()?];
    if widths.iter().any(|width| *width > WIDTH_MAX) {
        return None;
    }
    let total: usize = widths.iter().map(|width| usize::from(*width)).sum();
    let mut packed = bytes.take((count * total).div_ceil(8))?.iter();
    let (mut bits, mut held) = (0_u64, 0);
    let mut number = |width: u8| {
        while held < width {
            bits |= u64::from(*packed.next()?) << held;
            held += 8;
        }
        let number = bits & ((1 << width) - 1);
        (bits, held) = (bits >> width, held - width);
        Some(number as i64)
    };
    let mut scans = Vec::with_capacity(count);
    for _ in 0..count {
        let deviation_us = least_deviation_us.checked_add(number(widths[0])?)?;
        let last_us = least_us.checked_add(number(widths[1])?)?.try_into().ok()?;
        scans.push(QuietScan { deviation_us, last_us });
    }
    Some(scans)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_quiet_scans_is_packed_without_loss() {
        for (count, spread, bytes_max) in [(1, 1, 3), (5, 50, 15), (100, 41, 165), (100, 1, 110)] {
            let mut run = QuietRun::default();
            let scan = |at: i64| QuietScan {
                deviation_us: at * 37 % 61 - 30,
                last_us: -20 + (at * 13 % spread) as i32,
            };
            assert!((0..count).all(|at| run.takes(scan(at), 300)));
            let mut out = Vec::new();
            run.put(&mut out);
            run.put(&mut out);
            assert!(out.len() <= bytes_max, "{count} in {}", out.len());
            if out[0] == code::QUIET {
                let scans = read(&mut ByteSource(&out[1..]), 300).unwrap();
                assert_eq!(scans, (0..count).map(scan).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn a_much_longer_scan_begins_a_new_run() {
        let mut run = QuietRun::default();
        let scan = |last_us| QuietScan { deviation_us: 0, last_us };
        assert!(run.takes(scan(300), 300) && run.takes(scan(363), 300));
        assert!(!run.takes(scan(364), 363) && !run.takes(scan(i32::MIN), 363));
        run.put(&mut Vec::new());
        assert!(run.takes(scan(i32::MIN), 363));
    }

    #[test]
    fn a_run_that_claims_too_many_scans_is_refused() {
        let run = |count: u64, widths: [u8; 2]| {
            let mut out = Vec::new();
            put_number(&mut out, count);
            out.extend([0, 0]);
            out.extend(widths);
            read(&mut ByteSource(&out), 0).map(|scans| scans.len())
        };
        assert_eq!(run(3, [0, 0]), Some(3));
        assert_eq!(run(1 << 16, [0, 0]), Some(1 << 16));
        assert_eq!(run((1 << 16) + 1, [0, 0]), None);
        assert_eq!(run(u64::MAX, [0, 0]), None);
        assert_eq!(run(3, [33, 0]), None);
        assert_eq!(run(3, [1, 0]), None);
    }
}
