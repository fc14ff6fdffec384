//! The Modbus clients: remote I/O whose points are inputs and outputs of the controller.
//!
//! `plan` groups points into few requests, `outputs` plans the writes, `request` and `answer` have
//! the PDUs in both directions, `values` converts registers and numbers, `rtu` has the frames of a
//! serial line; all six are pure. [`Client`] is the driver of one device. It exchanges with each
//! `unit` through `talk` over a [`Link`], which is `tcp` or `serial`. `tcp` uses the frames of the
//! server ([`super::modbus::frame`]). `io::device` decides the times of exchanges and the reaction
//! to trouble. `docs/modbus-devices.md` describes the devices for authors.

pub mod answer;
mod client;
mod link;
mod outputs;
mod plan;
mod request;
pub mod rtu;
mod serial;
pub mod settings;
mod talk;
mod tcp;
mod unit;
mod values;

pub use client::Client;
pub use link::Link;
pub use serial::{Rtu, SerialLines};
pub use tcp::Tcp;
