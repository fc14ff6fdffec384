//! A formula: an expression of rungd, with what it computes.
//!
//! Made by `expression` and `locate`, combined by `operators`. Logix computes whole numbers in 32
//! bits that wrap; MATH of rungd in 64 bits, and stores what fits. So [`LogixFormula::bits`] says
//! how wide a result can be, and what is wider than 32 bits is wrapped (`& -1`) where the
//! difference would show: [`LogixFormula::wrapped`].

use crate::condition::TouchedPlace;

/// The type of an expression's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ValueType {
    Whole,
    Real,
    Bool,
}

/// An expression of rungd.
#[derive(Clone, Debug)]
pub(crate) struct LogixFormula {
    pub(crate) text: String,
    pub(crate) value: ValueType,
    /// How many bits a whole number can need.
    pub(crate) bits: u32,
    pub(crate) reads: Vec<TouchedPlace>,
    /// Whether it stands beside an operator without parentheses.
    pub(crate) is_atom: bool,
    /// Whether it is a constant, or a tag.
    pub(crate) is_plain: bool,
    /// How many operations on reals it has.
    pub(crate) real_operations: usize,
    /// What it does other than Logix.
    pub(crate) differences: Vec<&'static str>,
}

pub(crate) const DIVISION: &str =
    "a division by 0 gives 0 (Logix: a minor fault, and a value that its manual leaves open)";
pub(crate) const WIDE_WHOLE: &str =
    "a DINT of more than 24 bits beside a REAL is not rounded to a REAL first";
pub(crate) const INTERMEDIATE: &str =
    "an expression of several operations on REALs is rounded to a REAL once, at its end";
pub(crate) const DIVISION_IN_REALS: &str = "a division of whole numbers in a CPT into a REAL is \
    computed in REALs, as Rockwell describes it; there are controllers that cut its result";
pub(crate) const LAST_BIT: &str = "the last bit of a function's REAL may differ";

impl LogixFormula {
    /// A text that stands beside an operator without parentheses.
    pub(crate) fn plain(text: String) -> LogixFormula {
        LogixFormula {
            text,
            value: ValueType::Whole,
            bits: 32,
            reads: Vec::new(),
            is_atom: true,
            is_plain: true,
            real_operations: 0,
            differences: Vec::new(),
        }
    }

    pub(crate) fn whole(value: i64) -> LogixFormula {
        // Logix' constants have 32 bits.
        let value = value as i32;
        LogixFormula { is_atom: value >= 0, ..LogixFormula::plain(value.to_string()) }
    }

    /// It beside an operator.
    pub(crate) fn operand(&self) -> String {
        if self.is_atom { self.text.clone() } else { format!("({})", self.text) }
    }

    /// It with a result of 32 bits.
    pub(crate) fn wrapped(self) -> LogixFormula {
        if self.bits <= 32 || self.value != ValueType::Whole {
            return self;
        }
        LogixFormula { text: format!("{} & -1", self.operand()), bits: 32, is_atom: false, ..self }
    }

    /// It as a real.
    pub(super) fn into_real(mut self) -> LogixFormula {
        self = self.wrapped();
        if self.value == ValueType::Whole && self.bits == 32 && !self.is_constant() {
            self.differences.push(WIDE_WHOLE);
        }
        self
    }

    pub(super) fn is_constant(&self) -> bool {
        self.is_plain && self.reads.is_empty()
    }

    /// The function of one argument.
    pub(super) fn call(self, function: &str) -> LogixFormula {
        LogixFormula {
            text: format!("{function}({})", self.text),
            is_atom: true,
            is_plain: false,
            ..self
        }
    }
}
