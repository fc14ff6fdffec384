//! The parts of a simulated plant, and the points they have.

use super::Row;
use crate::source::device as written;
use crate::source::finding::Finding;

/// A point as written, for a help.
pub(super) const EXAMPLE: &str = "belt.eye";

/// A simulated plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {}

/// Whether a text reads as points of the plant.
pub(super) fn is_point(_device: &written::Device, _text: &str) -> bool {
    false
}

pub(super) fn resolve(
    _device: &written::Device,
    _rows: &[Row<'_>],
    _findings: &mut Vec<Finding>,
) -> Option<Plant> {
    None
}
