//! The lines of a chip, and how they are asked for.

use super::Row;
use crate::source::device as written;
use crate::source::finding::Finding;

/// A point as written, for a help.
pub(super) const EXAMPLE: &str = "line 17";

/// Local lines.
#[derive(Clone, Debug, PartialEq)]
pub struct Gpio {}

/// Whether a text reads as lines.
pub(super) fn is_point(_text: &str) -> bool {
    false
}

pub(super) fn resolve(
    _device: &written::Device,
    _rows: &[Row<'_>],
    _findings: &mut Vec<Finding>,
) -> Option<Gpio> {
    None
}
