//! All tests that need no process of their own, in folders that follow the modules. One binary
//! runs them side by side: while some wait for a period, a process or the compiler, others compute.

#![allow(unsafe_code, clippy::wildcard_enum_match_arm)]

mod cli;
mod daemon;
mod editor;
#[cfg(feature = "fleet")]
mod fleet;
mod house;
mod io;
mod language;
#[cfg(feature = "fleet")]
mod metrics;
mod record;
mod reload;
mod retain;
mod running;
#[cfg(feature = "web")]
mod web;
