//! The values of an operand over the minute: the first one, and each change.

use std::sync::Arc;

use crate::engine::Cell;
use crate::observe::{CellChanged, Subject};
use crate::runtime::{TapeSection, scan_begins};

/// The most points of a trend. A longer one keeps the lowest and the highest value of each stretch.
const POINTS_MAX: usize = 4000;

/// The values of an operand.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Trend {
    /// The time of the first and the last scan, ns since 1970 (UTC).
    pub span_ns: Option<(i64, i64)>,
    /// The first value, and each change.
    pub points: Vec<CellChanged>,
}

pub(super) fn trend(subject: &Subject, sections: &[Arc<TapeSection>], cell: Cell) -> Trend {
    let points = thinned(subject.changes(sections, &[cell]));
    let first = points.first().map(|point| point.unix_ns);
    let last = sections.iter().rev().find_map(|section| {
        let begun = scan_begins(&section.entries, section.start.number).last()?;
        Some(section.start.unix_offset_ns.saturating_add_unsigned(begun.now_ns))
    });
    Trend { span_ns: first.zip(last), points }
}

/// Keeps the lowest and the highest value of each stretch, in their order.
fn thinned(points: Vec<CellChanged>) -> Vec<CellChanged> {
    if points.len() <= POINTS_MAX {
        return points;
    }
    let stretch = points.len().div_ceil(POINTS_MAX / 2);
    let ends = |points: &[CellChanged]| {
        let lowest = points.iter().min_by_key(|point| point.after).copied();
        let highest = points.iter().max_by_key(|point| point.after).copied();
        let mut both: Vec<CellChanged> = lowest.into_iter().chain(highest).collect();
        both.sort_by_key(|point| point.scan);
        both.dedup();
        both
    };
    points.chunks(stretch).flat_map(ends).collect()
}
