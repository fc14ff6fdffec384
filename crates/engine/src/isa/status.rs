//! The status bits and words, with Do-more's nicknames (`docs/semantics.md`, section 6).
//!
//! The engine writes them at step 1 of every scan; programs only read them. Step 1 turns the bits
//! from `$DivideByZero` on OFF; mishaps in the scan turn them ON.

/// Status bit numbers: the n of `STn`.
pub mod st {
    /// ON in the first scan of a RUN only.
    pub const FIRST_SCAN: u32 = 0;
    /// Always ON.
    pub const ON: u32 = 1;
    /// Always OFF.
    pub const OFF: u32 = 2;
    /// ON for the first half of every minute since the start of RUN.
    pub const ONE_MINUTE: u32 = 3;
    /// ON for the first half of every second.
    pub const ONE_SECOND: u32 = 4;
    /// ON for the first 50 ms of every 100 ms.
    pub const HUNDRED_MS: u32 = 5;
    /// ON for the first 25 ms of every 50 ms.
    pub const FIFTY_MS: u32 = 6;
    /// OFF in the first scan, then alternating.
    pub const SCAN_TOGGLE: u32 = 7;
    /// ON in the last scan before a stop.
    pub const LAST_SCAN: u32 = 8;
    /// ON while anything is forced.
    pub const FORCES_ACTIVE: u32 = 9;
    /// MATH divided by 0 in this scan.
    pub const DIVIDE_BY_ZERO: u32 = 10;
    /// A result of MATH was limited in this scan.
    pub const OVERFLOW: u32 = 11;
    /// An argument of MATH was outside the domain of its function in this scan.
    pub const OUT_OF_RANGE: u32 = 12;
    /// An index was outside its array in this scan.
    pub const INDEX_ERROR: u32 = 13;
    /// The number of status bits.
    pub const COUNT: usize = 14;
}

/// Status word numbers: the n of `DSTn`.
pub mod dst {
    /// Scans completed since the start of RUN.
    pub const SCAN_COUNTER: u32 = 0;
    /// Filtered mean of the scan time, µs.
    pub const SCAN_TIME_US: u32 = 1;
    /// Shortest scan since the start of RUN, µs.
    pub const MIN_SCAN_TIME_US: u32 = 2;
    /// Longest scan since the start of RUN, µs.
    pub const MAX_SCAN_TIME_US: u32 = 3;
    /// The last scan, µs.
    pub const LAST_SCAN_TIME_US: u32 = 4;
    /// The local year, as 2026. This word and the six after it are one reading of the clock.
    pub const YEAR: u32 = 5;
    /// 1 to 12.
    pub const MONTH: u32 = 6;
    /// 1 to 31.
    pub const DAY: u32 = 7;
    /// 1 is Monday, 7 is Sunday.
    pub const WEEKDAY: u32 = 8;
    /// 0 to 23.
    pub const HOUR: u32 = 9;
    /// 0 to 59.
    pub const MINUTE: u32 = 10;
    /// 0 to 59.
    pub const SECOND: u32 = 11;
    /// Whole seconds between the scan of the restored image and the start of the process.
    pub const DOWN_SECONDS: u32 = 12;
    /// Days from 1970-01-01 to the local date.
    pub const DAY_NUMBER: u32 = 13;
    /// Seconds since local midnight.
    pub const SECOND_OF_DAY: u32 = 14;
    /// The number of status words.
    pub const COUNT: usize = 15;
    /// The number of status words in memory of rungd 0.2.
    pub const COUNT_0_2: usize = 12;

    /// Whether a word is one of the date or time of day.
    pub fn is_of_clock(number: u32) -> bool {
        matches!(number, YEAR..=SECOND | DAY_NUMBER | SECOND_OF_DAY)
    }

    /// Whether a word is given from outside of the controller's program: the date and time of day,
    /// and the times of scans. The seconds without power are those of the start.
    pub fn is_given(number: u32) -> bool {
        is_of_clock(number) || is_of_scans(number)
    }

    /// Whether a word is a time of scans.
    pub fn is_of_scans(number: u32) -> bool {
        matches!(number, SCAN_TIME_US..=LAST_SCAN_TIME_US)
    }

    /// The smallest and the largest value of a word of the date or time of day; `None`: any.
    pub fn clock_range(number: u32) -> Option<(i32, i32)> {
        match number {
            MONTH => Some((1, 12)),
            DAY => Some((1, 31)),
            WEEKDAY => Some((1, 7)),
            HOUR => Some((0, 23)),
            MINUTE | SECOND => Some((0, 59)),
            SECOND_OF_DAY => Some((0, 86_399)),
            _ => None,
        }
    }
}

/// Nicknames of the status bits, by number.
pub const BIT_NICKNAMES: [&str; 14] = [
    "$FirstScan",
    "$On",
    "$Off",
    "$1Minute",
    "$1Second",
    "$100ms",
    "$50ms",
    "$ScanToggle",
    "$LastScan",
    "$ForcesActive",
    "$DivideByZero",
    "$Overflow",
    "$OutOfRange",
    "$IndexError",
];

/// Nicknames of the status words, with their numbers. `DST4` has none.
pub(crate) const WORD_NICKNAMES: [(&str, u32); 14] = [
    ("$ScanCounter", dst::SCAN_COUNTER),
    ("$ScanTime", dst::SCAN_TIME_US),
    ("$MinScanTime", dst::MIN_SCAN_TIME_US),
    ("$MaxScanTime", dst::MAX_SCAN_TIME_US),
    ("$Year", dst::YEAR),
    ("$Month", dst::MONTH),
    ("$Day", dst::DAY),
    ("$Weekday", dst::WEEKDAY),
    ("$Hour", dst::HOUR),
    ("$Minute", dst::MINUTE),
    ("$Second", dst::SECOND),
    ("$DownSeconds", dst::DOWN_SECONDS),
    ("$DayNumber", dst::DAY_NUMBER),
    ("$SecondOfDay", dst::SECOND_OF_DAY),
];

/// The meanings of the status bits, by number (`docs/semantics.md`, section 6).
const BIT_MEANINGS: [&str; st::COUNT] = [
    "ON in the first scan of a RUN",
    "always ON",
    "always OFF",
    "ON for the first half of each minute since RUN began",
    "ON for the first half of each second since RUN began",
    "ON for the first 50 ms of each 100 ms since RUN began",
    "ON for the first 25 ms of each 50 ms since RUN began",
    "OFF in the first scan, ON in the second, and so on",
    "ON in the last scan before a stop",
    "ON while anything is forced",
    "ON if a MATH divided by 0 in this scan",
    "ON if a result of a MATH was limited in this scan",
    "ON if a function of a MATH had an argument outside its domain in this scan",
    "ON if an index was outside its array in this scan",
];

/// The meanings of the status words, by number.
const WORD_MEANINGS: [&str; dst::COUNT] = [
    "scans completed since RUN began; after 2147483647 it goes on at 0",
    "the filtered mean of the scan time, µs",
    "the shortest scan since RUN began, µs",
    "the longest scan since RUN began, µs",
    "the time of the last scan, µs",
    "the local year, as 2026",
    "the local month, 1 to 12",
    "the local day of the month, 1 to 31",
    "the local weekday: 1 is Monday, 7 is Sunday",
    "the local hour, 0 to 23",
    "the local minute, 0 to 59",
    "the local second, 0 to 59",
    "whole seconds from the scan of the restored image to the start of the process; 0 if none",
    "days from 1970-01-01 to the local date",
    "seconds since local midnight, 0 to 86399",
];

/// The meaning of a status bit, by its number.
pub fn bit_meaning(number: u32) -> Option<&'static str> {
    BIT_MEANINGS.get(number as usize).copied()
}

/// The meaning of a status word, by its number.
pub fn word_meaning(number: u32) -> Option<&'static str> {
    WORD_MEANINGS.get(number as usize).copied()
}

/// The nickname of a status word, if it has one.
pub fn word_nickname(number: u32) -> Option<&'static str> {
    WORD_NICKNAMES.iter().find(|(_, n)| *n == number).map(|(name, _)| *name)
}

/// All nicknames: of the bits, then of the words.
pub fn nicknames() -> impl Iterator<Item = &'static str> {
    BIT_NICKNAMES.into_iter().chain(WORD_NICKNAMES.into_iter().map(|(name, _)| name))
}

/// The least and greatest value of a status word of the date or time of day, and of the seconds
/// without power; the year and the number of the day have none.
pub fn clock_range(number: u32) -> Option<(i32, i32)> {
    match number {
        dst::MONTH => Some((1, 12)),
        dst::DAY => Some((1, 31)),
        dst::WEEKDAY => Some((1, 7)),
        dst::HOUR => Some((0, 23)),
        dst::MINUTE | dst::SECOND => Some((0, 59)),
        dst::DOWN_SECONDS => Some((0, i32::MAX)),
        dst::SECOND_OF_DAY => Some((0, 86_399)),
        _ => None,
    }
}

/// Number of status bits: `ST0`..`ST13`.
pub const ST_COUNT: u32 = st::COUNT as u32;
/// Number of status words: `DST0`..`DST14`.
pub const DST_COUNT: u32 = dst::COUNT as u32;
