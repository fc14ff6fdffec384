//! The points of a Modbus client, and how its peer is reached.

use super::Row;
use crate::source::device as written;
use crate::source::finding::Finding;

/// A point as written, for a help.
pub(super) const EXAMPLE: &str = "discrete-input 0";

/// A Modbus client's settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Client {}

/// Whether a text reads as points of a Modbus device.
pub(super) fn is_point(_text: &str) -> bool {
    false
}

pub(super) fn resolve(
    _device: &written::Device,
    _rows: &[Row<'_>],
    _findings: &mut Vec<Finding>,
) -> Option<Client> {
    None
}
