//! The status bits and words, with Do-more's nicknames (`docs/semantics.md`, section 6).
//!
//! The engine writes them at step 1 of every scan; programs read them and never write them. Step 1
//! turns the bits from `$DivideByZero` on OFF, and what happens in the scan turns them ON.

/// Status bit numbers: the n of `STn`.
pub(crate) mod st {
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
    /// How many there are.
    pub const COUNT: usize = 14;
}

/// Status word numbers: the n of `DSTn`.
pub(crate) mod dst {
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
    /// How many there are.
    pub const COUNT: usize = 5;
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

/// Nicknames of the status words, by number. `DST4` has none.
pub const WORD_NICKNAMES: [&str; 4] = ["$ScanCounter", "$ScanTime", "$MinScanTime", "$MaxScanTime"];

/// Number of status bits: `ST0`..`ST13`.
pub(crate) const ST_COUNT: u32 = st::COUNT as u32;
/// Number of status words: `DST0`..`DST4`.
pub(crate) const DST_COUNT: u32 = dst::COUNT as u32;
