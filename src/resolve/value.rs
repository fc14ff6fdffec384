//! A number in a resolved program: a constant or a word. Used by contacts and instructions.

use super::array::Element;
use crate::isa::{Bit, Real, Word};
use crate::source::atom::Written;

/// A number: a constant or a location.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value {
    /// A constant, and the form in which it was written.
    Const(i32, Written),
    /// A real constant.
    Real(Real),
    /// A word, read again at every execution.
    Word(Word),
    /// The word of an array that another word selects, both read again at every execution.
    Element(Element),
}

/// What FILL writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filling {
    /// To words; to bits the constant 0 or 1.
    Value(Value),
    /// To bits: a bit.
    Bit(Bit),
    /// To bits: the bit that a word selects.
    Element(Element),
}

impl Value {
    /// Whether it is a real: a constant of that form, or an R word.
    pub fn is_real(self) -> bool {
        match self {
            Value::Const(..) => false,
            Value::Real(_) => true,
            Value::Word(word) => word.is_real(),
            Value::Element(element) => element.array.is_real(),
        }
    }

    /// The number of a constant; of a location none.
    pub(crate) fn constant(self) -> Option<f64> {
        match self {
            Value::Const(number, _) => Some(number.into()),
            Value::Real(real) => Some(real.into()),
            Value::Word(_) | Value::Element(_) => None,
        }
    }

    /// Whether both are the same number, in any written form.
    pub(crate) fn is_as(self, other: Value) -> bool {
        match (self, other) {
            (Value::Const(a, _), Value::Const(b, _)) => a == b,
            (Value::Real(a), Value::Real(b)) => a == b,
            (Value::Word(a), Value::Word(b)) => a == b,
            (Value::Element(a), Value::Element(b)) => a == b,
            (Value::Const(..), Value::Real(_) | Value::Word(_) | Value::Element(_))
            | (Value::Real(_), Value::Const(..) | Value::Word(_) | Value::Element(_))
            | (Value::Word(_), Value::Const(..) | Value::Real(_) | Value::Element(_))
            | (Value::Element(_), Value::Const(..) | Value::Real(_) | Value::Word(_)) => false,
        }
    }
}
