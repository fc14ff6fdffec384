//! The events that a reader of the scan log reports: positions in the log, changes, and gaps.
//!
//! Made by `change_follower` and `change_history`; `edge` publishes them.

use std::sync::Arc;

use super::logged_program::LoggedProgram;

/// A position in the scan log: the end of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LogPosition {
    /// When the controller's process started, ns since 1970 (UTC). It identifies the process.
    pub process_start_ns: i64,
    /// The number of the scan; the first of a process is 1.
    pub scan: u64,
    /// Its time, ns since 1970 (UTC).
    pub unix_ns: i64,
}

/// A part of the past that is not available.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogGap {
    /// The number of missing scans, if it is known.
    pub scans: Option<u64>,
    /// The time of the last scan before the gap, ns since 1970 (UTC).
    pub from_ns: i64,
    /// The time of the first scan after the gap, ns since 1970 (UTC).
    pub to_ns: i64,
    /// The reason, as a clause.
    pub why: String,
}

/// A new value of a chosen cell at the end of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoggedChange {
    /// The number of the cell among the chosen ones of its program.
    pub cell: u32,
    /// The content of the cell; of a Y, what the output is driven to, or `OUTPUT_UNKNOWN`.
    pub value: i32,
    /// The number of the scan.
    pub scan: u64,
    /// Its time, ns since 1970 (UTC).
    pub unix_ns: i64,
}

/// An event of the log. A reader reports the events in order.
#[derive(Clone, Debug)]
pub enum LogEvent {
    /// A program begins. The changes that follow are changes of its cells.
    Begins {
        /// The program.
        program: Arc<LoggedProgram>,
        /// The contents of its chosen cells, in their order.
        values: Vec<i32>,
        /// The position at which it begins.
        at: LogPosition,
    },
    /// A cell changed.
    Changed(LoggedChange),
    /// Only of a follower: the log continues at a later position. A [`super::ChangeHistory`] may
    /// have the changes between the two positions.
    Jumped {
        /// The last scan before the jump.
        from: LogPosition,
        /// The scan after which the log continues.
        to: LogPosition,
    },
    /// Only of a reader of the past: a part of it is missing.
    Missing(LogGap),
}
