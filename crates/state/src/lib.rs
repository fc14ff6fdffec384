//! What outlives a program or a process: [`reload`] compares two programs, and says which elements
//! continue; [`retain`] keeps retentive memory on a disk whose power may fail.
//!
//! There is no thread, no clock and no log here: the daemon has these.

pub mod reload;
pub mod retain;
