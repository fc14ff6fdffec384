//! What one look at a controller saw. Filled in by `scrape`, read by `controller` and `parts`.

use crate::operator::protocol::{Alarm, ShownValue, Status};

/// What was seen at one look.
#[derive(Debug)]
pub(super) struct Scraped {
    pub status: Status,
    pub alarms: Vec<Alarm>,
    pub values: Vec<ShownValue>,
    /// The operands that were not read: too many.
    pub left_out: usize,
    /// When the process started, s since 1970.
    pub start_s: f64,
}
