//! The holds of bits that have not been logged as ended.
//!
//! Kept by `service`, used by `hold`. The scan thread has the holds themselves.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use super::peer::OperatorPeer;
use rungd_client::operator::operand::Variable;

/// By number.
pub(super) type KnownHolds = Arc<Mutex<HashMap<u64, KnownHold>>>;

/// A hold, for its renewals and for the log.
#[derive(Clone)]
pub(super) struct KnownHold {
    /// The user who began it.
    pub peer: OperatorPeer,
    pub operand: Variable,
    /// Its end, as far as it is known here; ns of the clock of deadlines.
    pub until_ns: u64,
}
