//! The resolved expression of MATH: addresses instead of names, and the type of every operator.
//!
//! Made by `formula_resolver`, turned into the engine's steps by `lower`. Behaviour:
//! `docs/semantics.md`, section 8.

use super::array::Array;
pub use crate::source::expression::{Binary, Unary};
pub use rungd_engine::isa::{Bit, Function, Real, Word};

/// An expression in postfix order: an operator comes after its operands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Formula {
    /// Its parts; the last part is the outermost one.
    pub parts: Vec<FormulaPart>,
}

/// A part of an expression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FormulaPart {
    /// An integer constant.
    Integer(i64),
    /// A real constant.
    Real(Real),
    /// A word, read at every evaluation.
    Word(Word),
    /// A bit: 0 or 1.
    Bit(Bit),
    /// An element of an array; its index comes before it.
    Element(Array),
    /// An operator with one operand, and the type that it computes in.
    Unary(Unary, NumberType),
    /// An operator with two operands, and the type that it computes in.
    Binary(Binary, NumberType),
    /// A function with this number of arguments, and the type that it computes in.
    Call(Function, u32, NumberType),
}

/// The type of a number in an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberType {
    /// 64 bits with sign.
    Integer,
    /// Binary64.
    Real,
}

impl NumberType {
    /// The type of an operator with operands of these two types: real if one of them is real.
    pub fn with(self, other: NumberType) -> NumberType {
        if self == NumberType::Real { self } else { other }
    }
}

/// The type of an array's numbers.
pub fn type_of_array(array: Array) -> NumberType {
    if array.is_real() { NumberType::Real } else { NumberType::Integer }
}

/// The type of a word's numbers.
pub fn type_of(word: Word) -> NumberType {
    if word.is_real() { NumberType::Real } else { NumberType::Integer }
}
