//! The arrays of an element's operations, each represented by its first cell.
//!
//! Called by `schedule`. If the index of an operation is known only at run time, the operation
//! counts as touching every cell of its array. Arrays that share cells are one region. A cell
//! within a region counts as the region's first cell, even if an operation uses the cell's own
//! address. A bit of a word as the target of MATH is an array of one word. The operations
//! themselves say which arrays they touch, so that no instruction can be left out.

use std::ops::Range;

pub use rungd_engine::ops::{CellRange, Formulas, Op, TouchedCells};

/// The regions of bits and of words, ascending and disjoint.
#[derive(Debug, Default)]
pub(super) struct Regions {
    bits: Vec<Range<u32>>,
    words: Vec<Range<u32>>,
}

impl Regions {
    /// The regions of operations.
    pub fn of(ops: &[Op], formulas: Formulas) -> Regions {
        let mut touches = TouchedCells { formulas, ..TouchedCells::default() };
        let (mut bits, mut words) = (Vec::new(), Vec::new());
        for op in ops {
            touches.clear();
            op.touches(&mut touches);
            let t = &touches;
            bits.extend(t.bit_arrays_read.iter().chain(&t.bit_arrays_written).map(range));
            words.extend(t.word_arrays_read.iter().chain(&t.word_arrays_written).map(range));
        }
        Regions { bits: joined(bits), words: joined(words) }
    }

    /// Replaces every cell within a region by the region's first cell.
    pub fn represent(&self, touches: &mut TouchedCells) {
        if self.bits.is_empty() && self.words.is_empty() {
            return;
        }
        let first = |cells: &CellRange| cells.first;
        touches.bits_read.extend(touches.bit_arrays_read.iter().map(first));
        touches.bits_written.extend(touches.bit_arrays_written.iter().map(first));
        touches.words_read.extend(touches.word_arrays_read.iter().map(first));
        touches.words_written.extend(touches.word_arrays_written.iter().map(first));
        let bits = touches.bits_read.iter_mut().chain(&mut touches.bits_written);
        bits.for_each(|cell| *cell = representative(&self.bits, *cell));
        let words = touches.words_read.iter_mut().chain(&mut touches.words_written);
        words.for_each(|cell| *cell = representative(&self.words, *cell));
    }
}

fn range(cells: &CellRange) -> Range<u32> {
    cells.first..cells.first + cells.count
}

/// Joins ranges that share cells.
fn joined(mut ranges: Vec<Range<u32>>) -> Vec<Range<u32>> {
    ranges.sort_by_key(|range| range.start);
    let mut joined: Vec<Range<u32>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last) if range.start < last.end => last.end = last.end.max(range.end),
            _ => joined.push(range),
        }
    }
    joined
}

fn representative(regions: &[Range<u32>], cell: u32) -> u32 {
    let at = regions.partition_point(|region| region.end <= cell);
    regions.get(at).filter(|region| region.contains(&cell)).map_or(cell, |region| region.start)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_that_share_cells_join_one_region() {
        let regions = joined(vec![20..30, 0..5, 4..10, 10..12]);
        assert_eq!(regions, [0..10, 10..12, 20..30]);
        let of = |cell| representative(&regions, cell);
        assert_eq!([of(3), of(9), of(11), of(12), of(29), of(30)], [0, 0, 10, 12, 20, 30]);
        assert_eq!(representative(&[], 7), 7);
    }
}
