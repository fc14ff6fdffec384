//! A bit that a page holds ON while its button is pressed: the limits, and the answers.
//!
//! Part of the [`super::protocol`]. The scan thread ends a hold (`runtime::hold`).

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::value::ChangedOperand;

pub use rungd_runtime::hold_step::HOLD_PERIOD_MAX;

/// The longest time for which a bit is held without a renewal.
pub const HOLD_MAX: Duration = Duration::from_millis(400);

/// The answer to the begin of a hold.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HeldOperand {
    /// The number of the hold.
    pub hold: u64,
    /// The write of ON.
    #[serde(flatten)]
    pub change: ChangedOperand,
}

/// The answer to a renewal or an end of a hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HoldState {
    /// The number of the hold.
    pub hold: u64,
}
