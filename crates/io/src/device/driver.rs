//! The trait of a driver: the operations with a peer, which each driver implements for itself.
//!
//! A new driver is one file that implements [`Driver`] (or, for lines that answer at once,
//! `runtime::local::Local`); the recipe is in `CONTRIBUTING.md`. A driver may wait, but no longer
//! than its own time limit. It does not schedule exchanges, write log lines or remember modes. A
//! driver whose exchange takes several requests checks between two requests whether a write [is
//! urgent](Exchange); if so, it ends the exchange in part. A driver that needs only one request
//! does not have to check.

use std::fmt;
use std::future::Future;

/// Why an exchange takes place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExchangeReason {
    /// No scan is complete yet: read all inputs, so that the first scan sees them. Write nothing,
    /// and feed no watchdog.
    First,
    /// `poll` is over, or the previous exchange ended in part: write the outputs that changed or
    /// are due, feed a watchdog, read all inputs that are not read yet.
    Poll,
    /// An output changed: write the changed outputs. Inputs are not read.
    Change,
    /// The last exchange: write all outputs, which have their safe values. Inputs are not read.
    Last,
}

/// The extent of an exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExchangeExtent {
    /// The exchange is complete.
    Whole,
    /// Some inputs are not read yet, because a write was urgent. The next exchange follows at once
    /// and continues from there. Each exchange reads at least one group, so all inputs are read in
    /// the end.
    Part,
}

/// A request for one exchange.
pub struct Exchange<'a> {
    /// The reason for the exchange.
    pub occasion: ExchangeReason,
    /// The values of all outputs, one per point, in the order of the map; a bit is 0 or 1.
    pub outputs: &'a [i32],
    /// All inputs, one per point, in the order of the map; the driver fills them in. `None`: not
    /// read yet. The scan receives them at the end of the exchange: all of them if it succeeds;
    /// only those that were read if it fails and the connection stays. A value beyond the memory's
    /// range becomes the nearest value in that range.
    pub inputs: &'a mut [Option<i32>],
    /// Whether outputs have changed since the exchange began, or the process is to end. If so, the
    /// inputs that are not read yet can wait.
    pub is_urgent: &'a (dyn Fn() -> bool + Send + Sync),
}

/// Why an exchange failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExchangeFailure {
    /// A clause for the log: `no answer in 200 ms`.
    pub reason: String,
    /// Whether the connection cannot be used any more, so that the task has to connect again.
    pub is_disconnected: bool,
    /// Whether it is only the trouble of an earlier exchange, because a part of the peer rests and
    /// got no request in this one. Such an exchange counts no failure.
    pub is_repeated: bool,
}

/// A driver that exchanges with its peer beside the scan.
pub trait Driver: Send + 'static {
    /// Connects to the peer, after the start and after every trouble that disconnects. The call may
    /// be abandoned at the end of the process. The next exchange writes all outputs.
    fn connect(&mut self) -> impl Future<Output = Result<(), ExchangeFailure>> + Send;

    /// Exchanges once. At the end of the process the call may be abandoned at any await;
    /// `disconnect` follows then.
    fn exchange(
        &mut self,
        exchange: Exchange<'_>,
    ) -> impl Future<Output = Result<ExchangeExtent, ExchangeFailure>> + Send;

    /// Closes the connection to the peer.
    fn disconnect(&mut self);
}

impl ExchangeFailure {
    /// Trouble after which the connection stays: an exception, or a value that is not valid.
    pub fn kept(reason: impl Into<String>) -> ExchangeFailure {
        ExchangeFailure { reason: reason.into(), is_disconnected: false, is_repeated: false }
    }

    /// Trouble that ends the connection.
    pub fn disconnected(reason: impl Into<String>) -> ExchangeFailure {
        ExchangeFailure { reason: reason.into(), is_disconnected: true, is_repeated: false }
    }
}

impl fmt::Display for ExchangeFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reason)
    }
}
