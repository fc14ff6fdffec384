//! `rungd metrics` beside a controller: what it says, to whom, and a Prometheus that reads it.
#![cfg(feature = "fleet")]

mod files;
mod hostile;
mod prometheus;
mod rig;
mod scrapes;

/// A binary uses a part of what they share.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod calm;
    pub mod live;
    pub mod metronome;
    pub mod needs;
}
