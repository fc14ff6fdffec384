//! The trait of a client's link: a question to a unit, and its answer within bounded time.

use std::future::Future;

use tokio::time::Instant;

use crate::device::ExchangeFailure;

/// The reason why there is no answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkFailure {
    /// No answer came, or no answer that fits the request. [`PeerLink::is_usable`] says whether the
    /// link has to be connected again.
    Silent(String),
    /// The received bytes may or may not be the answer; the unit may be present.
    Doubtful(String),
    /// The peer has closed a link over which it had answered before, and sent no byte of this
    /// answer.
    Closed(String),
    /// The link cannot be used any more.
    Broken(String),
}

/// A way to a peer.
pub trait PeerLink: Send + 'static {
    /// Whether the link stays usable after a wrong answer, because it discards old bytes before the
    /// next question. Such a link cannot tell a late answer from the right one.
    const STARTS_ANEW: bool;

    /// The time, for intervals and pauses.
    fn now(&self) -> Instant {
        Instant::now()
    }

    /// Connects, unless it is connected.
    fn connect(&mut self) -> impl Future<Output = Result<(), ExchangeFailure>> + Send;

    /// Sends the PDU of a request to a unit; the PDU of the answer replaces the content of
    /// `answer`. Takes at most the device's `timeout` plus the transmission time, after the pauses
    /// that the device's settings want before.
    fn ask(
        &mut self,
        unit: u8,
        request: &[u8],
        answer: &mut Vec<u8>,
    ) -> impl Future<Output = Result<(), LinkFailure>> + Send;

    /// Whether a unit with this number is all units of the link at once, none of which answers.
    fn is_broadcast(&self, unit: u8) -> bool;

    /// Sends the PDU of a write to all units, and waits for as long as they may take.
    fn broadcast(&mut self, request: &[u8])
    -> impl Future<Output = Result<(), LinkFailure>> + Send;

    /// Whether the link can still be used after a silence.
    fn is_usable(&self) -> bool;

    /// Closes the link.
    fn close(&mut self);
}
