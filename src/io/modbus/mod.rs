//! The Modbus TCP server: other programs read and write MC, MI, MHR and MIR, and what is mapped.
//!
//! `frame` finds frames in bytes, `pdu` gives them a meaning, `map` says which `elements` they are
//! and who may write them, `refusal` why not, `answer` what becomes of a request; all six are pure.
//! `connection` is one client, `guests` who is there, and `server` the listening socket. The daemon
//! binds and runs a [`Server`]; off unless the controller file has `[modbus-server]`. Deliberately
//! absent: tags' names, any way to the scan but the port, and limits for what is logged, which are
//! the log's. What a client sees is `docs/modbus.md`.

pub mod answer;
pub mod clients;
mod closed;
mod connection;
mod elements;
pub mod frame;
mod guests;
pub mod map;
pub mod number;
pub mod pdu;
pub mod refusal;
mod server;
pub mod settings;
mod shared;
#[cfg(test)]
mod tests;

pub use map::Map;
pub use server::Server;
