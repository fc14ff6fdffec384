//! The operators and functions of formulas, as in the engine's `integer` and `real`.

use super::encoder::Encoder;
use super::evaluation::{Evaluation, Integer};
use super::number::Number;
use super::value::RealValue;
use crate::aig::{GateGraph, Literal};
use rungd_engine::Mishap::{DivideByZero, OutOfRange, Overflow};
use rungd_engine::ops::{OneOperator, PairOperator};
use rungd_engine::{Mishap, Mishaps, integer, real};

/// The greatest exponent of a power that is multiplied out.
const POWER_MAX: i128 = 8;

/// A function of reals as the engine computes it.
type RealFunction = fn(f64, f64, &mut Mishaps) -> f64;

/// What a real operator without gates is called, and the mishaps that it may have.
struct RealOperation {
    what: &'static str,
    mishaps: &'static [Mishap],
    compute: RealFunction,
}

impl Encoder<'_> {
    /// Whether an operator computes with integers.
    pub(super) fn is_of_integers(&self, operator: PairOperator) -> bool {
        match operator {
            PairOperator::Add
            | PairOperator::Sub
            | PairOperator::Mul
            | PairOperator::Div
            | PairOperator::Rem
            | PairOperator::And
            | PairOperator::Or
            | PairOperator::Equal
            | PairOperator::NotEqual
            | PairOperator::Less
            | PairOperator::AtMost
            | PairOperator::Pow
            | PairOperator::Xor
            | PairOperator::ShiftLeft
            | PairOperator::ShiftRight
            | PairOperator::ShiftRightZeros
            | PairOperator::Min
            | PairOperator::Max => true,
            PairOperator::RealAdd
            | PairOperator::RealSub
            | PairOperator::RealMul
            | PairOperator::RealDiv
            | PairOperator::RealEqual
            | PairOperator::RealNotEqual
            | PairOperator::RealLess
            | PairOperator::RealAtMost
            | PairOperator::RealRem
            | PairOperator::RealPow
            | PairOperator::RealMin
            | PairOperator::RealMax
            | PairOperator::Atan2 => false,
        }
    }

    /// An operator of two integers.
    pub(super) fn integer_operator(
        &mut self,
        run: &mut Evaluation,
        operator: PairOperator,
        [a, b]: [Integer; 2],
    ) -> Integer {
        let (Some(a), Some(b)) = (a, b) else {
            let mishaps = [DivideByZero, Overflow, OutOfRange];
            self.lose_result(run, "an integer that reals decide", &mishaps);
            return None;
        };
        let graph = &mut self.graph;
        let bit = |literal| Some(Number::of_bit(literal));
        match operator {
            PairOperator::Add => {
                let sum = a.add(graph, &b);
                Some(self.limited(run, sum))
            }
            PairOperator::Sub => {
                let difference = a.sub(graph, &b);
                Some(self.limited(run, difference))
            }
            PairOperator::Mul => {
                let product = a.mul(graph, &b);
                Some(self.limited(run, product))
            }
            PairOperator::Div => {
                let quotient = a.div(graph, &b);
                let quotient = self.unless_zero(run, &b, quotient);
                Some(self.limited(run, quotient))
            }
            PairOperator::Rem => {
                let rest = a.rem(graph, &b);
                Some(self.unless_zero(run, &b, rest))
            }
            PairOperator::Pow => self.power_of(run, &a, &b),
            PairOperator::And => Some(a.low_32().bitwise(&b.low_32(), |a, b| graph.and(a, b))),
            PairOperator::Or => Some(a.low_32().bitwise(&b.low_32(), |a, b| graph.or(a, b))),
            PairOperator::Xor => Some(a.low_32().bitwise(&b.low_32(), |a, b| graph.xor(a, b))),
            PairOperator::ShiftLeft | PairOperator::ShiftRight | PairOperator::ShiftRightZeros => {
                Some(self.shift(operator, &a.low_32(), &b))
            }
            PairOperator::Min => Some(a.lesser(graph, &b)),
            PairOperator::Max => Some(a.greater(graph, &b)),
            PairOperator::Equal => bit(a.equal(graph, &b)),
            PairOperator::NotEqual => bit(!a.equal(graph, &b)),
            PairOperator::Less => bit(a.less(graph, &b)),
            PairOperator::AtMost => bit(!b.less(graph, &a)),
            PairOperator::RealAdd
            | PairOperator::RealSub
            | PairOperator::RealMul
            | PairOperator::RealDiv
            | PairOperator::RealEqual
            | PairOperator::RealNotEqual
            | PairOperator::RealLess
            | PairOperator::RealAtMost
            | PairOperator::RealRem
            | PairOperator::RealPow
            | PairOperator::RealMin
            | PairOperator::RealMax
            | PairOperator::Atan2 => unreachable!("an operator of reals"),
        }
    }

    /// A result limited to 64 bits.
    fn limited(&mut self, run: &mut Evaluation, result: Number) -> Number {
        let outside = result.is_outside(&mut self.graph, i64::MIN, i64::MAX);
        self.note(run, Overflow, outside);
        result.clamp(&mut self.graph, i64::MIN, i64::MAX)
    }

    /// The result of a division; 0 if the divisor is 0.
    fn unless_zero(&mut self, run: &mut Evaluation, divisor: &Number, result: Number) -> Number {
        let is_zero = divisor.is_zero(&mut self.graph);
        self.note(run, DivideByZero, is_zero);
        self.choose(is_zero, &Number::constant(0), &result)
    }

    fn power_of(&mut self, run: &mut Evaluation, a: &Number, n: &Number) -> Integer {
        if let (Some(a), Some(n)) = (a.as_constant(), n.as_constant()) {
            let mut mishaps = Mishaps::default();
            let value = integer::pow(a as i64, n as i64, &mut mishaps);
            self.note_all(run, mishaps);
            return Some(Number::constant(value.into()));
        }
        let Some(n @ 0..=POWER_MAX) = n.as_constant() else {
            self.lose_result(run, "a power", &[DivideByZero, Overflow, OutOfRange]);
            return None;
        };
        let mut product = Number::constant(1);
        for _ in 0..n {
            let wide = product.mul(&mut self.graph, a);
            product = self.limited(run, wide);
        }
        Some(product)
    }

    fn note_all(&mut self, run: &mut Evaluation, mishaps: Mishaps) {
        for mishap in mishaps.each() {
            self.note(run, mishap, Literal::TRUE);
        }
    }

    /// A shift of the low 32 bits.
    fn shift(&mut self, operator: PairOperator, a: &Number, count: &Number) -> Number {
        let left = operator == PairOperator::ShiftLeft;
        let keeps_sign = operator == PairOperator::ShiftRight;
        let mut bits = a.lowest(32);
        let fill = if keeps_sign { bits[31] } else { Literal::FALSE };
        for level in 0..5 {
            let (by, choice) = (1_usize << level, count.bit(level));
            let before = bits.clone();
            for (at, bit) in bits.iter_mut().enumerate() {
                let from = if left { at.checked_sub(by) } else { Some(at + by) };
                let moved = from.and_then(|from| before.get(from).copied()).unwrap_or(fill);
                *bit = self.graph.mux(choice, moved, before[at]);
            }
        }
        let outside = count.is_outside(&mut self.graph, 0, 31);
        let all_out = Number::of_bits(vec![fill; 2]);
        self.choose(outside, &all_out, &Number::of_bits(bits))
    }

    /// An operator of two reals.
    pub(super) fn real_operator(
        &mut self,
        run: &mut Evaluation,
        operator: PairOperator,
        [a, b]: [&RealValue; 2],
    ) {
        let mut lost = match operator {
            PairOperator::RealEqual | PairOperator::RealNotEqual => {
                let equal = a.equal(&mut self.graph, b);
                let inverts = operator == PairOperator::RealNotEqual;
                return self.compared_reals(run, equal.map(|equal| equal.inverted_if(inverts)));
            }
            PairOperator::RealLess => {
                let less = a.less(&mut self.graph, b);
                return self.compared_reals(run, less);
            }
            PairOperator::RealAtMost => {
                let above = b.less(&mut self.graph, a);
                return self.compared_reals(run, above.map(|above| !above));
            }
            PairOperator::RealMin => return self.least(run, [a, b], false),
            PairOperator::RealMax => return self.least(run, [a, b], true),
            PairOperator::RealAdd => lost("a sum of reals", &[Overflow], real::add),
            PairOperator::RealSub => lost("a difference of reals", &[Overflow], real::sub),
            PairOperator::RealMul => lost("a product of reals", &[Overflow], real::mul),
            PairOperator::RealDiv => {
                lost("a quotient of reals", &[DivideByZero, Overflow], real::div)
            }
            PairOperator::RealRem => lost("a remainder of reals", &[DivideByZero], real::rem),
            PairOperator::RealPow => {
                lost("a power of reals", &[DivideByZero, Overflow, OutOfRange], real::pow)
            }
            PairOperator::Atan2 => lost("a function of reals", &[Overflow], real::atan2),
            PairOperator::Add
            | PairOperator::Sub
            | PairOperator::Mul
            | PairOperator::Div
            | PairOperator::Rem
            | PairOperator::And
            | PairOperator::Or
            | PairOperator::Equal
            | PairOperator::NotEqual
            | PairOperator::Less
            | PairOperator::AtMost
            | PairOperator::Pow
            | PairOperator::Xor
            | PairOperator::ShiftLeft
            | PairOperator::ShiftRight
            | PairOperator::ShiftRightZeros
            | PairOperator::Min
            | PairOperator::Max => unreachable!("an operator of integers"),
        };
        let known = a.known().zip(b.known()).map(|(a, b)| [a, b]);
        if known.is_none() && matches!(operator, PairOperator::RealDiv | PairOperator::RealRem) {
            lost.mishaps = self.mishaps_of_division(run, b, lost.mishaps);
        }
        let adds = operator == PairOperator::RealAdd;
        let value = if b.is_zero() && (adds || operator == PairOperator::RealSub) {
            a.clone()
        } else if a.is_zero() && adds {
            b.clone()
        } else {
            self.computed(run, known, &lost)
        };
        self.set_real(run, value);
    }

    /// Notes a division by 0, for which no quotient is needed. Returns the mishaps that are left.
    fn mishaps_of_division(
        &mut self,
        run: &mut Evaluation,
        divisor: &RealValue,
        all: &'static [Mishap],
    ) -> &'static [Mishap] {
        let Some(is_some) = divisor.truth(&mut self.graph) else { return all };
        self.note(run, DivideByZero, !is_some);
        // It comes first in both lists.
        all.strip_prefix(&[DivideByZero]).unwrap_or(all)
    }

    /// The result of known operands; else any value.
    fn computed(
        &mut self,
        run: &mut Evaluation,
        known: Option<[f64; 2]>,
        lost: &RealOperation,
    ) -> RealValue {
        let Some([a, b]) = known else {
            self.lose_result(run, lost.what, lost.mishaps);
            return RealValue::Unknown;
        };
        let mut mishaps = Mishaps::default();
        let value = (lost.compute)(a, b, &mut mishaps);
        self.note_all(run, mishaps);
        RealValue::Known(value)
    }

    fn compared_reals(&mut self, run: &mut Evaluation, found: Option<Literal>) {
        if found.is_none() {
            self.lose_result(run, "a compare of reals", &[]);
        }
        self.set_integer(run, found.map(Number::of_bit));
    }

    /// The lesser of two reals, or the greater one.
    fn least(&mut self, run: &mut Evaluation, [a, b]: [&RealValue; 2], greatest: bool) {
        let less = a.less(&mut self.graph, b);
        let choice = less.map(|less| less.inverted_if(greatest));
        let value = choice.and_then(|choice| match (a, b) {
            (RealValue::Known(a), RealValue::Known(b)) => {
                let min = if greatest { a.max(*b) } else { a.min(*b) };
                Some(RealValue::Known(min))
            }
            (RealValue::Whole(a), RealValue::Whole(b)) => {
                Some(RealValue::Whole(self.choose(choice, a, b)))
            }
            _ => {
                let (a, b) = (a.exact_cell()?, b.exact_cell()?);
                Some(RealValue::Cell(self.choose(choice, &a, &b)))
            }
        });
        if value.is_none() {
            self.lose_result(run, "a compare of reals", &[]);
        }
        self.set_real(run, value.unwrap_or(RealValue::Unknown));
    }

    /// An operator or function of one number.
    pub(super) fn one_operator(&mut self, run: &mut Evaluation, operator: OneOperator) {
        let known = run.real.known().map(|real| [real, 0.0]);
        let mut function = |what: &'static str, mishaps: &'static [Mishap], compute| {
            let value = self.computed(run, known, &lost(what, mishaps, compute));
            self.set_real(run, value);
        };
        let domain: &[Mishap] = &[OutOfRange, Overflow];
        match operator {
            OneOperator::Exp => function("exp", domain, |a, _, m| real::exp(a, m)),
            OneOperator::Ln => function("ln", domain, |a, _, m| real::log(a, m)),
            OneOperator::Log10 => function("log10", domain, |a, _, m| real::log10(a, m)),
            OneOperator::Sin => function("sin", domain, |a, _, m| real::sin(a, m)),
            OneOperator::Cos => function("cos", domain, |a, _, m| real::cos(a, m)),
            OneOperator::Tan => function("tan", domain, |a, _, m| real::tan(a, m)),
            OneOperator::Asin => function("asin", domain, |a, _, m| real::asin(a, m)),
            OneOperator::Acos => function("acos", domain, |a, _, m| real::acos(a, m)),
            OneOperator::Atan => function("atan", domain, |a, _, m| real::atan(a, m)),
            OneOperator::Sqrt => function("sqrt", domain, |a, _, m| real::sqrt(a, m)),
            OneOperator::Neg => self.one_integer(run, Number::neg),
            OneOperator::Abs => self.one_integer(run, Number::abs),
            OneOperator::Complement => self.one_integer(run, |a, _| a.low_32().complement()),
            OneOperator::RealNeg | OneOperator::RealAbs => self.sign(run, operator),
            OneOperator::Round => self.rounded(run, real::round),
            OneOperator::Floor => self.rounded(run, real::floor),
            OneOperator::Ceil => self.rounded(run, real::ceil),
            OneOperator::Trunc => self.rounded(run, real::trunc),
            OneOperator::ToReal => {
                let real = run.integer.clone().map_or(RealValue::Unknown, RealValue::of_whole);
                if matches!(real, RealValue::Unknown) {
                    self.lose_result(run, "an integer as a real", &[]);
                }
                self.set_real(run, real);
            }
            OneOperator::Truth | OneOperator::Not => {
                let inverts = operator == OneOperator::Not;
                let truth = run.integer.clone().map(|value| !value.is_zero(&mut self.graph));
                let truth = truth.map(|truth| Number::of_bit(truth.inverted_if(inverts)));
                self.set_integer(run, truth);
            }
            OneOperator::RealTruth | OneOperator::RealNot => {
                let inverts = operator == OneOperator::RealNot;
                let truth = run.real.clone().truth(&mut self.graph);
                let truth = truth.map(|truth| Number::of_bit(truth.inverted_if(inverts)));
                self.set_integer(run, truth);
            }
        }
    }

    fn one_integer(&mut self, run: &mut Evaluation, of: fn(&Number, &mut GateGraph) -> Number) {
        let Some(a) = run.integer.clone() else {
            return self.lose_result(run, "an integer that reals decide", &[Overflow]);
        };
        let result = of(&a, &mut self.graph);
        let limited = self.limited(run, result);
        self.set_integer(run, Some(limited));
    }

    /// The opposite or the absolute value of a real. The cell of an opposite is the complement.
    fn sign(&mut self, run: &mut Evaluation, operator: OneOperator) {
        let is_abs = operator == OneOperator::RealAbs;
        let value = match run.real.clone() {
            RealValue::Known(value) => {
                RealValue::Known(if is_abs { value.abs() } else { 0.0 - value })
            }
            RealValue::Whole(whole) if is_abs => RealValue::Whole(whole.abs(&mut self.graph)),
            RealValue::Whole(whole) => RealValue::Whole(whole.neg(&mut self.graph)),
            RealValue::Cell(cell) => {
                let zero = Number::constant(0);
                let is_negative = cell.less(&mut self.graph, &zero);
                let keeps = cell.is_zero(&mut self.graph);
                let keeps = if is_abs { !is_negative } else { keeps };
                RealValue::Cell(self.choose(keeps, &cell, &cell.complement()))
            }
            RealValue::Unknown => RealValue::Unknown,
        };
        self.set_real(run, value);
    }

    /// A real rounded to an integer.
    fn rounded(&mut self, run: &mut Evaluation, round: fn(f64, &mut Mishaps) -> i64) {
        let value = match run.real.clone() {
            RealValue::Known(value) => {
                let mut mishaps = Mishaps::default();
                let whole = round(value, &mut mishaps);
                self.note_all(run, mishaps);
                Some(Number::constant(whole.into()))
            }
            RealValue::Whole(whole) => Some(whole),
            RealValue::Cell(_) | RealValue::Unknown => {
                self.lose_result(run, "a real that is rounded", &[Overflow]);
                None
            }
        };
        self.set_integer(run, value);
    }
}

fn lost(what: &'static str, mishaps: &'static [Mishap], compute: RealFunction) -> RealOperation {
    RealOperation { what, mishaps, compute }
}
