//! rungd: a soft-PLC for Linux. The map, from the ground up; a module uses only those above it
//! in this list.

// But for the system calls of the scan thread, in `runtime/sys.rs`, those of the operator's
// socket, in `daemon/operator/peer.rs`, and a serial line handed to tokio, in
// `io/modbus_client/serial.rs`.
#![deny(unsafe_code)]

mod calendar;
pub mod check;
pub mod cli;
pub mod controller;
mod daemon;
pub mod engine;
pub mod events;
pub mod faults;
pub mod io;
pub mod isa;
pub mod load;
pub mod lower;
pub mod operator;
pub mod reload;
pub mod resolve;
pub mod retain;
pub mod runtime;
mod say;
pub mod sim;
pub mod source;
