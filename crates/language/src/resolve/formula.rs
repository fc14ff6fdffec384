//! The resolved expression of MATH: addresses instead of names, and the type of every operator.
//!
//! Made by `formula_resolver`, turned into the engine's steps by `lower`. Behaviour:
//! `docs/semantics.md`, section 8.

use std::fmt;

use super::array::Array;
use crate::source::atom::ConstantForm;
pub use crate::source::expression::{Binary, Unary};
pub use rungd_engine::isa::{Bit, Function, Real, Word};
use rungd_engine::isa::{Space, Structure};

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
    Integer(FormulaInteger),
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

impl Formula {
    /// Whether its value is a time, in ms: made of durations and the times of timers, by operators
    /// that leave it one.
    pub fn is_time(&self) -> bool {
        let mut times: Vec<bool> = Vec::new();
        for part in &self.parts {
            let operands = times.split_off(times.len().saturating_sub(part.operand_count()));
            times.push(part.is_time(&operands));
        }
        times == [true]
    }
}

impl FormulaPart {
    /// For each part of an expression, the place of the first part of its operands; its own if it
    /// takes none.
    pub fn starts(parts: &[FormulaPart]) -> Vec<usize> {
        let mut starts = Vec::with_capacity(parts.len());
        // The starts of the parts whose results are not used yet.
        let mut waiting: Vec<usize> = Vec::new();
        for (at, part) in parts.iter().enumerate() {
            let used = waiting.split_off(waiting.len().saturating_sub(part.operand_count()));
            let start = used.first().copied().unwrap_or(at);
            waiting.push(start);
            starts.push(start);
        }
        starts
    }

    /// The number of operands that it takes, which stand before it.
    pub fn operand_count(&self) -> usize {
        match self {
            FormulaPart::Integer(_)
            | FormulaPart::Real(_)
            | FormulaPart::Word(_)
            | FormulaPart::Bit(_) => 0,
            FormulaPart::Element(_) | FormulaPart::Unary(..) => 1,
            FormulaPart::Binary(..) => 2,
            FormulaPart::Call(_, count, _) => *count as usize,
        }
    }

    /// Whether it is a time; `operands`: whether its operands are.
    fn is_time(&self, operands: &[bool]) -> bool {
        let all = !operands.is_empty() && operands.iter().all(|is_time| *is_time);
        match self {
            FormulaPart::Integer(constant) => constant.form == ConstantForm::Duration,
            FormulaPart::Word(word) => matches!(word, Word::Acc(Structure::Timer(_))),
            FormulaPart::Element(array) => {
                array.space == Space::Timer && array.member == Some("Acc") && array.bit.is_none()
            }
            FormulaPart::Unary(operator, _) => *operator == Unary::Minus && all,
            FormulaPart::Binary(operator, _) => {
                let keeps = matches!(operator, Binary::Add | Binary::Subtract | Binary::Remainder);
                let is_part = matches!(operator, Binary::Multiply | Binary::Divide);
                keeps && all
                    || is_part && operands == [true, false]
                    || *operator == Binary::Multiply && operands == [false, true]
            }
            FormulaPart::Call(function, ..) => {
                use Function::{Abs, Clamp, Max, Min, Sum};
                matches!(function, Abs | Clamp | Max | Min | Sum) && all
                    || *function == Function::If && operands.ends_with(&[true, true])
            }
            FormulaPart::Real(_) | FormulaPart::Bit(_) => false,
        }
    }
}

/// An integer constant of an expression. It is equal to the same number in any written form.
#[derive(Clone, Copy, Debug)]
pub struct FormulaInteger {
    /// The number; of a duration, ms.
    pub number: i64,
    /// The form in which it was written.
    pub form: ConstantForm,
}

impl FormulaInteger {
    /// A number that is no duration.
    pub fn new(number: i64) -> FormulaInteger {
        FormulaInteger { number, form: ConstantForm::Integer }
    }
}

impl PartialEq for FormulaInteger {
    fn eq(&self, other: &FormulaInteger) -> bool {
        self.number == other.number
    }
}

impl fmt::Display for FormulaInteger {
    /// As it would be written: `12`, `1m30s`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match i32::try_from(self.number) {
            Ok(number) => f.write_str(&self.form.text(number)),
            Err(_) => write!(f, "{}", self.number),
        }
    }
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
