//! Lays operations of one kind next to each other, without anyone being able to tell.
//!
//! A rung's operations do not depend on most other rungs' operations. Two neighbours may change
//! places when neither writes what the other reads or writes: after both, memory is the same. So
//! every operation is put into the earliest batch of its kind that stands behind all batches
//! holding an operation it must follow (within a batch, order is kept, so the same batch will do).
//! A batch runs in one loop: no dispatch, and nothing for the processor to guess.
//!
//! Nothing passes a control operation, and nothing moves by more than the window: what one batch
//! writes shall still be in the cache when the next reads it.

use std::collections::HashMap;

use crate::engine::ops::{Op, OpKind, Touches};

/// How many operations are put in order together.
pub const WINDOW: usize = 4096;

/// Puts an element's operations, given in file order, into batches of one kind each.
pub fn schedule(ops: Vec<Op>, window: usize) -> Vec<Vec<Op>> {
    let mut batches = Vec::new();
    let mut segment = Segment::default();
    for op in ops {
        if op.kind() == OpKind::Control {
            batches.append(&mut std::mem::take(&mut segment).batches);
            batches.push(vec![op]);
            continue;
        }
        if segment.count == window {
            batches.append(&mut std::mem::take(&mut segment).batches);
        }
        segment.place(op);
    }
    batches.append(&mut segment.batches);
    batches
}

/// Which batches touched a cell, by their position + 1; 0: none.
#[derive(Clone, Copy, Default)]
struct Uses {
    written: usize,
    read: usize,
}

#[derive(Default)]
struct Segment {
    batches: Vec<Vec<Op>>,
    /// The positions of the batches of each kind, ascending.
    of_kind: HashMap<OpKind, Vec<usize>>,
    bits: HashMap<u32, Uses>,
    words: HashMap<u32, Uses>,
    touches: Touches,
    count: usize,
}

impl Segment {
    fn place(&mut self, op: Op) {
        self.touches.clear();
        op.touches(&mut self.touches);
        let at = self.batch_at_or_behind(op.kind(), self.earliest());
        let mark = |uses: &mut HashMap<u32, Uses>, read: &[u32], written: &[u32]| {
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

    /// The first position that does not stand before a batch which the operation must follow.
    fn earliest(&self) -> usize {
        let behind = |uses: &HashMap<u32, Uses>, read: &[u32], written: &[u32]| {
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
