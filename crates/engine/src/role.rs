//! The role of a cell in an operation: read, written, or the program's own.
//!
//! The type of each field of an operation gives the cell's role. These types determine the list of
//! cells for the scheduler ([`TouchedCells`]), and the access of the operation's `run` to each
//! cell. A field whose type has no role does not compile.

use std::ops::Range;

use super::layout::WordBitCell;
use super::power::{Power, Powers};
use crate::isa::status::st;

/// The cells that an operation reads and writes. The scheduler keeps the order of operations that
/// share a written cell.
#[derive(Clone, Debug, Default)]
pub struct TouchedCells<'s> {
    /// The formulas of MATHs.
    pub formulas: Formulas<'s>,
    /// Bits read.
    pub bits_read: Vec<u32>,
    /// Bits written, always or sometimes; they may be read too.
    pub bits_written: Vec<u32>,
    /// Words read.
    pub words_read: Vec<u32>,
    /// Words written, always or sometimes; they may be read too.
    pub words_written: Vec<u32>,
    /// Those of `words_written` of which only this bit is changed.
    pub word_bits_written: Vec<WordBitCell>,
    /// Arrays of bits that are read: one element, or all.
    pub bit_arrays_read: Vec<CellRange>,
    /// Arrays of bits that are written: one element, or all.
    pub bit_arrays_written: Vec<CellRange>,
    /// Arrays of words that are read: one element, or all.
    pub word_arrays_read: Vec<CellRange>,
    /// Arrays of words that are written: one element, or all.
    pub word_arrays_written: Vec<CellRange>,
    /// Bits of `bits_read` of which only matters whether all powers are ON.
    pub anded: Vec<AndedPowers>,
}

/// Powers that are ANDed: at most four.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AndedPowers {
    powers: [Power; 4],
    count: u8,
}

impl AndedPowers {
    /// A single power.
    pub fn of(power: Power) -> AndedPowers {
        AndedPowers { powers: [power; 4], count: 1 }
    }

    /// All powers.
    pub fn each(&self) -> &[Power] {
        &self.powers[..usize::from(self.count)]
    }
}

/// Neighbouring cells of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellRange {
    /// The cell of element 0.
    pub first: u32,
    /// The number of elements.
    pub count: u32,
}

impl CellRange {
    /// All cells.
    pub(super) fn each(&self) -> std::ops::Range<u32> {
        self.first..self.first + self.count
    }

    /// The cell of an element; `None` outside of the array.
    #[inline(always)]
    pub(super) fn cell(&self, index: i32) -> Option<u32> {
        let index = index.cast_unsigned();
        (index < self.count).then(|| self.first + index)
    }
}

/// The cells that the formulas of a program read, and the status bits that they turn ON.
#[derive(Clone, Copy, Debug, Default)]
pub struct Formulas<'s> {
    /// The cells that each formula reads, by the number of its MATH.
    pub reads: &'s [FormulaReads],
    /// The cell of the first status bit, ST0.
    pub status: u32,
}

impl Formulas<'_> {
    /// The cells of the status bits of mishaps.
    pub fn mishaps(self) -> Range<u32> {
        self.status + st::DIVIDE_BY_ZERO..self.status + st::INDEX_ERROR + 1
    }
}

/// The cells that a formula reads.
#[derive(Clone, Debug, Default)]
pub struct FormulaReads {
    /// Bits.
    pub bits: Vec<u32>,
    /// Words.
    pub words: Vec<u32>,
    /// Arrays of bits.
    pub bit_arrays: Vec<CellRange>,
    /// Arrays of words.
    pub word_arrays: Vec<CellRange>,
}

impl TouchedCells<'_> {
    /// Clears all lists.
    pub fn clear(&mut self) {
        self.bits_read.clear();
        self.bits_written.clear();
        self.words_read.clear();
        self.words_written.clear();
        self.word_bits_written.clear();
        self.bit_arrays_read.clear();
        self.bit_arrays_written.clear();
        self.word_arrays_read.clear();
        self.word_arrays_written.clear();
        self.anded.clear();
    }
}

/// The role of an operation's field: the cells that it reads and writes.
pub(super) trait FieldRole {
    /// Adds its cells.
    fn touches(&self, t: &mut TouchedCells);
}

/// A bit that an operation may read.
pub(super) trait BitRole: Copy {
    /// Its cell.
    fn number(self) -> u32;
}

/// A word that an operation may read.
pub(super) trait WordRole: Copy {
    /// Its cell.
    fn number(self) -> u32;
}

macro_rules! roles {
    ($($(#[$doc:meta])* $role:ident $readable:ident $list:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $role(pub u32);

        impl FieldRole for $role {
            fn touches(&self, t: &mut TouchedCells) {
                t.$list.push(self.0);
            }
        }

        impl $readable for $role {
            #[inline(always)]
            fn number(self) -> u32 {
                self.0
            }
        }
    )*};
}

roles! {
    /// A bit that is read.
    BitRead BitRole bits_read;
    /// A bit that is written, unless it is forced.
    BitWritten BitRole bits_written;
    /// One of the program's own bits that is written: a power or an edge history; never forced.
    BitOwn BitRole bits_written;
    /// A word that is read.
    WordRead WordRole words_read;
    /// A word that is written, unless it is forced.
    WordWritten WordRole words_written;
}

/// A bit in the content of a word, as its mask: [`WordBitCell::mask`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitMask(pub i32);

/// A bit of a word that is written, unless the word is forced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WordBitWritten(pub WordBitCell);

macro_rules! array_roles {
    ($($(#[$doc:meta])* $role:ident $list:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $role(pub CellRange);

        impl FieldRole for $role {
            fn touches(&self, t: &mut TouchedCells) {
                t.$list.push(self.0);
            }
        }
    )*};
}

array_roles! {
    /// Bits that are read: one, or all.
    BitsRead bit_arrays_read;
    /// Bits that are written: one, or all; forced bits keep their values.
    BitsWritten bit_arrays_written;
    /// Words that are read: one, or all.
    WordsRead word_arrays_read;
    /// Words that are written: one, or all; forced words keep their values.
    WordsWritten word_arrays_written;
}

impl<const N: usize> FieldRole for Powers<N> {
    fn touches(&self, t: &mut TouchedCells) {
        t.bits_read.extend(self.cells);
        let mut anded = AndedPowers { powers: [Power(0); 4], count: N as u8 };
        anded.powers[..N].copy_from_slice(&self.each());
        t.anded.push(anded);
    }
}

impl<R: FieldRole> FieldRole for Option<R> {
    fn touches(&self, t: &mut TouchedCells) {
        if let Some(role) = self {
            role.touches(t);
        }
    }
}
