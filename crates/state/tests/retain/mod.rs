//! Retentive memory: its file on every kind of disk, and the real binary that keeps it.

mod disk;
mod disk_states;
mod format;
