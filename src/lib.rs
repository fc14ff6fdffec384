//! rungd: a soft-PLC for Linux. `ARCHITECTURE.md` lists the modules from the top down; a module
//! uses only those below it in that list.

// Three files are exempt: `runtime/sys.rs` (system calls of the scan thread),
// `daemon/operator/peer.rs` (system calls of the operator's socket) and
// `io/modbus_client/serial.rs` (hands a serial line to tokio).
#![deny(unsafe_code)]
// If a variant is added later, the compiler must report every match that needs it.
#![deny(clippy::wildcard_enum_match_arm)]

mod byte_source;
pub mod calendar;
pub mod check;
pub mod cli;
pub mod controller;
mod daemon;
mod directories;
pub mod draw;
mod duration_text;
#[cfg(feature = "fleet")]
pub mod edge;
pub mod editor;
pub mod engine;
pub mod events;
pub mod explain;
mod faults;
#[cfg(feature = "fleet")]
pub mod fleet;
pub mod format;
#[cfg(any(feature = "web", feature = "fleet"))]
mod http;
pub mod io;
pub mod isa;
pub mod live;
pub mod load;
mod locked;
pub mod lower;
#[cfg(feature = "fleet")]
pub mod metrics;
#[cfg(feature = "monitor")]
mod monitor;
#[cfg(feature = "fleet")]
pub mod mqtt;
pub mod observe;
pub mod operator;
pub mod playback;
mod progress;
mod random;
pub mod record;
mod regular_file;
pub mod reload;
pub mod resolve;
pub mod retain;
pub mod rig;
pub mod runtime;
mod say;
pub mod sim;
pub mod source;
#[cfg(feature = "fleet")]
pub mod sparkplug;
pub mod testing;
mod variants;
mod wall_clock;
#[cfg(feature = "web")]
pub mod web;
#[cfg_attr(not(all(feature = "web", feature = "fleet")), allow(dead_code))]
mod whole_file;
