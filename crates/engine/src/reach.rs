//! How operations address memory: near, far, or with forces. Each loop is compiled for all three.
//!
//! If all cells of a program have 16-bit numbers and the memory has at least 2^16 cells, no number
//! can be out of range: the compiler then leaves out the bounds checks. In larger programs, and
//! while anything is forced, numbers are checked. Nothing else differs.

use super::record::RECORD;

/// Number of bits, and of words, within near reach; a near image has at least this many.
pub(super) const NEAR: usize = 1 << 16;

/// How operations address memory.
pub(super) trait Reach {
    /// What writes ask whether a cell is forced, to discard such writes.
    type Forces<'a>: ForceLookup<'a>;
    /// The bits of the image, one byte each, including the records.
    type Bits: CellAccess<u8> + RecordAccess + ?Sized;
    /// The words of the image.
    type Words: CellAccess<i32> + ?Sized;

    /// The bits as this reach addresses them.
    fn bits(bits: &mut [u8]) -> &mut Self::Bits;
    /// The words as this reach addresses them.
    fn words(words: &mut [i32]) -> &mut Self::Words;
}

/// Which cells are forced.
pub(super) trait ForceLookup<'a> {
    /// Whether any cell can be forced.
    const ANY: bool;

    /// The forces, given for each bit and for each word whether it is forced.
    fn of(bits: &'a [bool], words: &'a [bool]) -> Self;
    fn has_bit(&self, cell: u32) -> bool;
    fn has_word(&self, cell: u32) -> bool;
}

/// No forces: nothing is stored for a batch, and nothing is checked.
pub(super) struct NoForces;

/// The forces of an image: for each cell whether it is forced.
pub(super) struct ForcedCells<'a> {
    bits: &'a [bool],
    words: &'a [bool],
}

impl<'a> ForceLookup<'a> for NoForces {
    const ANY: bool = false;

    #[inline(always)]
    fn of(_: &'a [bool], _: &'a [bool]) -> NoForces {
        NoForces
    }

    #[inline(always)]
    fn has_bit(&self, _: u32) -> bool {
        false
    }

    #[inline(always)]
    fn has_word(&self, _: u32) -> bool {
        false
    }
}

impl<'a> ForceLookup<'a> for ForcedCells<'a> {
    const ANY: bool = true;

    #[inline(always)]
    fn of(bits: &'a [bool], words: &'a [bool]) -> ForcedCells<'a> {
        ForcedCells { bits, words }
    }

    #[inline(always)]
    fn has_bit(&self, cell: u32) -> bool {
        self.bits[cell as usize]
    }

    #[inline(always)]
    fn has_word(&self, cell: u32) -> bool {
        self.words[cell as usize]
    }
}

/// Access to cells by number.
pub(super) trait CellAccess<T> {
    fn cell(&self, number: u32) -> &T;
    fn cell_mut(&mut self, number: u32) -> &mut T;
}

/// Access to structures' records by number.
pub(super) trait RecordAccess {
    fn record(&mut self, number: u32) -> &mut [u8; RECORD];
}

/// For programs of at most [`NEAR`] bits and words, while nothing is forced.
pub(super) struct NearReach;

/// For programs of any size, while nothing is forced.
pub(super) struct FarReach;

/// For programs of any size, while something is forced.
pub(super) struct ForcedReach;

impl Reach for NearReach {
    type Forces<'a> = NoForces;
    type Bits = [u8; NEAR];
    type Words = [i32; NEAR];

    fn bits(bits: &mut [u8]) -> &mut [u8; NEAR] {
        bits.first_chunk_mut().expect("a near image has that many bits")
    }

    fn words(words: &mut [i32]) -> &mut [i32; NEAR] {
        words.first_chunk_mut().expect("a near image has that many words")
    }
}

macro_rules! any_length {
    ($reach:ident, forces: $Forces:ty) => {
        impl Reach for $reach {
            type Forces<'a> = $Forces;
            type Bits = [u8];
            type Words = [i32];

            fn bits(bits: &mut [u8]) -> &mut [u8] {
                bits
            }

            fn words(words: &mut [i32]) -> &mut [i32] {
                words
            }
        }
    };
}

any_length!(FarReach, forces: NoForces);
any_length!(ForcedReach, forces: ForcedCells<'a>);

impl<T> CellAccess<T> for [T; NEAR] {
    #[inline(always)]
    fn cell(&self, number: u32) -> &T {
        debug_assert!((number as usize) < NEAR);
        &self[usize::from(number as u16)]
    }

    #[inline(always)]
    fn cell_mut(&mut self, number: u32) -> &mut T {
        debug_assert!((number as usize) < NEAR);
        &mut self[usize::from(number as u16)]
    }
}

impl<T> CellAccess<T> for [T] {
    #[inline(always)]
    fn cell(&self, number: u32) -> &T {
        &self[number as usize]
    }

    #[inline(always)]
    fn cell_mut(&mut self, number: u32) -> &mut T {
        &mut self[number as usize]
    }
}

impl RecordAccess for [u8; NEAR] {
    #[inline(always)]
    fn record(&mut self, number: u32) -> &mut [u8; RECORD] {
        &mut self.as_chunks_mut().0[number as usize % (NEAR / RECORD)]
    }
}

impl RecordAccess for [u8] {
    #[inline(always)]
    fn record(&mut self, number: u32) -> &mut [u8; RECORD] {
        &mut self.as_chunks_mut().0[number as usize]
    }
}
