//! Tests of the server. A raw client drives it over a real socket. The exchange of images is the
//! real one; the scan is simulated.

mod controller;
mod functions;
mod hostile;
mod limits;
mod log;
mod map;
mod mapped;
mod scans;

use std::net::SocketAddr;

use crate::modbus::settings::{ModbusServerSettings, WriteList};
use rungd_engine::isa::{MemorySizes, Space, address_text};
use rungd_language::resolve::operands::Operands;
use rungd_language::resolve::range::Range;
use rungd_language::source::span::Span;

/// A server on a port of loopback that the system chooses; nothing is writable.
pub(super) fn loopback() -> ModbusServerSettings {
    ModbusServerSettings {
        listen: SocketAddr::from(([127, 0, 0, 1], 0)),
        units: None,
        standard_map: true,
        entries: Vec::new(),
        lists: vec![any_client(&[])],
        inputs: None,
        outputs: None,
        connections: 8,
        frame_timeout_ms: 2_000,
        idle_timeout_ms: 60_000,
    }
}

/// A range of elements of one space.
pub(super) fn range(space: Space, first: u32, last: u32) -> Range {
    Range { space, first, last, span: Span::default(), of_tag: false, of_record: false }
}

/// A write list of addresses and ranges for every client.
pub(super) fn any_client(ranges: &[&str]) -> WriteList {
    WriteList { ranges: ranges.iter().map(|text| operands(text)).collect(), clients: None }
}

/// Operands from addresses or ranges as text, without tags.
pub(super) fn operands(text: &str) -> Operands {
    let address = |text| address_text::parse(text, &MemorySizes::default()).unwrap();
    let (low, high) = text.split_once("..").unwrap_or((text, text));
    let (first, last) = (address(low), address(high));
    let mut all = Operands {
        first,
        count: 1,
        text: text.to_owned(),
        is_placed: false,
        span: Span::default(),
    };
    while !all.hold(last) {
        all.count += 1;
    }
    all
}
