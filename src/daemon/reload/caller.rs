//! Who asks for a reload or a rollback, and until when. Made by the operator's service and by
//! `super::Reloads`.

use rungd_client::operator::deadline::NEVER_NS;

/// The person or program that asks for a reload or a rollback.
#[derive(Clone, Debug)]
pub(in super::super) struct Caller {
    /// Its name, for the log.
    pub who: String,
    /// No swap begins after this moment; ns of the clock of deadlines.
    pub until_ns: u64,
}

impl Caller {
    /// One that waits without end.
    pub fn anytime(who: &str) -> Caller {
        Caller { who: who.to_owned(), until_ns: NEVER_NS }
    }
}
