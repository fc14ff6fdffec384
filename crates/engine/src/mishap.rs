//! Mishaps of a calculation: a division by zero, a result at a limit, an argument outside of a
//! domain, an index outside of its array.
//!
//! Behaviour: `docs/semantics.md`, section 8. The arithmetic of `integer` and `real` notes them,
//! `math` turns the status bits ON and reports them for the log.

use crate::isa::status::{self, st};
pub use rungd_base::variants::all_variants;

/// The kind of a mishap; each has a status bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mishap {
    /// A division by 0, or 0 to a negative power.
    DivideByZero,
    /// A result beyond the numbers of an expression or of its target.
    Overflow,
    /// An argument outside of the domain of its function.
    OutOfRange,
    /// An index outside of its array.
    IndexError,
}

impl Mishap {
    /// All kinds, in the order of their status bits.
    pub const ALL: [Mishap; 4] = all_variants![
        Mishap::DivideByZero,
        Mishap::Overflow,
        Mishap::OutOfRange,
        Mishap::IndexError
    ];

    /// The nickname of its status bit.
    pub fn nickname(self) -> &'static str {
        status::BIT_NICKNAMES[self.status() as usize]
    }

    /// The number of its status bit.
    pub fn status(self) -> u32 {
        match self {
            Mishap::DivideByZero => st::DIVIDE_BY_ZERO,
            Mishap::Overflow => st::OVERFLOW,
            Mishap::OutOfRange => st::OUT_OF_RANGE,
            Mishap::IndexError => st::INDEX_ERROR,
        }
    }
}

/// A set of mishaps: those of one calculation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mishaps(u8);

impl Mishaps {
    /// Adds a mishap.
    #[inline(always)]
    pub(super) fn note(&mut self, mishap: Mishap) {
        self.0 |= 1 << mishap as u8;
    }

    /// The index error of the set, if it contains one; no other mishap.
    pub(super) fn of_index(self) -> Mishaps {
        Mishaps(self.0 & 1 << Mishap::IndexError as u8)
    }

    /// Adds the mishaps of a second set.
    #[inline(always)]
    pub(super) fn add(&mut self, other: Mishaps) {
        self.0 |= other.0;
    }

    /// Whether the set is empty.
    #[inline(always)]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether the set contains a mishap.
    pub fn has(self, mishap: Mishap) -> bool {
        self.has_number(mishap as u32)
    }

    /// Whether the set contains the mishap with this number; 0 is the mishap of the first status
    /// bit.
    #[inline(always)]
    pub(super) fn has_number(self, number: u32) -> bool {
        u32::from(self.0) >> number & 1 == 1
    }

    /// All mishaps of the set, in the order of their status bits.
    pub fn each(self) -> impl Iterator<Item = Mishap> {
        Mishap::ALL.into_iter().filter(move |mishap| self.has(*mishap))
    }
}
