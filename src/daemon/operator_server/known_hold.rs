//! The holds of bits that have not been logged as ended.
//!
//! Kept by `service`, used by `hold`. The scan thread has the holds themselves.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use super::page_rights::WriteTerms;
use super::peer::OperatorPeer;
use rungd_client::operator::operand::Variable;

/// By number.
pub(super) type KnownHolds = Arc<Mutex<HashMap<u64, KnownHold>>>;

/// A hold, for its renewals and for the log.
#[derive(Clone)]
pub(super) struct KnownHold {
    /// The user who began it.
    pub peer: OperatorPeer,
    /// The person for whom it was begun, and whether a page asked: a renewal is judged again.
    pub person: Option<String>,
    pub from_page: bool,
    /// Why, as it was given.
    pub reason: Option<String>,
    pub operand: Variable,
    /// Its end, as far as it is known here; ns of the clock of deadlines.
    pub until_ns: u64,
}

impl KnownHold {
    /// How its renewals are asked for: as it was begun.
    pub fn terms(&self) -> WriteTerms<'_> {
        let (person, reason) = (self.person.as_deref(), self.reason.as_deref());
        WriteTerms { from_page: self.from_page, person, reason }
    }
}
