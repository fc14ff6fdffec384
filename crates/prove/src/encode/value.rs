//! Reals as far as gates know them: the cell of an R word, an integer, or a known number. Anything
//! else is `Unknown`, and becomes a cut where it is stored.
//!
//! The cells of reals sort as the reals do, so compares and copies of R words are exact.

use super::number::Number;
use crate::aig::{GateGraph, Literal};
use rungd_engine::isa::Real;

/// A real that an operation computes with.
#[derive(Clone, Debug)]
pub(super) enum RealValue {
    /// The content of an R word's cell.
    Cell(Number),
    /// An integer of a word.
    Whole(Number),
    /// A constant.
    Known(f64),
    /// Any value.
    Unknown,
}

impl RealValue {
    /// The real of a cell.
    pub fn of_cell(cell: Number) -> RealValue {
        match cell.as_constant() {
            Some(cell) => RealValue::Known(Real::of_cell(cell as i32).into()),
            None => RealValue::Cell(cell),
        }
    }

    /// The real of an integer.
    pub fn of_whole(whole: Number) -> RealValue {
        let is_exact = |end: i128| end.abs() <= 1 << 53;
        match whole.as_constant() {
            Some(value) => RealValue::Known(value as i64 as f64),
            None if is_exact(whole.low) && is_exact(whole.high) => RealValue::Whole(whole),
            None => RealValue::Unknown,
        }
    }

    /// Whether it is the constant 0.
    pub fn is_zero(&self) -> bool {
        matches!(self, RealValue::Known(value) if *value == 0.0)
    }

    /// Its constant value.
    pub fn known(&self) -> Option<f64> {
        if let RealValue::Known(value) = self { Some(*value) } else { None }
    }

    /// The content of the R word that stores it.
    pub fn cell(&self) -> Option<Number> {
        match self {
            RealValue::Cell(cell) => Some(cell.clone()),
            RealValue::Known(value) => {
                Some(Number::constant(Real::stored(*value).real.cell().into()))
            }
            RealValue::Whole(_) | RealValue::Unknown => None,
        }
    }

    /// The content of an R word that has exactly this value.
    pub fn exact_cell(&self) -> Option<Number> {
        let is_exact = |value: f64| f64::from(Real::stored(value).real) == value;
        let is_exact = self.known().is_none_or(is_exact);
        if is_exact { self.cell() } else { None }
    }

    /// The integer that it is exactly.
    pub fn exact_whole(&self) -> Option<Number> {
        let is_exact = |value: f64| value as i64 as f64 == value && value.abs() < 1e15;
        let is_exact = self.known().is_none_or(is_exact);
        if is_exact { self.whole() } else { None }
    }

    /// The integer, truncated towards zero and limited to 64 bits.
    pub fn whole(&self) -> Option<Number> {
        match self {
            RealValue::Whole(whole) => Some(whole.clone()),
            RealValue::Known(value) => Some(Number::constant((*value as i64).into())),
            RealValue::Cell(_) | RealValue::Unknown => None,
        }
    }

    /// Whether it is not 0.
    pub fn truth(&self, graph: &mut GateGraph) -> Option<Literal> {
        match self {
            RealValue::Cell(number) | RealValue::Whole(number) => Some(!number.is_zero(graph)),
            RealValue::Known(value) => Some(Literal::constant(*value != 0.0)),
            RealValue::Unknown => None,
        }
    }

    /// The sum as MOVE and ADD form it: with a constant 0 it is the same number.
    pub fn sum(&self, other: &RealValue) -> RealValue {
        match (self, other) {
            (RealValue::Known(a), RealValue::Known(b)) => RealValue::Known(a + b),
            (_, RealValue::Known(0.0)) => self.clone(),
            (RealValue::Known(0.0), _) => other.clone(),
            _ => RealValue::Unknown,
        }
    }

    /// The difference as SUB forms it.
    pub fn difference(&self, other: &RealValue) -> RealValue {
        match (self, other) {
            (RealValue::Known(a), RealValue::Known(b)) => RealValue::Known(a - b),
            (_, RealValue::Known(0.0)) => self.clone(),
            _ => RealValue::Unknown,
        }
    }

    /// Whether both are equal.
    pub fn equal(&self, graph: &mut GateGraph, other: &RealValue) -> Option<Literal> {
        let (a, b) = match (self, other) {
            (RealValue::Known(a), RealValue::Known(b)) => return Some(Literal::constant(a == b)),
            (RealValue::Known(known), value) | (value, RealValue::Known(known)) => {
                let (low, high) = (value.not_below(*known)?, value.not_above(*known)?);
                if low != high {
                    return Some(Literal::FALSE);
                }
                (value.number()?, Number::constant(low))
            }
            _ => self.alike(other)?,
        };
        Some(a.equal(graph, &b))
    }

    /// Whether this is less than the other.
    pub fn less(&self, graph: &mut GateGraph, other: &RealValue) -> Option<Literal> {
        let (a, b) = match (self, other) {
            (RealValue::Known(a), RealValue::Known(b)) => return Some(Literal::constant(a < b)),
            (RealValue::Known(known), value) => {
                (Number::constant(value.not_above(*known)?), value.number()?)
            }
            (value, RealValue::Known(known)) => {
                (value.number()?, Number::constant(value.not_below(*known)?))
            }
            _ => self.alike(other)?,
        };
        Some(a.less(graph, &b))
    }

    /// Both numbers, if they compare as the reals do.
    fn alike(&self, other: &RealValue) -> Option<(Number, Number)> {
        match (self, other) {
            (RealValue::Cell(a), RealValue::Cell(b))
            | (RealValue::Whole(a), RealValue::Whole(b)) => Some((a.clone(), b.clone())),
            _ => None,
        }
    }

    fn number(&self) -> Option<Number> {
        match self {
            RealValue::Cell(number) | RealValue::Whole(number) => Some(number.clone()),
            RealValue::Known(_) | RealValue::Unknown => None,
        }
    }

    /// The least number, of the kind of this one, whose real is not below a known one.
    fn not_below(&self, known: f64) -> Option<i128> {
        match self {
            RealValue::Cell(_) => {
                let nearest = Real::stored(known).real;
                let is_below = f64::from(nearest) < known;
                Some(i128::from(nearest.cell()) + i128::from(is_below))
            }
            RealValue::Whole(_) => Some(known.ceil() as i128),
            RealValue::Known(_) | RealValue::Unknown => None,
        }
    }

    /// The greatest number, of the kind of this one, whose real is not above a known one.
    fn not_above(&self, known: f64) -> Option<i128> {
        match self {
            RealValue::Cell(_) => {
                let nearest = Real::stored(known).real;
                let is_above = f64::from(nearest) > known;
                Some(i128::from(nearest.cell()) - i128::from(is_above))
            }
            RealValue::Whole(_) => Some(known.floor() as i128),
            RealValue::Known(_) | RealValue::Unknown => None,
        }
    }
}
