//! What a client needs of its link: a question to a unit, and its answer within bounded time.

use std::future::Future;

use crate::io::device::Trouble;

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// None came, or none that fits. Where the link starts anew it is as good as before; another
    /// one has to be made anew.
    Silent(String),
    /// What came may be the answer, or not; the unit may be there.
    Doubtful(String),
    /// The peer has closed a link over which it had answered before, and has sent no byte since.
    Closed(String),
    /// The link is of no use any more.
    Broken(String),
}

/// A way to a peer.
pub trait Link: Send + 'static {
    /// Whether a wrong answer costs only itself: the next question starts anew.
    const STARTS_ANEW: bool;

    /// Makes it, unless it is there.
    fn connect(&mut self) -> impl Future<Output = Result<(), Trouble>> + Send;

    /// Puts the PDU of a request to a unit; the PDU of the answer replaces what `answer` holds.
    /// It takes no longer than the device's `timeout`, beside the time of the wire.
    fn ask(
        &mut self,
        unit: u8,
        request: &[u8],
        answer: &mut Vec<u8>,
    ) -> impl Future<Output = Result<(), Failure>> + Send;

    /// Lets go of it.
    fn close(&mut self);
}
