//! The memory that operations work on: the image, which also holds the state of instructions.
//!
//! A batch borrows the whole memory as one [`MemoryView`] of slices, so that its loop keeps the
//! pointers in registers. Each loop is compiled for each [`Reach`]: near, far, and with forces.
//! While nothing is forced, a write is a plain store.
//!
//! The methods of a view take cells by role: an operation cannot write a cell that its row in `ops`
//! does not declare as written.

use super::image::Image;
use super::power::{LegPowers, Powers};
use super::reach::{CellAccess, ForceLookup, Reach, RecordAccess};
use super::record::{FLAGS, OwnerState, RECORD};
use super::role::{BitOwn, BitRole, BitWritten, WordRole, WordWritten};

/// The image with the state of instructions, and the elapsed time.
#[derive(Debug)]
pub(super) struct Memory {
    pub image: Image,
    /// Whole ms since the previous execution of the element that now executes. All timers of an
    /// element share it: an execution that was cut short is followed by a pass before the next
    /// execution, and RETURN keeps the time for the timers behind it.
    pub elapsed_ms: i32,
}

/// Selects a value by a bit (0 or 1), without a branch. The choice differs between neighbouring
/// operations and from scan to scan, and a mispredicted branch costs more than a whole operation.
#[inline(always)]
pub(super) fn select(bit: u8, on: i32, off: i32) -> i32 {
    std::hint::select_unpredictable(bit != 0, on, off)
}

/// [`Memory`] for one batch.
pub(super) struct MemoryView<'a, R: Reach> {
    bits: &'a mut R::Bits,
    words: &'a mut R::Words,
    forces: R::Forces<'a>,
    pub elapsed_ms: i32,
}

impl Memory {
    #[inline(always)]
    pub fn view<R: Reach>(&mut self) -> MemoryView<'_, R> {
        MemoryView {
            bits: R::bits(&mut self.image.bits),
            words: R::words(&mut self.image.words),
            forces: R::Forces::of(&self.image.forced_bits, &self.image.forced_words),
            elapsed_ms: self.elapsed_ms,
        }
    }
}

impl<R: Reach> MemoryView<'_, R> {
    /// Reads a leg.
    #[inline(always)]
    pub fn leg(&self, leg: &LegPowers) -> u8 {
        self.all(leg)
    }

    /// Whether all powers are ON.
    #[inline(always)]
    pub fn all<const N: usize>(&self, powers: &Powers<N>) -> u8 {
        let power = |at: usize| *self.bits.cell(powers.cells[at]) ^ powers.opposites[at];
        (1..N).fold(power(0), |all, at| all & power(at))
    }

    #[inline(always)]
    pub fn bits(&self) -> &R::Bits {
        self.bits
    }

    #[inline(always)]
    pub fn words(&self) -> &R::Words {
        self.words
    }

    #[inline(always)]
    pub fn bit(&self, cell: impl BitRole) -> u8 {
        *self.bits.cell(cell.number())
    }

    #[inline(always)]
    pub fn word(&self, cell: impl WordRole) -> i32 {
        *self.words.cell(cell.number())
    }

    /// Writes a bit, unless it is forced.
    #[inline(always)]
    pub fn put_bit(&mut self, BitWritten(cell): BitWritten, value: u8) {
        if !self.forces.has_bit(cell) {
            *self.bits.cell_mut(cell) = value;
        }
    }

    /// Writes one of the program's own bits, which are never forced.
    #[inline(always)]
    pub fn put_own(&mut self, BitOwn(cell): BitOwn, value: u8) {
        *self.bits.cell_mut(cell) = value;
    }

    /// Writes a word, unless it is forced; returns its value afterwards.
    #[inline(always)]
    pub fn put_word(&mut self, WordWritten(cell): WordWritten, value: i32) -> i32 {
        let word = self.words.cell_mut(cell);
        if !self.forces.has_word(cell) {
            *word = value;
        }
        *word
    }

    /// A structure's record.
    #[inline(always)]
    pub fn record(&mut self, at: u32) -> &mut [u8; RECORD] {
        self.bits.record(at)
    }

    /// Reads the private state of a counter or timer.
    #[inline(always)]
    pub fn state(&mut self, record: u32) -> OwnerState {
        let [_, _, _, _, state @ ..] = *self.record(record);
        OwnerState(u32::from_le_bytes(state))
    }

    /// Writes the private state of a counter or timer.
    #[inline(always)]
    pub fn put_state(&mut self, record: u32, state: OwnerState) {
        self.record(record)[FLAGS..].copy_from_slice(&state.0.to_le_bytes());
    }

    /// Writes the four flags of a counter or timer, in the order of the layout.
    #[inline(always)]
    pub fn put_flags(&mut self, record: u32, flags: [u8; 4]) {
        if R::Forces::ANY {
            let first = record * RECORD as u32;
            for (cell, flag) in (first..).zip(flags) {
                self.put_bit(BitWritten(cell), flag);
            }
            return;
        }
        // One store for each flag: packing them into one store takes twice the instructions.
        let [done, reset, zero, fourth, ..] = self.record(record);
        (*done, *reset, *zero, *fourth) = flags.into();
    }
}
