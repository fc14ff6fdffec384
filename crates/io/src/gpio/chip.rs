//! The traits of a chip: lines that can be requested, read and driven.
//!
//! `kernel` implements them for the machine's chips; tests implement them for chips of their own.

use std::io;

use super::settings::{ChipId as ChipName, LineSetting};

/// The most lines of a request: their values are the bits of a 64-bit word.
pub const REQUEST_LINES_MAX: usize = 64;

/// The name that the kernel shows as the holder of our lines.
pub const CONSUMER: &str = "rungd";

/// A source of chips.
pub trait ChipSource: Send + Sync + 'static {
    /// Opens a chip.
    ///
    /// # Errors
    /// The chip does not exist, or it may not be opened.
    fn open(&self, chip: &ChipName) -> io::Result<Box<dyn GpioChip>>;
}

/// A chip.
pub trait GpioChip {
    /// The number of its lines.
    ///
    /// # Errors
    /// The system's.
    fn lines(&self) -> io::Result<u32>;
    /// The chip's information about a line.
    ///
    /// # Errors
    /// The system's.
    fn line(&self, offset: u32) -> io::Result<LineFacts>;
    /// Takes lines.
    ///
    /// # Errors
    /// The system's error; EBUSY if another program has one of the lines.
    fn request(&self, request: &LineRequest<'_>) -> io::Result<Box<dyn TakenLines>>;
}

/// A chip's information about a line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LineFacts {
    /// Its name; empty if it has none.
    pub(crate) name: String,
    /// Its holder, if it has one; empty if the holder's name is not known.
    pub(crate) holder: Option<String>,
}

/// A request for several lines together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineRequest<'a> {
    /// Their numbers, 64 at most.
    pub(crate) offsets: &'a [u32],
    /// The setting of all these lines.
    pub(crate) setting: LineSetting,
    /// The first values of outputs, one bit per line; `None` for inputs.
    pub(crate) values: Option<u64>,
}

/// Lines that were taken. Dropping the value releases them.
pub trait TakenLines: Send + Sync {
    /// All values, one bit per line. Must not allocate.
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
