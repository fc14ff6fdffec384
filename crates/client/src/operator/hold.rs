//! A bit that a page holds ON while its button is pressed: the limits, and the answers.
//!
//! Part of the [`super::protocol`]. The scan thread ends a hold (`runtime::hold`).

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::value::ChangedOperand;

/// The longest time for which a bit is held without a renewal.
pub const HOLD_MAX: Duration = Duration::from_millis(400);

/// The longest scan period with which bits are held: a scan turns the bit OFF at the end, and
/// together both are at most 500 ms.
pub const HOLD_PERIOD_MAX: Duration = Duration::from_millis(100);

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
