//! The server, driven by a raw client over a real socket, before a controller that is the real
//! exchange and a made-up scan.

mod controller;
mod functions;
mod hostile;
mod limits;
mod log;
mod scans;

use std::net::SocketAddr;

use crate::resolve::controller::Modbus;
use crate::resolve::range::{Range, Space};
use crate::source::span::Span;

/// A server on a port of loopback that the system chooses; nothing is writable.
pub(super) fn loopback() -> Modbus {
    Modbus {
        listen: SocketAddr::from(([127, 0, 0, 1], 0)),
        writable: Vec::new(),
        inputs: None,
        outputs: None,
        connections: 8,
        frame_timeout_ms: 2_000,
        idle_timeout_ms: 60_000,
    }
}

/// Elements of a space.
pub(super) fn range(space: Space, first: u32, last: u32) -> Range {
    Range { space, first, last, span: Span::default() }
}
