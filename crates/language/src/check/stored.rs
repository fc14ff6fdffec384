//! The numbers that an instruction stores in words, if a constant is part of them.
//!
//! Called by the rules about constants that do not fit: `constant_saturates`, `lost_fraction`.

use crate::resolve::array::Array;
use crate::resolve::formula::{Formula, FormulaPart, Unary};
use crate::resolve::program::{Instruction, Value};
use crate::resolve::writes::WrittenOperand;
use crate::source::span::{Located, Span};
pub use rungd_engine::isa::{Address, Mnemonic, OperandRole, Word};

/// The words in which an instruction stores: one word, or one or all elements of an array.
#[derive(Clone, Copy)]
pub enum StoredWords {
    One(Word),
    Of(Array),
}

/// The numbers that an instruction stores.
#[derive(Clone, Copy)]
pub struct Storing {
    /// The words in which it stores them.
    pub to: StoredWords,
    /// The numbers.
    pub range: StoredRange,
    /// A constant with a fraction, if all other numbers are whole.
    pub fraction: Option<f64>,
    /// The place of its last constant; for a MATH, the place of its target.
    pub place: Span,
}

/// The least and the greatest number that may be stored.
#[derive(Clone, Copy)]
pub struct StoredRange {
    pub low: f64,
    pub high: f64,
}

impl StoredRange {
    /// A single number.
    fn one(number: f64) -> StoredRange {
        StoredRange { low: number, high: number }
    }

    /// The sums of its numbers and those of a different range.
    fn plus(self, other: StoredRange) -> StoredRange {
        StoredRange { low: self.low + other.low, high: self.high + other.high }
    }

    /// Its numbers with the opposite sign.
    fn negated(self) -> StoredRange {
        StoredRange { low: -self.high, high: -self.low }
    }
}

impl StoredWords {
    /// The first word.
    pub fn first(self) -> Option<Word> {
        match self {
            StoredWords::One(word) => Some(word),
            StoredWords::Of(array) => array.first_word(),
        }
    }

    /// The number of words.
    pub fn count(self) -> usize {
        match self {
            StoredWords::One(_) => 1,
            StoredWords::Of(array) => array.count as usize,
        }
    }

    /// All words.
    pub fn each(self) -> impl Iterator<Item = Word> {
        let (one, array) = match self {
            StoredWords::One(word) => (Some(word), None),
            StoredWords::Of(array) => (None, Some(array)),
        };
        let elements = array.into_iter().flat_map(|array| array.addresses());
        one.into_iter().chain(elements.filter_map(|address| match address {
            Address::Word(word) => Some(word),
            Address::Bit(_) | Address::Structure(_) => None,
        }))
    }
}

/// The numbers that an instruction stores in words, if a constant is part of them: for MOVE, ADD,
/// SUB and FILL, and for a MATH whose whole expression is a constant.
pub fn storing(instruction: &Instruction) -> Option<Storing> {
    let stores = instruction.acting_role() == Some(OperandRole::Stores);
    let written = instruction.writes().next().filter(|_| stores)?;
    let to = match written.value {
        WrittenOperand::Word(word) => StoredWords::One(word),
        WrittenOperand::Array(array) => StoredWords::Of(array),
        WrittenOperand::Bit(_) => return None,
    };
    to.first()?;
    if let Some(calculation) = &instruction.calculation {
        return Some(Storing::of(to, alone(&calculation.value)?, written.span));
    }
    let values: Vec<Located<Value>> = instruction.operands_with(OperandRole::Reads).collect();
    // Without a constant, there is nothing to report.
    let place = values.iter().rfind(|number| number.value.constant().is_some())?.span;
    let range = match *values.as_slice() {
        [a, b] if instruction.mnemonic == Mnemonic::Sub => {
            range(a.value).plus(range(b.value).negated())
        }
        [a, b] => range(a.value).plus(range(b.value)),
        [a] => range(a.value),
        _ => return None,
    };
    Some(Storing { to, range, fraction: fraction(&values), place })
}

impl Storing {
    /// The storing of a constant.
    fn of(to: StoredWords, number: f64, place: Span) -> Storing {
        let fraction = Some(number).filter(|number| number.fract() != 0.0);
        Storing { to, range: StoredRange::one(number), fraction, place }
    }
}

/// The constant with a fraction, if all other numbers are whole.
fn fraction(values: &[Located<Value>]) -> Option<f64> {
    let mut reals = values.iter().filter(|number| number.value.is_real());
    let (real, other) = (reals.next()?, reals.next());
    real.value.constant().filter(|number| number.fract() != 0.0 && other.is_none())
}

/// The least and greatest number of a value. Integers of 32 bits, and their sums, are exact here.
fn range(value: Value) -> StoredRange {
    let (low, high) = match value {
        Value::Const(n, _) => return StoredRange::one(n.into()),
        Value::Real(real) => return StoredRange::one(real.into()),
        Value::Word(word) => word.numbers(),
        Value::Element(element) => element.array.first_word().map_or((0.0, 0.0), Word::numbers),
    };
    StoredRange { low, high }
}

/// The constant that is a whole expression.
fn alone(formula: &Formula) -> Option<f64> {
    let (number, sign) = match *formula.parts.as_slice() {
        [number] => (number, 1.0),
        [number, FormulaPart::Unary(Unary::Minus, _)] => (number, -1.0),
        _ => return None,
    };
    match number {
        FormulaPart::Integer(n) => Some(sign * n.number as f64),
        FormulaPart::Real(real) => Some(sign * f64::from(real)),
        FormulaPart::Word(_)
        | FormulaPart::Bit(_)
        | FormulaPart::Element(_)
        | FormulaPart::Unary(..)
        | FormulaPart::Binary(..)
        | FormulaPart::Call(..) => None,
    }
}
