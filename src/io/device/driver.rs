//! The trait of a driver: the operations that only a driver can do with its peer.
//!
//! A new driver is one file that implements [`Driver`] (or, for lines that answer at once,
//! `runtime::local::Local`); the recipe is in `CONTRIBUTING.md`. A driver may wait, but for no
//! longer than its own time limit; it has no clock of exchanges, no log and no memory of modes. A
//! driver whose exchange takes many requests looks between two of them whether a write [is
//! urgent](Exchange), and then ends in part; a driver that needs one request never has to.

use std::fmt;
use std::future::Future;

/// Why an exchange takes place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occasion {
    /// No scan is complete yet: read all inputs, so that the first scan sees them. Write nothing,
    /// and feed no watchdog.
    First,
    /// `poll` is over, or the previous exchange ended in part: write the outputs that changed or
    /// are due, feed a watchdog, read all inputs that are not read yet.
    Poll,
    /// An output changed: write the changed outputs. Inputs are not looked at.
    Change,
    /// The last exchange: write all outputs, which have their safe values. Inputs are not looked
    /// at.
    Last,
}

/// The extent of an exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// The exchange is complete.
    Whole,
    /// Some inputs are not read yet, because a write was urgent. The next exchange follows at once
    /// and continues from there. Each reads at least one group, so all inputs are read in the end.
    Part,
}

/// A request for one exchange.
pub struct Exchange<'a> {
    /// The reason for the exchange.
    pub occasion: Occasion,
    /// All outputs, one per point in the order of the map; bits are 0 and 1.
    pub outputs: &'a [i32],
    /// All inputs, one per point in the order of the map, to be filled in; `None`: not read yet.
    /// The scan sees them when the exchange is over: all together if it succeeds, and those that
    /// were read if it fails and the connection stays. A value beyond the memory's range becomes
    /// the nearest value in that range.
    pub inputs: &'a mut [Option<i32>],
    /// Whether outputs have changed since, or the end has come: then the inputs that are not read
    /// yet can wait.
    pub is_urgent: &'a (dyn Fn() -> bool + Send + Sync),
}

/// Why an exchange failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trouble {
    /// A clause for the log: `no answer in 200 ms`.
    pub reason: String,
    /// The connection cannot be used any more: connect again.
    pub is_disconnected: bool,
}

/// A driver that exchanges with its peer beside the scan.
pub trait Driver: Send + 'static {
    /// Connects to the peer, after the start and after every trouble that disconnects. The call may
    /// be abandoned at the end of the process. The next exchange writes all outputs.
    fn connect(&mut self) -> impl Future<Output = Result<(), Trouble>> + Send;

    /// Exchanges once. At the end of the process the call may be abandoned at any await;
    /// `disconnect` follows then.
    fn exchange(
        &mut self,
        exchange: Exchange<'_>,
    ) -> impl Future<Output = Result<Extent, Trouble>> + Send;

    /// Closes the connection to the peer.
    fn disconnect(&mut self);
}

impl Trouble {
    /// Trouble after which the connection stays: an exception, a value that makes no sense.
    pub fn kept(reason: impl Into<String>) -> Trouble {
        Trouble { reason: reason.into(), is_disconnected: false }
    }

    /// Trouble that ends the connection.
    pub fn disconnected(reason: impl Into<String>) -> Trouble {
        Trouble { reason: reason.into(), is_disconnected: true }
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reason)
    }
}
