//! How operations address memory: near, far, or with forces. Each loop is compiled for all three.
//!
//! Where all cells of a program have 16-bit numbers, and memory has at least 2^16 cells, no number
//! can be out of range: the compiler sees it, and leaves out the bounds checks. Nothing else
//! differs; the numbers of longer programs are checked, and so are all while anything is forced.

use super::record::RECORD;

/// So many cells, bits and words, are within near reach; a near image has at least so many.
pub(super) const NEAR: usize = 1 << 16;

/// How operations address memory.
pub(super) trait Reach {
    /// Whether writes to forced cells are to be discarded.
    const FORCED: bool;
    /// The bits of the image, one byte each, with the records among them.
    type Bits: Cells<u8> + Records + ?Sized;
    /// The words of the image.
    type Words: Cells<i32> + ?Sized;

    /// The bits to address.
    fn bits(bits: &mut [u8]) -> &mut Self::Bits;
    /// The words to address.
    fn words(words: &mut [i32]) -> &mut Self::Words;
}

/// Cells by their number.
pub(super) trait Cells<T> {
    fn cell(&self, number: u32) -> &T;
    fn cell_mut(&mut self, number: u32) -> &mut T;
}

/// Structures' records by their number.
pub(super) trait Records {
    fn record(&mut self, number: u32) -> &mut [u8; RECORD];
}

/// Programs of at most [`NEAR`] bits and words, nothing forced.
pub(super) struct Near;

/// Programs of any length, nothing forced.
pub(super) struct Far;

/// Programs of any length, something forced.
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
