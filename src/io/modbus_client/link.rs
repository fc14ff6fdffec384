//! The trait of a client's link: a question to a unit, and its answer within bounded time.

use std::future::Future;

use crate::io::device::Trouble;

/// The reason why there is no answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkFailure {
    /// No answer came, or no answer that fits the request. The link can still be used if it has
    /// [`Link::STARTS_ANEW`]; otherwise it has to be connected again.
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
pub trait Link: Send + 'static {
    /// Whether the link stays usable after a wrong or missing answer, because it discards old bytes
    /// before the next question.
    const STARTS_ANEW: bool;

    /// Connects, unless it is connected.
    fn connect(&mut self) -> impl Future<Output = Result<(), Trouble>> + Send;

    /// Sends the PDU of a request to a unit; the PDU of the answer replaces the content of
    /// `answer`. Takes at most the device's `timeout` plus the transmission time.
    fn ask(
        &mut self,
        unit: u8,
        request: &[u8],
        answer: &mut Vec<u8>,
    ) -> impl Future<Output = Result<(), LinkFailure>> + Send;

    /// Closes the link.
    fn close(&mut self);
}
