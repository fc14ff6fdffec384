//! The Modbus clients: remote I/O whose points become inputs, and take outputs.
//!
//! `plan` groups points into few requests, `outputs` knows what was written and what is to be,
//! `request` and `answer` are the PDUs on their way there and back, `values` what the bits of
//! registers are as numbers, `rtu` the frames of a serial line; all six are pure. [`Client`] is
//! the driver, one a device; its `talk` with each `unit` goes over a [`Link`]: `tcp` or `serial`.
//! Frames of TCP are the server's ([`super::modbus::frame`]). When to exchange, and what becomes of
//! trouble, is `io::device`'s business. What an author sees is `docs/modbus-devices.md`.

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
pub use link::{Failure, Link};
pub use serial::{Rtu, SerialLines};
pub use tcp::Tcp;
