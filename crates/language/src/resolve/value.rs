//! A number in a resolved program: a constant or a word. Used by contacts and instructions.

use super::array::ArrayElement;
use crate::source::atom::ConstantForm;
use rungd_engine::isa::{Bit, Real, Word};

/// A number: a constant or a location.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value {
    /// A constant, and the form in which it was written.
    Const(i32, ConstantForm),
    /// A real constant.
    Real(Real),
    /// A word, read again at every execution.
    Word(Word),
    /// A word of an array, selected by a second word; both are read again at every execution.
    Element(ArrayElement),
}

/// The value that FILL writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filling {
    /// For words, any value; for bits, the constant 0 or 1.
    Value(Value),
    /// For bits: a bit.
    Bit(Bit),
    /// For bits: a bit of an array, selected by a word.
    Element(ArrayElement),
}

impl Filling {
    /// The element that a word selects, if it is one.
    pub(crate) fn element(self) -> Option<ArrayElement> {
        match self {
            Filling::Element(element) | Filling::Value(Value::Element(element)) => Some(element),
            Filling::Bit(_)
            | Filling::Value(Value::Const(..) | Value::Real(_) | Value::Word(_)) => None,
        }
    }
}

impl Value {
    /// Whether it is a real: a real constant, or an R word.
    pub fn is_real(self) -> bool {
        match self {
            Value::Const(..) => false,
            Value::Real(_) => true,
            Value::Word(word) => word.is_real(),
            Value::Element(element) => element.array.is_real(),
        }
    }

    /// The number of a constant; `None` for a location.
    pub fn constant(self) -> Option<f64> {
        match self {
            Value::Const(number, _) => Some(number.into()),
            Value::Real(real) => Some(real.into()),
            Value::Word(_) | Value::Element(_) => None,
        }
    }

    /// Whether both are the same constant, in any written form, or the same location.
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
