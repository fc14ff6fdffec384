//! The Modbus clients: remote I/O whose points are inputs and outputs of the controller.
//!
//! `plan` groups points into few requests, `outputs` plans the writes, `request` and `answer` have
//! the PDUs in both directions, `values` converts registers and numbers, `rtu` has the frames of
//! Modbus RTU; all six are pure. [`ModbusClient`] is the driver of one device. It exchanges with
//! each `unit` through `talk` over a [`PeerLink`]: `tcp` has the frames of Modbus TCP, which are
//! the server's ([`super::modbus::frame`]); `line` has the frames of Modbus RTU over a `port`,
//! which is a serial line or a connection. `pace` keeps the habits of a peer (delays, pauses) for
//! both links. [`VirtualDevice`] is the driver in virtual time, with a peer that answers at once.
//! `io::device` decides the times of exchanges and the reaction to trouble.
//! `docs/modbus-devices.md` describes the devices for authors.

pub mod answer;
mod client;
mod line;
mod link;
mod outputs;
mod pace;
mod plan;
mod port;
mod request;
pub mod rtu;
pub mod settings;
mod talk;
mod tcp;
mod unit;
mod values;
mod virtual_device;

pub use client::ModbusClient;
pub use line::{RtuLines, RtuLink};
pub use link::{LinkFailure, PeerLink};
pub use outputs::{OutputRun, runs};
pub use plan::reads;
pub use tcp::TcpConnection;
pub use virtual_device::{RegisterPeer, VirtualDevice};
