//! Retentive memory: its file on every kind of disk, and the real binary that keeps it.

mod changed;
mod cold;
mod crash;
mod down_time;
mod memory;
mod named;
mod places;
mod reals;
mod rig;
mod run;
mod shifts;
mod stage_series;
mod stages;
mod stalled_start;
