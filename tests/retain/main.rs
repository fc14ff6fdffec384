//! Retentive memory: its file on every kind of disk, and the real binary that keeps it.

mod changed;
mod cold;
mod crash;
mod disk;
mod disk_states;
mod format;
mod memory;
mod named;
mod places;
mod reals;
mod rig;
mod run;
mod shifts;

/// Each test binary uses only a part of the shared modules.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod calm;
    pub mod metronome;
    pub mod needs;
    pub mod numbers;
    pub mod process;
    pub mod setting;
    pub mod system;
}
