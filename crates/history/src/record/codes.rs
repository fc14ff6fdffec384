//! The numbers that entries begin with, and the limits of a section.
//!
//! `section` and `quiet` write them, `section_read` reads them. They never change; a new entry gets
//! a new number, and the format a new version.

/// The maximum number of entries of a section.
pub const ENTRIES_MAX: usize = 1 << 17;

/// The maximum number of bytes of a section before packing: more than its entries can need.
pub(super) const SECTION_BYTES_MAX: usize = 1 << 23;

/// The first bytes of entries. Those below `SCAN` are quiet scans.
pub(super) mod code {
    pub const SCAN: u8 = 0xC0;
    pub const EXECUTE: u8 = 0xC1;
    pub const START: u8 = 0xC2;
    pub const REQUEST_STOP: u8 = 0xC3;
    pub const TERMINATE: u8 = 0xC4;
    pub const ORIGIN: u8 = 0xC5;
    pub const NUMBER: u8 = 0xC6;
    pub const MODE: u8 = 0xC7;
    pub const SWAP: u8 = 0xC8;
    pub const LOST: u8 = 0xC9;
    pub const BIT_OFF: u8 = 0xCA;
    pub const BIT_ON: u8 = 0xCB;
    pub const WORD: u8 = 0xCC;
    pub const FORCE_OFF: u8 = 0xCD;
    pub const FORCE_ON: u8 = 0xCE;
    pub const FORCE_WORD: u8 = 0xCF;
    pub const RELEASE_BIT: u8 = 0xD0;
    pub const RELEASE_WORD: u8 = 0xD1;
    pub const QUIET: u8 = 0xD2;
}

/// The flags of a scan.
pub(super) mod scan_flag {
    /// The mean scan time has changed.
    pub const MEAN: u8 = 1;
    /// The shortest or the longest scan time is not as expected.
    pub const EXTREMES: u8 = 2;
    /// Local time is not as expected.
    pub const LOCAL: u8 = 4;
    /// The time is not in whole microseconds.
    pub const NANOSECONDS: u8 = 8;
    /// The scan executes without further entries.
    pub const EXECUTES: u8 = 16;
}
