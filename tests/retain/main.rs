//! Retentive memory: its file on every kind of disk, and the binary that keeps it.

mod changed;
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

/// A binary uses a part of what they share.
#[allow(dead_code)]
#[path = "../support"]
mod support {
    pub mod calm;
    pub mod metronome;
    pub mod needs;
    pub mod process;
}
