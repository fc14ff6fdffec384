//! The period of the scan: the time between the beginnings of two scans, in whole microseconds.
//!
//! Controller files, tests and `rungd sim` have one. It is written `10ms`, or `250us` where it is
//! no number of whole milliseconds. Timers count milliseconds whatever it is.

use std::fmt;

/// A scan period, at least [`ScanPeriod::LEAST_US`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ScanPeriod {
    us: u64,
}

impl ScanPeriod {
    /// The least period, µs.
    pub const LEAST_US: u64 = 100;

    /// The longest period, µs: the longest duration.
    pub const MOST_US: u64 = i32::MAX as u64 * 1000;

    /// The period of a program that nobody gave one.
    pub const DEFAULT: ScanPeriod = ScanPeriod { us: 10_000 };

    /// A period of whole milliseconds; 0 is read as 1.
    pub const fn of_ms(ms: u32) -> ScanPeriod {
        ScanPeriod { us: if ms == 0 { 1000 } else { ms as u64 * 1000 } }
    }

    /// A period of microseconds; `None` below [`ScanPeriod::LEAST_US`].
    pub fn of_us(us: u64) -> Option<ScanPeriod> {
        (us >= ScanPeriod::LEAST_US).then_some(ScanPeriod { us })
    }

    /// The µs of a text like `250us`; `None` for any other form.
    pub fn written_us(text: &str) -> Option<u64> {
        let digits = text.strip_suffix("us")?;
        let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
        is_number.then(|| digits.parse().unwrap_or(u64::MAX))
    }

    /// In µs.
    pub const fn us(self) -> u64 {
        self.us
    }

    /// In ns.
    pub const fn ns(self) -> u64 {
        self.us.saturating_mul(1000)
    }

    /// In ms, if it is a number of whole milliseconds.
    pub fn whole_ms(self) -> Option<u32> {
        let is_whole = self.us.is_multiple_of(1000);
        is_whole.then(|| u32::try_from(self.us / 1000).ok()).flatten()
    }

    /// In ms, rounded up.
    pub fn ms_up(self) -> u32 {
        u32::try_from(self.us.div_ceil(1000)).unwrap_or(u32::MAX)
    }

    /// In ms, with a fraction only where it has one: for JSON.
    pub fn ms(self) -> f64 {
        self.us as f64 / 1000.0
    }

    /// For a sentence: `10 ms`, `250 us`.
    pub fn words(self) -> String {
        match self.whole_ms() {
            Some(ms) => format!("{ms} ms"),
            None => format!("{} us", self.us),
        }
    }

    /// The scans that a time takes, rounded up.
    pub const fn scans_in_ms(self, ms: u64) -> u64 {
        ms.saturating_mul(1000).div_ceil(self.us)
    }
}

impl fmt::Display for ScanPeriod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.us.is_multiple_of(1000) {
            true => write!(f, "{}ms", self.us / 1000),
            false => write!(f, "{}us", self.us),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_period_is_printed_as_it_is_written() {
        assert_eq!(ScanPeriod::of_ms(10).to_string(), "10ms");
        assert_eq!(ScanPeriod::of_us(250).expect("it is long enough").to_string(), "250us");
        assert_eq!(ScanPeriod::of_us(2000).expect("it is long enough").to_string(), "2ms");
        assert_eq!(ScanPeriod::of_us(99), None);
    }

    #[test]
    fn times_are_scans_rounded_up() {
        let period = ScanPeriod::of_us(300).expect("it is long enough");
        assert_eq!((period.scans_in_ms(3), period.scans_in_ms(4)), (10, 14));
        assert_eq!((period.whole_ms(), period.ms_up()), (None, 1));
        assert_eq!(ScanPeriod::of_ms(5).whole_ms(), Some(5));
    }
}
