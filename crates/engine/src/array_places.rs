//! The operands of operations on arrays: an element as a target, limits of elements, the forms of
//! COPY and SR.
//!
//! [`ArrayTarget`] is for `math`, the rest is for `arrays`. Behaviour: `docs/semantics.md`, section
//! 9.

use super::image::WordCell;
use super::integer;
use super::layout::WordBitCell;
use super::memory::MemoryView;
use super::mishap::{Mishap, Mishaps};
use super::reach::Reach;
use super::role::{
    BitOwn, BitWritten, BitsWritten, CellRange, FieldRole, TouchedCells, WordRead, WordWritten,
    WordsWritten,
};
use crate::isa::Real;

/// The element of an array in which a formula stores its result.
#[derive(Clone, Copy, Debug)]
pub struct ArrayTarget {
    /// The cell of element 0.
    pub first: u32,
    /// The number of elements.
    pub count: u16,
    /// The type of the elements.
    pub kind: ElementType,
    /// Whether each element has limits of its own.
    pub each: bool,
    /// The word that holds the index of the element.
    pub index: u32,
    /// The word of the lower limit: of element 0 if each element has its own limits, else of all
    /// elements. Unused for bits; for bits of words, the mask of the bit.
    pub limits: u32,
}

/// The type of the elements of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementType {
    /// Bits.
    Bits,
    /// The same bit of each word.
    WordBits,
    /// Words of 0 to 65535.
    Unsigned,
    /// Words of signed integers.
    Integers,
    /// Words of reals.
    Reals,
}

/// The limits of the elements of an array, in private words: the lower, then the upper one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArrayLimits {
    /// The word of the lower limit of element 0.
    pub first: u32,
    /// Whether each element has limits of its own.
    pub each: bool,
}

impl ArrayLimits {
    /// The limits of an element.
    #[inline(always)]
    pub(super) fn limits<R: Reach>(self, view: &MemoryView<R>, element: u32) -> (i32, i32) {
        let at = self.first + if self.each { 2 * element } else { 0 };
        (view.word(WordRead(at)), view.word(WordRead(at + 1)))
    }
}

/// A result that is to be stored.
#[derive(Clone, Copy)]
pub(super) enum StoredResult {
    Integer(i64),
    Real(f64),
}

impl StoredResult {
    /// The integer, truncated towards zero.
    fn whole(self) -> i64 {
        match self {
            StoredResult::Integer(n) => n,
            StoredResult::Real(x) => x as i64,
        }
    }
}

impl ArrayTarget {
    fn array(&self) -> CellRange {
        CellRange { first: self.first, count: self.count.into() }
    }

    /// A bit of an element, if its elements are bits of words.
    pub(super) fn word_bit(&self, element: u32) -> WordBitCell {
        WordBitCell { word: WordCell(self.first + element), mask: self.limits.cast_signed() }
    }

    /// The bits of all elements, if its elements are bits of words.
    pub(super) fn word_bits(&self) -> impl Iterator<Item = WordBitCell> {
        (0..u32::from(self.count)).map(|element| self.word_bit(element))
    }

    /// Stores a result. If the index is outside of the array, stores nothing and notes a mishap.
    pub(super) fn put<R: Reach>(
        &self,
        view: &mut MemoryView<R>,
        value: StoredResult,
        noted: &mut Mishaps,
    ) {
        let index = view.word(WordRead(self.index));
        let Some(cell) = self.array().cell(index) else {
            return noted.note(Mishap::IndexError);
        };
        let content = match (self.kind, value) {
            (ElementType::Bits, StoredResult::Integer(n)) => {
                return view.put_bit(BitWritten(cell), u8::from(n != 0));
            }
            (ElementType::Bits, StoredResult::Real(x)) => {
                return view.put_bit(BitWritten(cell), u8::from(x != 0.0));
            }
            (ElementType::WordBits, value) => {
                let is_on = match value {
                    StoredResult::Integer(n) => n != 0,
                    StoredResult::Real(x) => x != 0.0,
                };
                let content = view.word(WordRead(cell));
                let bit = self.word_bit(index.cast_unsigned());
                view.put_word(WordWritten(cell), bit.put(content, is_on));
                return;
            }
            (ElementType::Unsigned, value) => {
                integer::within(value.whole(), 0, 65535, noted).into()
            }
            (ElementType::Integers, value) => {
                integer::within(value.whole(), i32::MIN, i32::MAX, noted).into()
            }
            (ElementType::Reals, value) => {
                let x = match value {
                    StoredResult::Integer(n) => n as f64,
                    StoredResult::Real(x) => x,
                };
                let nearest = Real::stored(x);
                if nearest.is_beyond {
                    noted.note(Mishap::Overflow);
                }
                i64::from(nearest.real.cell())
            }
        };
        let limits = ArrayLimits { first: self.limits, each: self.each };
        let (low, high) = limits.limits(view, index.cast_unsigned());
        view.put_word(WordWritten(cell), content.clamp(low.into(), high.into()) as i32);
    }
}

impl FieldRole for ArrayTarget {
    fn touches(&self, t: &mut TouchedCells) {
        WordRead(self.index).touches(t);
        match self.kind {
            ElementType::Bits => BitsWritten(self.array()).touches(t),
            ElementType::WordBits
            | ElementType::Unsigned
            | ElementType::Integers
            | ElementType::Reals => {
                WordsWritten(self.array()).touches(t);
            }
        }
    }
}

/// The form of a copy of words: the types of both sides, and the limits of the target's elements.
#[derive(Clone, Copy, Debug)]
pub struct WordForm {
    /// Whether the words that are read hold reals.
    pub from_real: bool,
    /// Whether the words that are written hold reals.
    pub to_real: bool,
    /// The limits of the elements.
    pub limits: ArrayLimits,
}

/// The state and direction of SR.
#[derive(Clone, Copy, Debug)]
pub struct ShiftState {
    /// The edge history of CLK.
    pub history: BitOwn,
    /// Whether the bits run downwards: the last cell is the first bit.
    pub down: bool,
}

impl FieldRole for ShiftState {
    fn touches(&self, t: &mut TouchedCells) {
        self.history.touches(t);
    }
}

/// Adds no cells: the words of the limits are constants.
impl FieldRole for WordForm {
    fn touches(&self, _: &mut TouchedCells) {}
}
