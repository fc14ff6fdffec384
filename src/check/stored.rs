//! The numbers that an instruction stores in words, if a constant is part of them.
//!
//! Called by the rules about constants that do not fit: `constant_saturates`, `lost_fraction`.

use crate::isa::{Address, Word};
use crate::resolve::array::Array;
use crate::resolve::formula::{Formula, Part, Unary};
use crate::resolve::instruction::{Filling, Source, Target, WordPlace};
use crate::resolve::program::{Action, Value};
use crate::source::span::Span;

/// The words in which an instruction stores: one word, or one or all elements of an array.
#[derive(Clone, Copy)]
pub enum Words {
    One(Word),
    Of(Array),
}

/// The numbers that an instruction stores.
#[derive(Clone, Copy)]
pub struct Storing {
    /// The words in which it stores them.
    pub to: Words,
    /// The least and greatest number.
    pub range: (f64, f64),
    /// A constant with a fraction, if all other numbers are whole.
    pub fraction: Option<f64>,
    /// The place of its last constant; for a MATH, the place of its target.
    pub place: Span,
}

impl Words {
    /// The first word.
    pub fn first(self) -> Option<Word> {
        match self {
            Words::One(word) => Some(word),
            Words::Of(array) => array.first_word(),
        }
    }

    /// The number of words.
    pub fn count(self) -> usize {
        match self {
            Words::One(_) => 1,
            Words::Of(array) => array.count as usize,
        }
    }

    /// All words.
    pub fn each(self) -> impl Iterator<Item = Word> {
        let (one, array) = match self {
            Words::One(word) => (Some(word), None),
            Words::Of(array) => (None, Some(array)),
        };
        let elements = array.into_iter().flat_map(|array| array.addresses());
        one.into_iter().chain(elements.filter_map(|address| match address {
            Address::Word(word) => Some(word),
            Address::Bit(_) | Address::Structure(_) => None,
        }))
    }
}

/// The numbers that an action stores in words, if a constant is part of them: for MOVE, ADD, SUB
/// and FILL, and for a MATH whose whole expression is a constant.
pub fn storing(action: &Action) -> Option<Storing> {
    if let Action::Store { source, to } = action {
        let to = match to.value {
            WordPlace::Word(word) => Words::One(word),
            WordPlace::Element(element) => Words::Of(element.array),
        };
        // Without a constant, there is nothing to report.
        let place = source.values().filter(|of| of.value.constant().is_some()).last()?.span;
        return Some(Storing { to, range: sum(*source), fraction: fraction(*source), place });
    }
    if let Action::Fill { value, to } = action {
        let Filling::Value(number) = value.value else { return None };
        let number = number.constant().filter(|_| !to.value.is_bits())?;
        return Some(Storing::of(Words::Of(to.value), number, value.span));
    }
    let Action::Math { target, index: _, formula } = action else { return None };
    let to = match target.value {
        Target::Word(word) => Words::One(word),
        Target::Array(array) => Words::Of(array),
        Target::Bit(_) => return None,
    };
    to.first()?;
    Some(Storing::of(to, alone(formula)?, target.span))
}

impl Storing {
    /// The storing of a constant.
    fn of(to: Words, number: f64, place: Span) -> Storing {
        let fraction = Some(number).filter(|number| number.fract() != 0.0);
        Storing { to, range: (number, number), fraction, place }
    }
}

fn sum(source: Source) -> (f64, f64) {
    match source {
        Source::Value(a) => range(a.value),
        Source::Sum(a, b) => added(range(a.value), range(b.value)),
        Source::Difference(a, b) => {
            let (low, high) = range(b.value);
            added(range(a.value), (-high, -low))
        }
    }
}

fn added(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0 + b.0, a.1 + b.1)
}

/// The constant with a fraction, if all other numbers are whole.
fn fraction(source: Source) -> Option<f64> {
    let mut reals = source.values().filter(|of| of.value.is_real());
    let (real, other) = (reals.next()?, reals.next());
    real.value.constant().filter(|number| number.fract() != 0.0 && other.is_none())
}

/// The least and greatest number of a value. Integers of 32 bits, and their sums, are exact here.
fn range(value: Value) -> (f64, f64) {
    match value {
        Value::Const(n, _) => (n.into(), n.into()),
        Value::Real(real) => (real.into(), real.into()),
        Value::Word(word) => word.numbers(),
        Value::Element(element) => element.array.first_word().map_or((0.0, 0.0), Word::numbers),
    }
}

/// The constant that is a whole expression.
fn alone(formula: &Formula) -> Option<f64> {
    let (number, sign) = match *formula.parts.as_slice() {
        [number] => (number, 1.0),
        [number, Part::Unary(Unary::Minus, _)] => (number, -1.0),
        _ => return None,
    };
    match number {
        Part::Integer(n) => Some(sign * n as f64),
        Part::Real(real) => Some(sign * f64::from(real)),
        Part::Word(_)
        | Part::Bit(_)
        | Part::Element(_)
        | Part::Unary(..)
        | Part::Binary(..)
        | Part::Call(..) => None,
    }
}
