//! What a reader of the scan log tells: places in the log, changes, and what is missing.
//!
//! Made by `change_follower` and `change_history`; `edge` publishes them.

use std::sync::Arc;

use super::logged_program::LoggedProgram;

/// A place in the scan log: the end of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LogPosition {
    /// When the process of the controller started, ns since 1970 (UTC): it tells processes apart.
    pub process_start_ns: i64,
    /// The number of the scan; the first of a process is 1.
    pub scan: u64,
    /// Its time, ns since 1970 (UTC).
    pub unix_ns: i64,
}

/// A part of the past that cannot be had.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogGap {
    /// The scans that it lacks, if that is known.
    pub scans: Option<u64>,
    /// The time of the last scan before it, ns since 1970 (UTC).
    pub from_ns: i64,
    /// The time of the first scan behind it, ns since 1970 (UTC).
    pub to_ns: i64,
    /// Why, as a clause.
    pub why: String,
}

/// A value of a chosen cell at the end of a scan, which differs from the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoggedChange {
    /// The number of the cell among the chosen ones of its program.
    pub cell: u32,
    /// The content of the cell.
    pub value: i32,
    /// The number of the scan.
    pub scan: u64,
    /// Its time, ns since 1970 (UTC).
    pub unix_ns: i64,
}

/// What is told, in order.
#[derive(Clone, Debug)]
pub enum LogEvent {
    /// A program begins: what follows is about its cells.
    Begins {
        /// The program.
        program: Arc<LoggedProgram>,
        /// The contents of its chosen cells, in their order.
        values: Vec<i32>,
        /// Where.
        at: LogPosition,
    },
    /// A cell changed.
    Changed(LoggedChange),
    /// Of one who follows: the log goes on at another place. What lies between may be had from the
    /// log's past.
    Jumped {
        /// The last scan before.
        from: LogPosition,
        /// The scan behind which it goes on.
        to: LogPosition,
    },
    /// Of one who reads the past: a part of it is missing.
    Missing(LogGap),
}
