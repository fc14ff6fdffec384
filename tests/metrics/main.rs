//! `rungd metrics` with a controller: its metrics, its clients, and a Prometheus that scrapes it.
#![cfg(feature = "fleet")]

mod files;
mod hostile;
mod prometheus;
mod rig;
mod scrapes;

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
