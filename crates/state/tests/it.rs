//! Reloads and retentive memory without a process.

#![allow(clippy::wildcard_enum_match_arm)]

mod reload;
mod retain;
