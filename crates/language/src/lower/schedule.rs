//! Puts operations of one kind next to each other, without a change of the scan's result.
//!
//! Called by `assembler`, once for each element. Most operations do not depend on each other. Two
//! neighbours may change places if neither writes a cell that the other reads or writes: afterwards
//! memory is the same. So every operation is put into the earliest possible batch of its kind: no
//! operation that it must follow may be in a later batch (it may be in the same one, because a
//! batch keeps its order). A batch runs in one loop, without dispatch and without branches to
//! predict.
//!
//! No operation moves past a control operation, nor farther than the window: the cells that one
//! batch writes should still be in the cache when the next batch reads them.

use std::collections::HashMap;

use super::last_uses::LastUses;
use super::regions::Regions;
pub use rungd_engine::ops::{Formulas, Op, OpKind, TouchedCells};

/// Number of operations that are scheduled together.
pub const WINDOW: usize = 4096;

/// Puts an element's operations, given in file order, into batches of one kind each. `formulas` are
/// the formulas of the MATHs.
pub(crate) fn schedule(ops: Vec<Op>, formulas: Formulas, window: usize) -> Vec<Vec<Op>> {
    let mut batches = Vec::new();
    let regions = &Regions::of(&ops, formulas);
    let begin = || Segment {
        batches: Vec::new(),
        of_kind: HashMap::new(),
        uses: LastUses::default(),
        touches: TouchedCells { formulas, ..TouchedCells::default() },
        regions,
        count: 0,
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

struct Segment<'f> {
    batches: Vec<Vec<Op>>,
    /// The positions of the batches of each kind, ascending.
    of_kind: HashMap<OpKind, Vec<usize>>,
    uses: LastUses,
    touches: TouchedCells<'f>,
    regions: &'f Regions,
    count: usize,
}

impl Segment<'_> {
    fn place(&mut self, op: Op) {
        self.touches.clear();
        op.touches(&mut self.touches);
        self.regions.represent(&mut self.touches);
        let earliest = self.uses.earliest(&self.touches, false);
        let at = self.batch_at_or_behind(op.kind(), earliest);
        self.uses.mark(&self.touches, at);
        self.batches[at].push(op);
        self.count += 1;
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
