//! The cells that each step of a slice may write, and the operations that touch a cell.
//!
//! Cells have numbers, bits first. For a structure all cells are listed, with its private state, so
//! that the listed cells contain the whole state of every operation.

/// The maximum number of cells of an operation that is listed at each of its cells.
const LISTED_MAX: usize = 64;

/// The cells of the steps of a slice: of its batches, then of all passes, then of all turns.
#[derive(Clone, Debug)]
pub struct SliceCells {
    /// For each step, the cells that it may write.
    written: NumberLists,
    /// For each cell, the batches that read or write it.
    touching: NumberLists,
    /// The batches that touch many cells, each with these cells in ascending order.
    wide: Vec<(u32, Vec<u32>)>,
    /// For each batch, whether it can act although none of its cells changed: control, and timers.
    pub moves: Vec<bool>,
}

impl SliceCells {
    /// The cells that a step may write.
    pub fn written(&self, step: usize) -> &[u32] {
        self.written.list(step)
    }

    /// The batches that touch a cell.
    pub fn touching(&self, cell: u32) -> impl Iterator<Item = u32> + use<'_> {
        let wide = self.wide.iter().filter(move |(_, cells)| cells.binary_search(&cell).is_ok());
        self.touching.list(cell as usize).iter().copied().chain(wide.map(|(batch, _)| *batch))
    }
}

/// Lists of numbers, stored one behind the other.
#[derive(Clone, Debug)]
struct NumberLists {
    /// For each list, the index of its first number in `all`; the last entry is the end.
    from: Vec<u32>,
    all: Vec<u32>,
}

impl NumberLists {
    fn list(&self, list: usize) -> &[u32] {
        &self.all[self.from[list] as usize..self.from[list + 1] as usize]
    }
}

/// Builds a wiring: first from the batches, then from the other steps.
pub(super) struct SliceCellsBuilder {
    cells: usize,
    written: NumberLists,
    /// Cells with the batches that touch them.
    touches: Vec<(u32, u32)>,
    wide: Vec<(u32, Vec<u32>)>,
    moves: Vec<bool>,
}

impl SliceCellsBuilder {
    /// A maker for this number of cells.
    pub fn new(cells: usize) -> SliceCellsBuilder {
        let written = NumberLists { from: vec![0], all: Vec::new() };
        SliceCellsBuilder {
            cells,
            written,
            touches: Vec::new(),
            wide: Vec::new(),
            moves: Vec::new(),
        }
    }

    /// Adds the next batch.
    pub fn batch(&mut self, read: &[u32], written: &[u32], moves: bool) {
        let batch = self.moves.len() as u32;
        let touched = read.iter().chain(written).copied();
        if read.len() + written.len() > LISTED_MAX {
            let mut cells: Vec<u32> = touched.collect();
            cells.sort_unstable();
            self.wide.push((batch, cells));
        } else {
            self.touches.extend(touched.map(|cell| (cell, batch)));
        }
        self.moves.push(moves);
        self.step(written);
    }

    /// Adds the next step behind all batches.
    pub fn step(&mut self, written: &[u32]) {
        self.written.all.extend_from_slice(written);
        self.written.from.push(self.written.all.len() as u32);
    }

    /// The finished wiring.
    pub fn wired(self) -> SliceCells {
        let SliceCellsBuilder { cells, written, touches, wide, moves } = self;
        let mut from = vec![0; cells + 1];
        touches.iter().for_each(|(cell, _)| from[*cell as usize + 1] += 1);
        for at in 0..cells {
            from[at + 1] += from[at];
        }
        let (mut next, mut all) = (from.clone(), vec![0; touches.len()]);
        for (cell, batch) in touches {
            all[next[cell as usize] as usize] = batch;
            next[cell as usize] += 1;
        }
        SliceCells { written, touching: NumberLists { from, all }, wide, moves }
    }
}
