//! What a batch does with a hold of a bit: begins it, puts its end off, ends it.
//!
//! A leaf module: the terms of a batch carry it (`exchange`), and `hold` carries it out in a scan.

use std::time::Duration;

use super::origin::Ticket;

/// The most holds at a time.
pub const HOLDS_MAX: usize = 32;

/// The longest scan period with which bits are held: a scan turns the bit OFF at the end, and
/// together both are at most 500 ms.
pub const HOLD_PERIOD_MAX: Duration = Duration::from_millis(100);

/// What a batch does with a hold; moments are ns of the clock of `BatchTerms::until_ns`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HoldStep {
    /// The one bit that the batch turns ON is held until this moment. The batch's ticket is the
    /// hold's number.
    Begin {
        /// The end of the hold.
        until_ns: u64,
    },
    /// A hold goes on until this moment, if that is later than its end.
    Keep {
        /// The hold.
        hold: Ticket,
        /// Its new end.
        until_ns: u64,
    },
    /// A hold ends in this scan.
    End {
        /// The hold.
        hold: Ticket,
    },
}
