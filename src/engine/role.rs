//! The role of a cell in an operation: read, written, or the program's own.
//!
//! The type of each field of an operation gives the cell's role. From these types follow the list
//! of cells for the scheduler ([`Touches`]), and the access that the operation's `run` has to each
//! cell. A field whose type has no role does not compile.

use std::ops::Range;

use super::power::Powers;
use crate::isa::status::st;

/// The cells that an operation reads and writes. The scheduler keeps the order of operations that
/// share a written cell.
#[derive(Clone, Debug, Default)]
pub struct Touches<'s> {
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
    /// Arrays of bits of which one element is read, or all are.
    pub bit_arrays_read: Vec<Cells>,
    /// Arrays of bits of which one element is written, or all are.
    pub bit_arrays_written: Vec<Cells>,
    /// Arrays of words of which one element is read, or all are.
    pub word_arrays_read: Vec<Cells>,
    /// Arrays of words of which one element is written, or all are.
    pub word_arrays_written: Vec<Cells>,
}

/// Neighbouring cells of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cells {
    /// The cell of element 0.
    pub first: u32,
    /// The number of elements.
    pub count: u32,
}

impl Cells {
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

/// What the formulas of a program read, and the status bits that they turn ON.
#[derive(Clone, Copy, Debug, Default)]
pub struct Formulas<'s> {
    /// The cells that they read, by the MATH's number.
    pub reads: &'s [Reads],
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
pub struct Reads {
    /// Bits.
    pub bits: Vec<u32>,
    /// Words.
    pub words: Vec<u32>,
    /// Arrays of bits.
    pub bit_arrays: Vec<Cells>,
    /// Arrays of words.
    pub word_arrays: Vec<Cells>,
}

impl Touches<'_> {
    /// Clears all lists.
    pub fn clear(&mut self) {
        self.bits_read.clear();
        self.bits_written.clear();
        self.words_read.clear();
        self.words_written.clear();
        self.bit_arrays_read.clear();
        self.bit_arrays_written.clear();
        self.word_arrays_read.clear();
        self.word_arrays_written.clear();
    }
}

/// The role of an operation's field: the cells that it reads and writes.
pub(super) trait Role {
    /// Adds its cells.
    fn touches(&self, t: &mut Touches);
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

        impl Role for $role {
            fn touches(&self, t: &mut Touches) {
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
    /// A bit that is written; a force holds it.
    BitWritten BitRole bits_written;
    /// One of the program's own bits that is written: a power or an edge history; never forced.
    BitOwn BitRole bits_written;
    /// A word that is read.
    WordRead WordRole words_read;
    /// A word that is written; a force holds it.
    WordWritten WordRole words_written;
}

macro_rules! array_roles {
    ($($(#[$doc:meta])* $role:ident $list:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $role(pub Cells);

        impl Role for $role {
            fn touches(&self, t: &mut Touches) {
                t.$list.push(self.0);
            }
        }
    )*};
}

array_roles! {
    /// Bits of which one is read, or all are.
    BitsRead bit_arrays_read;
    /// Bits of which one is written, or all are; a force holds each.
    BitsWritten bit_arrays_written;
    /// Words of which one is read, or all are.
    WordsRead word_arrays_read;
    /// Words of which one is written, or all are; a force holds each.
    WordsWritten word_arrays_written;
}

impl<const N: usize> Role for Powers<N> {
    fn touches(&self, t: &mut Touches) {
        t.bits_read.extend(self.cells);
    }
}

impl<R: Role> Role for Option<R> {
    fn touches(&self, t: &mut Touches) {
        if let Some(role) = self {
            role.touches(t);
        }
    }
}
