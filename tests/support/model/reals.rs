//! Values that may be reals: compares, MOVE, ADD, SUB, COPY, FILL.

use super::exec::Sim;
use super::math::Number;
use super::place::{Area, Loc};
use super::program::{Compare, To, Value};

impl Value {
    pub fn is_real(self) -> bool {
        match self {
            Value::Const(_) => false,
            Value::Real(_) => true,
            Value::At(loc) => loc.area == Area::R,
            Value::Element(array, _) => array.first.area == Area::R,
        }
    }
}

impl Sim<'_> {
    /// The present value; 0 for an element outside of its array.
    fn exact(&self, value: Value) -> Number {
        match value {
            Value::Real(real) => Number::Real(real),
            value if value.is_real() => {
                Number::Real(f64::from(f32::from_bits(self.value(value) as u32)))
            }
            value => Number::Integer(i128::from(self.value(value))),
        }
    }

    /// The present value for an instruction that acts; notes a wrong index.
    pub fn operand(&mut self, value: Value) -> Number {
        if !matches!(value, Value::Real(_)) {
            self.read(value);
        }
        self.exact(value)
    }

    pub fn at(&self, loc: Loc) -> Number {
        self.exact(Value::At(loc))
    }

    /// Stores as MOVE does: limited, truncated towards zero, or the nearest binary32.
    pub fn store(&mut self, to: To, number: Number) {
        let loc = match to {
            To::At(loc) => loc,
            To::Element(array, index) => match array.element(self.memory.get(index)) {
                Some(loc) => loc,
                None => return self.wrong_index(),
            },
        };
        self.store_at(loc, number);
    }

    pub fn store_at(&mut self, loc: Loc, number: Number) {
        if loc.area == Area::R {
            let single = (number.real() as f32).clamp(f32::MIN, f32::MAX);
            return self.memory.put_real(loc, single);
        }
        let whole = match number {
            Number::Integer(n) => n,
            Number::Real(real) => real.trunc() as i128,
        };
        let limited = whole.clamp(i128::from(i64::MIN), i128::from(i64::MAX));
        self.memory.put(loc, limited as i64);
    }

    pub fn sum(&mut self, a: Value, b: Value, to: To) {
        let (a, b) = (self.operand(a), self.operand(b));
        self.store(
            to,
            match (a, b) {
                (Number::Integer(a), Number::Integer(b)) => Number::Integer(a + b),
                _ => Number::Real(a.real() + b.real()),
            },
        );
    }

    pub fn difference(&mut self, a: Value, b: Value, to: To) {
        let (a, b) = (self.operand(a), self.operand(b));
        self.store(
            to,
            match (a, b) {
                (Number::Integer(a), Number::Integer(b)) => Number::Integer(a - b),
                _ => Number::Real(a.real() - b.real()),
            },
        );
    }

    /// Compares in binary64, which holds every operand exactly.
    pub fn compare(&self, left: Value, compare: Compare, right: Value) -> bool {
        let (left, right) = (self.exact(left).real(), self.exact(right).real());
        match compare {
            Compare::Equal => left == right,
            Compare::NotEqual => left != right,
            Compare::Less => left < right,
            Compare::LessEqual => left <= right,
            Compare::Greater => left > right,
            Compare::GreaterEqual => left >= right,
        }
    }
}
