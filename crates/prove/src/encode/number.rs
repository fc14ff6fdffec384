//! Integers as literals: two's complement of as few bits as their limits need.
//!
//! The operators are exact: a result has as many bits as it needs. What the engine limits, the
//! encoders limit with [`Number::clamp`]. A number knows its limits, so a word of a few values
//! costs few gates, and a constant costs none.

use crate::aig::{GateGraph, Literal};

/// An integer.
#[derive(Clone, Debug)]
pub(super) struct Number {
    /// Two's complement, the lowest bit first; the highest is the sign.
    bits: Vec<Literal>,
    /// No value is below it.
    pub low: i128,
    /// No value is above it.
    pub high: i128,
}

/// The number of bits of two's complement that hold these values.
fn width(low: i128, high: i128) -> usize {
    let of = |n: i128| 129 - (if n < 0 { !n } else { n }).leading_zeros() as usize;
    of(low).max(of(high))
}

impl Number {
    /// A constant.
    pub fn constant(value: i128) -> Number {
        Number::between(value, value, Vec::new())
    }

    /// A number within limits whose bits `make` makes, by their places.
    pub fn made(low: i128, high: i128, mut make: impl FnMut(usize) -> Literal) -> Number {
        let count = if low == high { 0 } else { width(low, high) };
        let bit = |at: usize| match at + 1 == count && low >= 0 {
            true => Literal::FALSE,
            false => make(at),
        };
        Number::between(low, high, (0..count).map(bit).collect())
    }

    /// 0 or 1.
    pub fn of_bit(bit: Literal) -> Number {
        Number::between(0, 1, vec![bit, Literal::FALSE])
    }

    /// The number with these bits, whose value is known to be within limits.
    fn between(low: i128, high: i128, mut bits: Vec<Literal>) -> Number {
        debug_assert!(low <= high);
        let needed = width(low, high);
        if low == high {
            bits = (0..needed).map(|at| Literal::constant(low >> at & 1 == 1)).collect();
            return Number { bits, low, high };
        }
        let sign = *bits.last().expect("a number has a sign");
        bits.resize(needed, sign);
        if low >= 0 {
            bits[needed - 1] = Literal::FALSE;
        } else if high < 0 {
            bits[needed - 1] = Literal::TRUE;
        }
        Number { bits, low, high }
    }

    /// The number with these bits.
    pub fn of_bits(mut bits: Vec<Literal>) -> Number {
        while bits.len() > 1 && bits[bits.len() - 1] == bits[bits.len() - 2] {
            bits.pop();
        }
        let (mut low, mut high) = (0, 0);
        for (at, bit) in bits.iter().enumerate() {
            let is_sign = at + 1 == bits.len();
            let part = if is_sign { -(1_i128 << at) } else { 1 << at };
            match (bit.as_constant(), is_sign) {
                (Some(false), _) => {}
                (Some(true), _) => (low, high) = (low + part, high + part),
                (None, true) => low += part,
                (None, false) => high += part,
            }
        }
        Number::between(low, high, bits)
    }

    /// Its value if it is constant.
    pub fn as_constant(&self) -> Option<i128> {
        (self.low == self.high).then_some(self.low)
    }

    /// One of its bits; the sign beyond the highest.
    pub fn bit(&self, at: usize) -> Literal {
        self.bits[at.min(self.bits.len() - 1)]
    }

    /// Its bits.
    pub fn bits(&self) -> &[Literal] {
        &self.bits
    }

    /// Its lowest bits, as many as asked.
    pub fn lowest(&self, count: usize) -> Vec<Literal> {
        (0..count).map(|at| self.bit(at)).collect()
    }

    fn sign(&self) -> Literal {
        self.bit(usize::MAX)
    }

    /// The same number, whose value is known to be within limits.
    pub fn within(&self, low: i128, high: i128) -> Number {
        let (low, high) = (low.max(self.low), high.min(self.high));
        if low > high {
            // Nothing reaches such a place.
            return Number::constant(low);
        }
        Number::between(low, high, self.bits.clone())
    }

    /// `on` while `choice` is ON, else `off`.
    pub fn mux(graph: &mut GateGraph, choice: Literal, on: &Number, off: &Number) -> Number {
        if let Some(choice) = choice.as_constant() {
            return if choice { on.clone() } else { off.clone() };
        }
        let (low, high) = (on.low.min(off.low), on.high.max(off.high));
        let bits = (0..width(low, high)).map(|at| graph.mux(choice, on.bit(at), off.bit(at)));
        Number::between(low, high, bits.collect())
    }

    /// `self + other + 1` or `self + other`.
    fn sum(
        &self,
        graph: &mut GateGraph,
        other: &Number,
        carries: bool,
        count: usize,
    ) -> Vec<Literal> {
        let mut carry = Literal::constant(carries);
        let mut bits = Vec::with_capacity(count);
        for at in 0..count {
            let (a, b) = (self.bit(at), other.bit(at));
            let half = graph.xor(a, b);
            bits.push(graph.xor(half, carry));
            carry = graph.mux(half, carry, a);
        }
        bits
    }

    /// `self + other`.
    pub fn add(&self, graph: &mut GateGraph, other: &Number) -> Number {
        let (low, high) = (self.low + other.low, self.high + other.high);
        let bits = self.sum(graph, other, false, width(low, high));
        Number::between(low, high, bits)
    }

    /// All bits inverted: `-self - 1`.
    pub fn complement(&self) -> Number {
        let bits = self.bits.iter().map(|bit| !*bit).collect();
        Number::between(!self.high, !self.low, bits)
    }

    /// `self - other`.
    pub fn sub(&self, graph: &mut GateGraph, other: &Number) -> Number {
        let (low, high) = (self.low - other.high, self.high - other.low);
        let bits = self.sum(graph, &other.complement(), true, width(low, high));
        Number::between(low, high, bits)
    }

    /// `-self`.
    pub fn neg(&self, graph: &mut GateGraph) -> Number {
        Number::constant(0).sub(graph, self)
    }

    /// `abs(self)`.
    pub fn abs(&self, graph: &mut GateGraph) -> Number {
        if self.low >= 0 {
            return self.clone();
        }
        let opposite = self.neg(graph);
        let found = Number::mux(graph, self.sign(), &opposite, self);
        found.within(0, (-self.low).max(self.high))
    }

    /// `self << by`.
    fn shifted(&self, by: usize) -> Number {
        let bits = std::iter::repeat_n(Literal::FALSE, by).chain(self.bits.iter().copied());
        Number::between(self.low << by, self.high << by, bits.collect())
    }

    /// `self * other`. Both have at most 64 bits.
    pub fn mul(&self, graph: &mut GateGraph, other: &Number) -> Number {
        let constant = self.as_constant().is_some();
        let (a, b) = match constant || self.bits.len() < other.bits.len() {
            true => (other, self),
            false => (self, other),
        };
        let ends = [a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high];
        let low = ends.into_iter().min().expect("four ends");
        let high = ends.into_iter().max().expect("four ends");
        let mut sum = Number::constant(0);
        for at in 0..b.bits.len() {
            let part = a.shifted(at);
            let part = Number::mux(graph, b.bit(at), &part, &Number::constant(0));
            let is_sign = at + 1 == b.bits.len();
            sum = if is_sign { sum.sub(graph, &part) } else { sum.add(graph, &part) };
        }
        Number::between(low, high, sum.bits)
    }

    /// `self / other` and `self % other` of numbers that are not negative; `other` is not 0.
    fn divided(&self, graph: &mut GateGraph, other: &Number) -> (Number, Number) {
        let mut rest = Number::constant(0);
        let mut quotient = vec![Literal::FALSE; self.bits.len()];
        for at in (0..self.bits.len() - 1).rev() {
            let low = Number::of_bit(self.bit(at));
            rest = rest.shifted(1).add(graph, &low).within(0, other.high * 2 - 1);
            let fits = !rest.less(graph, other);
            quotient[at] = fits;
            let less = rest.sub(graph, other);
            rest = Number::mux(graph, fits, &less, &rest).within(0, (other.high - 1).max(0));
        }
        (Number::between(0, self.high.max(0), quotient), rest.within(0, self.high.max(0)))
    }

    /// `self / other`, rounded towards zero; meaningless if `other` is 0.
    pub fn div(&self, graph: &mut GateGraph, other: &Number) -> Number {
        let (a, b) = (self.abs(graph), other.abs(graph));
        let quotient = a.divided(graph, &b).0;
        let opposite = quotient.neg(graph);
        let inverts = graph.xor(self.sign(), other.sign());
        Number::mux(graph, inverts, &opposite, &quotient)
    }

    /// `self % other`, with the sign of `self`; meaningless if `other` is 0.
    pub fn rem(&self, graph: &mut GateGraph, other: &Number) -> Number {
        let (a, b) = (self.abs(graph), other.abs(graph));
        let rest = a.divided(graph, &b).1;
        let opposite = rest.neg(graph);
        Number::mux(graph, self.sign(), &opposite, &rest)
    }

    /// Whether `self < other`.
    pub fn less(&self, graph: &mut GateGraph, other: &Number) -> Literal {
        if self.high < other.low || self.low >= other.high {
            return Literal::constant(self.high < other.low);
        }
        let count = self.bits.len().max(other.bits.len());
        let mut less = Literal::FALSE;
        for at in 0..count - 1 {
            let differs = graph.xor(self.bit(at), other.bit(at));
            less = graph.mux(differs, other.bit(at), less);
        }
        let differs = graph.xor(self.sign(), other.sign());
        graph.mux(differs, self.sign(), less)
    }

    /// Whether `self == other`.
    pub fn equal(&self, graph: &mut GateGraph, other: &Number) -> Literal {
        if self.high < other.low || self.low > other.high {
            return Literal::FALSE;
        }
        let count = self.bits.len().max(other.bits.len());
        let mut equal = Literal::TRUE;
        for at in 0..count {
            let differs = graph.xor(self.bit(at), other.bit(at));
            equal = graph.and(equal, !differs);
        }
        equal
    }

    /// Whether it is 0.
    pub fn is_zero(&self, graph: &mut GateGraph) -> Literal {
        self.equal(graph, &Number::constant(0))
    }

    /// The lesser of two.
    pub fn lesser(&self, graph: &mut GateGraph, other: &Number) -> Number {
        let less = self.less(graph, other);
        let found = Number::mux(graph, less, self, other);
        found.within(i128::MIN, self.high.min(other.high))
    }

    /// The greater of two.
    pub fn greater(&self, graph: &mut GateGraph, other: &Number) -> Number {
        let less = self.less(graph, other);
        let found = Number::mux(graph, less, other, self);
        found.within(self.low.max(other.low), i128::MAX)
    }

    /// The number, limited to a range.
    pub fn clamp(
        &self,
        graph: &mut GateGraph,
        low: impl Into<i128>,
        high: impl Into<i128>,
    ) -> Number {
        let (low, high) = (low.into(), high.into());
        let above =
            if self.low < low { self.greater(graph, &Number::constant(low)) } else { self.clone() };
        if above.high > high { above.lesser(graph, &Number::constant(high)) } else { above }
    }

    /// Whether it is outside of a range.
    pub fn is_outside(
        &self,
        graph: &mut GateGraph,
        low: impl Into<i128>,
        high: impl Into<i128>,
    ) -> Literal {
        let below = self.less(graph, &Number::constant(low.into()));
        let above = Number::constant(high.into()).less(graph, self);
        graph.or(below, above)
    }

    /// The integer of its lowest 32 bits.
    pub fn low_32(&self) -> Number {
        match self.low >= i32::MIN.into() && self.high <= i32::MAX.into() {
            true => self.clone(),
            false => Number::of_bits(self.lowest(32)),
        }
    }

    /// An operator on each bit of two numbers.
    pub fn bitwise(
        &self,
        other: &Number,
        mut operator: impl FnMut(Literal, Literal) -> Literal,
    ) -> Number {
        let count = self.bits.len().max(other.bits.len());
        Number::of_bits((0..count).map(|at| operator(self.bit(at), other.bit(at))).collect())
    }
}
