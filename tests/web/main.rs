//! `rungd web`: the real process beside a real controller, asked by a client of the tests' own that
//! sends what a browser sends, and what it never would.
#![cfg(feature = "web")]

mod client;
mod crowd;
mod pages;
mod secured;
mod strangers;
mod users;

/// A binary uses a part of what they share.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod calm;
    pub mod live;
    pub mod metronome;
    pub mod needs;
}
