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
    /// Whether writes check for forced cells, to discard such writes.
    const FORCED: bool;
    /// The bits of the image, one byte each, including the records.
    type Bits: Cells<u8> + Records + ?Sized;
    /// The words of the image.
    type Words: Cells<i32> + ?Sized;

    /// The bits as this reach addresses them.
    fn bits(bits: &mut [u8]) -> &mut Self::Bits;
    /// The words as this reach addresses them.
    fn words(words: &mut [i32]) -> &mut Self::Words;
}

/// Access to cells by number.
pub(super) trait Cells<T> {
    fn cell(&self, number: u32) -> &T;
    fn cell_mut(&mut self, number: u32) -> &mut T;
}

/// Access to structures' records by number.
pub(super) trait Records {
    fn record(&mut self, number: u32) -> &mut [u8; RECORD];
}

/// For programs of at most [`NEAR`] bits and words, while nothing is forced.
pub(super) struct Near;

/// For programs of any size, while nothing is forced.
pub(super) struct Far;

/// For programs of any size, while something is forced.
pub(super) struct Forced;

impl Reach for Near {
    const FORCED: bool = false;
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
    ($reach:ident, forced: $forced:literal) => {
        impl Reach for $reach {
            const FORCED: bool = $forced;
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

any_length!(Far, forced: false);
any_length!(Forced, forced: true);

impl<T> Cells<T> for [T; NEAR] {
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

impl<T> Cells<T> for [T] {
    #[inline(always)]
    fn cell(&self, number: u32) -> &T {
        &self[number as usize]
    }

    #[inline(always)]
    fn cell_mut(&mut self, number: u32) -> &mut T {
        &mut self[number as usize]
    }
}

impl Records for [u8; NEAR] {
    #[inline(always)]
    fn record(&mut self, number: u32) -> &mut [u8; RECORD] {
        &mut self.as_chunks_mut().0[number as usize % (NEAR / RECORD)]
    }
}

impl Records for [u8] {
    #[inline(always)]
    fn record(&mut self, number: u32) -> &mut [u8; RECORD] {
        &mut self.as_chunks_mut().0[number as usize]
    }
}
