//! What a driver is: the few things that only it knows of its peer.
//!
//! A new driver is one file that implements [`Driver`] (or, for lines that answer at once,
//! `runtime::field::Local`); the recipe is in `CONTRIBUTING.md`. It may wait, but for no longer
//! than its own time limit; it has no clock of exchanges, no log and no memory of modes.

use std::fmt;
use std::future::Future;

/// Why an exchange takes place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occasion {
    /// No scan is complete yet: read all inputs, so that the first scan sees them. Nothing is
    /// written, and no watchdog is fed.
    First,
    /// `poll` is over: write what changed or is due, feed a watchdog, read all inputs.
    Poll,
    /// An output changed: write what changed. Inputs are not looked at.
    Change,
    /// The last one: write all outputs, which are safe values. Inputs are not looked at.
    Last,
}

/// One exchange, as a driver is asked for it.
#[derive(Debug)]
pub struct Exchange<'a> {
    /// Why.
    pub occasion: Occasion,
    /// All outputs, one a point in the order of the map; bits are 0 and 1.
    pub outputs: &'a [i32],
    /// All inputs, one a point in the order of the map: as they were read last. Seen by the scan
    /// only if the exchange succeeds, and then all together. Values beyond what the memory holds
    /// are brought to its nearest.
    pub inputs: &'a mut [i32],
}

/// Why an exchange failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trouble {
    /// A clause for the log: `no answer in 200 ms`.
    pub reason: String,
    /// The connection is of no use any more: connect again.
    pub is_disconnected: bool,
}

/// A peer that is reached beside the scan.
pub trait Driver: Send + 'static {
    /// Reaches the peer, after the start and after every trouble that disconnects. The next
    /// exchange writes all outputs.
    fn connect(&mut self) -> impl Future<Output = Result<(), Trouble>> + Send;

    /// Exchanges once. An error leaves the scan's inputs as they were.
    fn exchange(
        &mut self,
        exchange: Exchange<'_>,
    ) -> impl Future<Output = Result<(), Trouble>> + Send;

    /// Lets go of the peer.
    fn disconnect(&mut self);

    /// Whom the log names: `127.0.0.1:502`.
    fn peer(&self) -> String;
}

impl Trouble {
    /// Trouble that the connection outlives: an exception, a value that makes no sense.
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
