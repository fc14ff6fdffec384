//! How long the browser of a request waits. After that, nothing is done for it.
//!
//! Made by `server` when a request arrives, and asked by `api` and `route` right before they do
//! something for it: the process may have stood still meanwhile, and the request may have waited
//! for its turn. The page says until which moment it waits, by the clock whose time it receives in
//! the events; a client that says nothing waits for [`UNSAID_MAX`] from the arrival. A browser that
//! has closed its connection waits no longer.

use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;

use super::reply::{WebFailure, bad};
use rungd_client::operator::deadline::{Deadline, has_left};
use rungd_client::operator::protocol::{DEADLINE, RefusalKind, RequestRefusal, RequestResult};

/// The wait of a client that does not say how long it waits.
const UNSAID_MAX: Duration = Duration::from_secs(10);

/// The browser's end of a connection.
#[derive(Clone, Debug, Default)]
pub(super) struct PeerEnd(Option<Arc<OwnedFd>>);

impl PeerEnd {
    /// The other end of this connection.
    ///
    /// # Errors
    /// The system has no descriptor left.
    pub fn of(connection: &impl AsFd) -> std::io::Result<PeerEnd> {
        Ok(PeerEnd(Some(Arc::new(connection.as_fd().try_clone_to_owned()?))))
    }
}

/// How long the browser of a request waits.
#[derive(Clone, Debug)]
pub(super) struct BrowserPatience {
    peer: PeerEnd,
    /// The moment after which nothing is begun; `None`: this machine's clock has no name.
    until: Option<Deadline>,
}

impl BrowserPatience {
    /// That of a request which arrives now.
    pub fn from_now(peer: PeerEnd) -> BrowserPatience {
        BrowserPatience { peer, until: Deadline::of_wait(UNSAID_MAX) }
    }

    /// The same browser, with the deadline that its request contains, if it contains one.
    ///
    /// # Errors
    /// It is not a deadline.
    pub fn said(self, request: &Value) -> Result<BrowserPatience, WebFailure> {
        match request.get(DEADLINE) {
            None | Some(Value::Null) => Ok(self),
            Some(said) => {
                let read = serde_json::from_value(said.clone());
                let until: Deadline = read.map_err(|why| bad(format!("`{DEADLINE}`: {why}")))?;
                match until.until_ns() {
                    Some(_) => Ok(BrowserPatience { until: Some(until), ..self }),
                    None => Err(bad(format!(
                        "`{DEADLINE}` is a moment of a different clock: load the page again"
                    ))),
                }
            }
        }
    }

    /// The deadline.
    pub fn until(&self) -> Option<&Deadline> {
        self.until.as_ref()
    }

    /// Whether the browser still waits.
    ///
    /// # Errors
    /// It does not: nothing may be done.
    pub fn judge(&self) -> RequestResult<()> {
        let why = if self.until.as_ref().is_some_and(|until| until.left().is_none()) {
            "nothing is done: its turn came after the browser had stopped waiting"
        } else if self.peer.0.as_ref().is_some_and(has_left) {
            "nothing is done: the browser has left without waiting for the answer"
        } else {
            return Ok(());
        };
        Err(RequestRefusal::new(RefusalKind::TooLate, why))
    }
}
