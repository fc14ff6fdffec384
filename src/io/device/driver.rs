//! What a driver is: the few things that only it knows of its peer.
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
    /// No scan is complete yet: read all inputs, so that the first scan sees them. Nothing is
    /// written, and no watchdog is fed.
    First,
    /// `poll` is over, or the exchange before it ended in part: write what changed or is due, feed
    /// a watchdog, read all inputs that are not read yet.
    Poll,
    /// An output changed: write what changed. Inputs are not looked at.
    Change,
    /// The last one: write all outputs, which are safe values. Inputs are not looked at.
    Last,
}

/// How far an exchange came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    /// To its end.
    Whole,
    /// Some inputs are not read yet, since something else was urgent. The next one, at once, goes
    /// on from there; each reads at least something, so that all are read in the end.
    Part,
}

/// One exchange, as a driver is asked for it.
pub struct Exchange<'a> {
    /// Why.
    pub occasion: Occasion,
    /// All outputs, one a point in the order of the map; bits are 0 and 1.
    pub outputs: &'a [i32],
    /// All inputs, one a point in the order of the map, to be filled in; `None`: not read yet. The
    /// scan sees them when the exchange is over: all together where it succeeds; those that were
    /// read where it fails and the connection stays. Values beyond what the memory holds are
    /// brought to its nearest.
    pub inputs: &'a mut [Option<i32>],
    /// Whether other outputs than these are to be written by now, or the end has come: inputs that
    /// are not read yet have time.
    pub is_urgent: &'a (dyn Fn() -> bool + Send + Sync),
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
    /// Reaches the peer, after the start and after every trouble that disconnects; at the end of
    /// the process it may be abandoned. The next exchange writes all outputs.
    fn connect(&mut self) -> impl Future<Output = Result<(), Trouble>> + Send;

    /// Exchanges once. At the end of the process it may be abandoned at any point where it waits;
    /// `disconnect` follows then.
    fn exchange(
        &mut self,
        exchange: Exchange<'_>,
    ) -> impl Future<Output = Result<Done, Trouble>> + Send;

    /// Lets go of the peer.
    fn disconnect(&mut self);
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
