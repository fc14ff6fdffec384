//! A controller that runs: the daemon, its devices, retentive memory, reload.

#![allow(unsafe_code, clippy::wildcard_enum_match_arm)]

mod daemon;
mod io;
mod reload;
mod retain;
