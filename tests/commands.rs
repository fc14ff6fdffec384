//! The commands of `rungd`, and recordings of the scan log. As in each of these binaries, the tests
//! of all folders run side by side: while some wait for a process, others compute.

#![allow(unsafe_code, clippy::wildcard_enum_match_arm)]

mod cli;
mod record;
