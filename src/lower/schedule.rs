//! Puts operations of one kind next to each other, without a change of the scan's result.
//!
//! Called by `assembler`, once an element. Most operations do not depend on each other. Two
//! neighbours may change places if neither writes a cell that the other reads or writes: afterwards
//! memory is the same. So every operation is put into the earliest possible batch of its kind: no
//! operation that it must follow may be in a later batch (it may be in the same one, because a
//! batch keeps its order). A batch runs in one loop, without dispatch and without branches to
//! predict.
//!
//! No operation moves past a control operation, nor farther than the window: the cells that one
//! batch writes should still be in the cache when the next batch reads them.

use std::collections::HashMap;

use super::regions::Regions;
use crate::engine::ops::{Formulas, Op, OpKind, Touches};
use crate::isa::NumberMap;

/// Number of operations that are scheduled together.
pub const WINDOW: usize = 4096;

/// Puts an element's operations, given in file order, into batches of one kind each. `formulas` are
/// those of the MATHs. `has_arrays`: whether an operation may touch an array
/// whose element is known at run time only.
pub(crate) fn schedule(
    ops: Vec<Op>,
    formulas: Formulas,
    has_arrays: bool,
    window: usize,
) -> Vec<Vec<Op>> {
    let mut batches = Vec::new();
    let regions = if has_arrays { Regions::of(&ops, formulas) } else { Regions::default() };
    let regions = &regions;
    let begin = || {
        let touches = Touches { formulas, ..Touches::default() };
        Segment { touches, regions: Some(regions), ..Segment::default() }
    };
    let mut segment = begin();
    for op in ops {
        if op.kind() == OpKind::Control {
            batches.append(&mut std::mem::replace(&mut segment, begin()).batches);
            batches.push(vec![op]);
            continue;
        }
        if segment.count == window {
            batches.append(&mut std::mem::replace(&mut segment, begin()).batches);
        }
        segment.place(op);
    }
    batches.append(&mut segment.batches);
    batches
}

/// The last batches that touched a cell, by their position + 1; 0: none.
#[derive(Clone, Copy, Default)]
struct BatchUses {
    written: usize,
    read: usize,
}

#[derive(Default)]
struct Segment<'f> {
    batches: Vec<Vec<Op>>,
    /// The positions of the batches of each kind, ascending.
    of_kind: HashMap<OpKind, Vec<usize>>,
    bits: NumberMap<u32, BatchUses>,
    words: NumberMap<u32, BatchUses>,
    touches: Touches<'f>,
    regions: Option<&'f Regions>,
    count: usize,
}

impl Segment<'_> {
    fn place(&mut self, op: Op) {
        self.touches.clear();
        op.touches(&mut self.touches);
        if let Some(regions) = self.regions {
            regions.represent(&mut self.touches);
        }
        let at = self.batch_at_or_behind(op.kind(), self.earliest());
        let mark = |uses: &mut NumberMap<u32, BatchUses>, read: &[u32], written: &[u32]| {
            for cell in read {
                let uses = uses.entry(*cell).or_default();
                uses.read = uses.read.max(at + 1);
            }
            for cell in written {
                uses.entry(*cell).or_default().written = at + 1;
            }
        };
        mark(&mut self.bits, &self.touches.bits_read, &self.touches.bits_written);
        mark(&mut self.words, &self.touches.words_read, &self.touches.words_written);
        self.batches[at].push(op);
        self.count += 1;
    }

    /// The first position that is not before a batch with an operation that this one must follow.
    fn earliest(&self) -> usize {
        let behind = |uses: &NumberMap<u32, BatchUses>, read: &[u32], written: &[u32]| {
            let of = |cell: &u32| uses.get(cell).copied().unwrap_or_default();
            let reads = read.iter().map(|cell| of(cell).written);
            let writes = written.iter().map(|cell| of(cell).written.max(of(cell).read));
            reads.chain(writes).max().unwrap_or(0)
        };
        let t = &self.touches;
        let bits = behind(&self.bits, &t.bits_read, &t.bits_written);
        let words = behind(&self.words, &t.words_read, &t.words_written);
        bits.max(words).saturating_sub(1)
    }

    fn batch_at_or_behind(&mut self, kind: OpKind, earliest: usize) -> usize {
        let positions = self.of_kind.entry(kind).or_default();
        let first = positions.partition_point(|at| *at < earliest);
        if let Some(at) = positions.get(first) {
            return *at;
        }
        self.batches.push(Vec::new());
        positions.push(self.batches.len() - 1);
        self.batches.len() - 1
    }
}
