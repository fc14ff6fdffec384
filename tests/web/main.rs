//! `rungd web`: the real process with a real controller. The tests have their own client, which
//! sends both a browser's requests and requests that no browser would send.
#![cfg(feature = "web")]

mod client;
mod crowd;
mod pages;
mod secured;
mod strangers;
mod users;

/// Each test binary uses only a part of the shared modules.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod calm;
    pub mod live;
    pub mod metronome;
    pub mod needs;
    pub mod system;
}
