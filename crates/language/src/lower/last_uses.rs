//! The last places that touched each cell, while operations are put into batches or groups.
//!
//! Used by `schedule` and `alike`: an operation must come after every earlier operation that shares
//! a written cell with it.

use rungd_engine::isa::NumberMap;
use rungd_engine::ops::TouchedCells;

/// For each cell, the last places that read and wrote it.
#[derive(Default)]
pub(super) struct LastUses {
    bits: NumberMap<u32, LastCellUses>,
    words: NumberMap<u32, LastCellUses>,
}

/// Each place plus 1; 0: there is no place.
#[derive(Clone, Copy, Default)]
struct LastCellUses {
    written: usize,
    read: usize,
}

impl LastUses {
    /// Records the cells that an operation at a place touches.
    pub fn mark(&mut self, touches: &TouchedCells, at: usize) {
        let mark = |uses: &mut NumberMap<u32, LastCellUses>, read: &[u32], written: &[u32]| {
            for cell in read {
                let uses = uses.entry(*cell).or_default();
                uses.read = uses.read.max(at + 1);
            }
            for cell in written {
                uses.entry(*cell).or_default().written = at + 1;
            }
        };
        mark(&mut self.bits, &touches.bits_read, &touches.bits_written);
        mark(&mut self.words, &touches.words_read, &touches.words_written);
    }

    /// The first place for an operation: not before any place that it must follow. With `behind`,
    /// it is after every place that wrote a cell that the operation reads, never at the same place.
    pub fn earliest(&self, touches: &TouchedCells, behind: bool) -> usize {
        let earliest = |uses: &NumberMap<u32, LastCellUses>, read: &[u32], written: &[u32]| {
            let last_use = |cell: &u32| uses.get(cell).copied().unwrap_or_default();
            let reads =
                read.iter().map(|cell| last_use(cell).written).filter(|written| *written > 0);
            let reads = reads.map(|written| written - 1 + usize::from(behind));
            let writes = written.iter().map(|cell| last_use(cell).written.max(last_use(cell).read));
            reads.chain(writes.map(|at| at.saturating_sub(1))).max().unwrap_or(0)
        };
        let bits = earliest(&self.bits, &touches.bits_read, &touches.bits_written);
        bits.max(earliest(&self.words, &touches.words_read, &touches.words_written))
    }
}
