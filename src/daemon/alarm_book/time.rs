//! The times of the book.

use rungd_client::operator::protocol::AlarmTime;

/// The time of an event: its scan, and its time by both clocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in super::super) struct BookTime {
    pub scan: u64,
    /// CLOCK_MONOTONIC.
    pub at_ns: u64,
    /// Since 1970 (UTC).
    pub unix_ns: i64,
}

impl BookTime {
    pub(super) fn shown(self) -> AlarmTime {
        AlarmTime { scan: self.scan, unix_ns: self.unix_ns }
    }
}
