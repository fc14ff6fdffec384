//! The list of forced bits and words.
//!
//! The scan thread has one such list, and each snapshot contains a copy. No allocation after the
//! start. The values are in memory: a forced cell of the engine keeps its forced value.

use rungd_engine::{BitCell, Cell};

/// The maximum number of bits and words that are forced at the same time.
pub const FORCES_MAX: usize = 256;

/// The forced cells: allocated once, copied from snapshot to snapshot.
#[derive(Clone, Debug)]
pub struct Forces {
    cells: Box<[Cell]>,
    count: usize,
}

impl Default for Forces {
    fn default() -> Self {
        let none = Cell::Bit(BitCell(0));
        Forces { cells: vec![none; FORCES_MAX].into(), count: 0 }
    }
}

impl Forces {
    /// The cells, in the order in which they were forced.
    pub fn list(&self) -> &[Cell] {
        &self.cells[..self.count]
    }

    /// Whether a cell is forced.
    pub fn has(&self, cell: Cell) -> bool {
        self.list().contains(&cell)
    }

    /// Adds a cell; false if there are too many.
    pub(super) fn add(&mut self, cell: Cell) -> bool {
        if self.has(cell) {
            return true;
        }
        let Some(free) = self.cells.get_mut(self.count) else { return false };
        *free = cell;
        self.count += 1;
        true
    }

    /// Removes a cell.
    pub(super) fn remove(&mut self, cell: Cell) {
        if let Some(at) = self.list().iter().position(|forced| *forced == cell) {
            self.cells.copy_within(at + 1..self.count, at);
            self.count -= 1;
        }
    }

    /// Replaces the cells' numbers; removes cells that have no new number.
    pub(super) fn renumber(&mut self, number: impl Fn(Cell) -> Option<Cell>) {
        let mut kept = 0;
        for at in 0..self.count {
            if let Some(cell) = number(self.cells[at]) {
                self.cells[kept] = cell;
                kept += 1;
            }
        }
        self.count = kept;
    }

    /// Becomes a copy of `other`, without allocating.
    pub(super) fn copy_from(&mut self, other: &Forces) {
        self.cells[..other.count].copy_from_slice(other.list());
        self.count = other.count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_engine::WordCell;

    #[test]
    fn the_list_of_forces_has_no_duplicates() {
        let mut forces = Forces::default();
        let (bit, word) = (Cell::Bit(BitCell(3)), Cell::Word(WordCell(3)));
        assert!(forces.add(bit) && forces.add(word) && forces.add(bit));
        assert_eq!(forces.list(), [bit, word]);
        forces.remove(bit);
        forces.remove(bit);
        assert_eq!(forces.list(), [word]);
        let all = (0..1000).take_while(|n| forces.add(Cell::Bit(BitCell(*n)))).count();
        assert_eq!(all, FORCES_MAX - 1);
        let mut copy = Forces::default();
        copy.copy_from(&forces);
        assert_eq!(copy.list(), forces.list());
    }
}
