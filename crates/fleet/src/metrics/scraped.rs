//! The data of one look at a controller. Filled in by `scrape`, read by `controller` and `parts`.

pub use rungd_client::operator::protocol::{AlarmStatus, ControllerStatus, ShownValue};

/// The data of one look.
#[derive(Debug)]
pub(super) struct Scraped {
    pub status: ControllerStatus,
    pub alarms: Vec<AlarmStatus>,
    pub values: Vec<ShownValue>,
    /// The number of operands that were not read, because there are too many.
    pub left_out: usize,
    /// The start time of the process, s since 1970.
    pub start_s: f64,
}
