//! The machine's wall clock, as the time since 1970 (UTC). It may jump.
//!
//! Called by the programs that write the time into messages, files and the log. The modules without
//! a clock get the time as an argument.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The present time, ms since 1970; 0 before 1970.
pub fn now_ms() -> u64 {
    u64::try_from(since_1970().as_millis()).unwrap_or(u64::MAX)
}

/// The present time, ns since 1970; 0 before 1970.
pub fn now_ns() -> i64 {
    i64::try_from(since_1970().as_nanos()).unwrap_or(i64::MAX)
}

fn since_1970() -> Duration {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default()
}
