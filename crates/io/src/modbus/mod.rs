//! The Modbus TCP server: other programs read and write MC, MI, MHR and MIR, and mapped operands.
//!
//! `frame` finds frames in bytes, `pdu` reads requests from them, `map` finds their `elements` and
//! checks write permissions, `refusal` has the reasons of refusals, and `answer` decides on a
//! request; all six are pure. `connection` serves one client, and `server` has the listening
//! socket. The daemon binds and runs a [`BoundModbusServer`] if the controller file has
//! `[modbus-server]`. The server does not use tags' names, reaches the scan only through the port,
//! and does not limit its log lines, because the log does. `docs/modbus.md` describes the server
//! for its clients.

pub mod answer;
pub mod clients;
mod closed;
mod connection;
mod elements;
pub mod frame;
pub mod map;
pub mod number;
pub(crate) mod pdu;
pub mod places;
pub(crate) mod refusal;
mod server;
pub mod settings;
mod shared;
#[cfg(test)]
mod tests;

pub use map::ModbusMap;
pub use server::BoundModbusServer;
