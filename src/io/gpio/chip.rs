//! A chip as the driver sees it: lines that can be asked for, taken, read and driven.
//!
//! `kernel` is the machine's; tests put a chip of their own there.

use std::io;

use super::settings::{Chip as ChipName, Setting};

/// The most lines of a request: a value is a bit of 64.
pub const REQUEST_LINES_MAX: usize = 64;

/// What a line's holder is told.
pub const CONSUMER: &str = "rungd";

/// Where chips are found.
pub trait Chips: Send + Sync + 'static {
    /// Opens a chip.
    ///
    /// # Errors
    /// There is none, or it may not be opened.
    fn open(&self, chip: &ChipName) -> io::Result<Box<dyn Chip>>;
}

/// A chip.
pub trait Chip {
    /// How many lines it has.
    ///
    /// # Errors
    /// The system's.
    fn lines(&self) -> io::Result<u32>;
    /// What it knows of a line.
    ///
    /// # Errors
    /// The system's.
    fn line(&self, offset: u32) -> io::Result<LineFacts>;
    /// Takes lines.
    ///
    /// # Errors
    /// The system's; EBUSY if somebody has one of them.
    fn request(&self, request: &Request<'_>) -> io::Result<Box<dyn Lines>>;
}

/// What a chip knows of a line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LineFacts {
    /// Its name; empty if it has none.
    pub name: String,
    /// Its holder, if it has one; empty if the holder's name is not known.
    pub holder: Option<String>,
}

/// Lines that are asked for together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request<'a> {
    /// Their numbers, 64 at most.
    pub offsets: &'a [u32],
    /// How.
    pub setting: Setting,
    /// Of outputs, their first values, a bit each.
    pub values: Option<u64>,
}

/// Lines that were taken. They are let go of when this is dropped.
pub trait Lines: Send + Sync {
    /// All values, a bit each. Must not allocate.
    ///
    /// # Errors
    /// The system's error number.
    fn get(&self) -> Result<u64, i32>;
    /// Drives all lines. Must not allocate.
    ///
    /// # Errors
    /// The system's error number.
    fn set(&self, values: u64) -> Result<(), i32>;
}
