//! The cells of earlier programs: where their elements are in the present program.
//!
//! Used by `link` on the scan thread, for batches and commands that were made for a program before
//! a reload. Nothing is allocated or freed.

use super::exchange::OperandWrite;
use rungd_engine::{Cell, Renumbered};

/// The number of swaps between two scans over which a cell is followed.
pub(super) const SWAPS_FOLLOWED: usize = 8;

/// The last programs before the present one, the oldest first: their generations, and the cells
/// that have a different number in the program after it. `None`: there was none yet.
#[derive(Default)]
pub(super) struct EarlierPrograms([(Option<u32>, Renumbered); SWAPS_FOLLOWED]);

impl EarlierPrograms {
    /// Adds the program of this generation. The cells of the oldest one are returned in the same
    /// variable.
    pub fn enter(&mut self, generation: u32, renumbered: &mut Renumbered) {
        self.0.rotate_left(1);
        let (last, cells) = &mut self.0[SWAPS_FOLLOWED - 1];
        *last = Some(generation);
        std::mem::swap(cells, renumbered);
    }

    /// The cell of the present program for a cell of an earlier one.
    pub fn cell(&self, generation: u32, cell: Cell) -> Option<Cell> {
        let at = self
            .0
            .iter()
            .position(|(earlier_generation, _)| *earlier_generation == Some(generation))?;
        self.0[at..].iter().try_fold(cell, |cell, (_, cells)| cells.cell(cell))
    }

    /// Changes the cell of a write of an earlier program to its element's present cell; false if
    /// there is none.
    pub fn is_renumbered(&self, generation: u32, write: &mut OperandWrite) -> bool {
        let cell = match write {
            OperandWrite::Bit(cell, _) => Cell::Bit(*cell),
            OperandWrite::Word(cell, _) | OperandWrite::Masked { cell, .. } => Cell::Word(*cell),
            OperandWrite::WordBit(bit, _) => Cell::Word(bit.word),
            OperandWrite::Input(..) => return true,
        };
        match (write, self.cell(generation, cell)) {
            (OperandWrite::Bit(cell, _), Some(Cell::Bit(to))) => *cell = to,
            (
                OperandWrite::Word(cell, _) | OperandWrite::Masked { cell, .. },
                Some(Cell::Word(to)),
            ) => *cell = to,
            (OperandWrite::WordBit(bit, _), Some(Cell::Word(to))) => bit.word = to,
            (
                OperandWrite::Bit(..)
                | OperandWrite::Word(..)
                | OperandWrite::WordBit(..)
                | OperandWrite::Masked { .. }
                | OperandWrite::Input(..),
                _,
            ) => {
                return false;
            }
        }
        true
    }
}
