//! A formula while it is evaluated: its accumulators, slots and mishaps.

use super::encoder::Encoder;
use super::number::Number;
use super::value::RealValue;
use crate::aig::Literal;
use rungd_engine::Mishap;
use rustc_hash::FxHashMap;

/// An integer; `None`: any value.
pub(super) type Integer = Option<Number>;

/// A formula while it is evaluated.
pub(super) struct Evaluation {
    pub integer: Integer,
    pub real: RealValue,
    pub integers: FxHashMap<u32, Integer>,
    pub reals: FxHashMap<u32, RealValue>,
    /// The condition under which the current step is executed.
    pub path: Literal,
    /// By mishap: whether it happened.
    pub noted: [Literal; 4],
    /// By mishap: whether it may have happened.
    pub unclear: [Literal; 4],
    /// The first operation that has no gates.
    pub what: Option<&'static str>,
}

impl Evaluation {
    pub fn new() -> Evaluation {
        Evaluation {
            integer: Some(Number::constant(0)),
            real: RealValue::Known(0.0),
            integers: FxHashMap::default(),
            reals: FxHashMap::default(),
            path: Literal::TRUE,
            noted: [Literal::FALSE; 4],
            unclear: [Literal::FALSE; 4],
            what: None,
        }
    }

    /// The steps are over: what follows is executed in any case.
    pub fn restart(&mut self) {
        self.path = Literal::TRUE;
    }

    /// What follows is executed under a condition, until [`Evaluation::widen`].
    pub fn narrow(&mut self, condition: Literal) -> Literal {
        std::mem::replace(&mut self.path, condition)
    }

    /// Ends a narrower condition.
    pub fn widen(&mut self, path: Literal) {
        self.path = path;
    }

    /// Everything from here on is any value.
    pub fn lose(&mut self, what: &'static str) {
        (self.integer, self.real) = (None, RealValue::Unknown);
        self.unclear = [Literal::TRUE; 4];
        self.what = Some(self.what.unwrap_or(what));
    }
}

impl Encoder<'_> {
    /// Notes a mishap of the current step.
    pub(super) fn note(&mut self, run: &mut Evaluation, mishap: Mishap, happens: Literal) {
        let happens = self.graph.and(run.path, happens);
        let noted = &mut run.noted[mishap as usize];
        *noted = self.graph.or(*noted, happens);
    }

    /// Notes that a mishap of the current step is not known, nor is its result.
    pub(super) fn lose_result(
        &mut self,
        run: &mut Evaluation,
        what: &'static str,
        mishaps: &[Mishap],
    ) {
        for mishap in mishaps {
            let unclear = &mut run.unclear[*mishap as usize];
            *unclear = self.graph.or(*unclear, run.path);
        }
        run.what = Some(run.what.unwrap_or(what));
    }

    /// The value behind a step that is executed under a condition.
    pub(super) fn merged(&mut self, path: Literal, new: Integer, old: &Integer) -> Integer {
        if path == Literal::TRUE {
            return new;
        }
        let (new, old) = (new?, old.as_ref()?);
        Some(self.choose(path, &new, old))
    }

    pub(super) fn merged_real(
        &mut self,
        path: Literal,
        new: RealValue,
        old: &RealValue,
    ) -> RealValue {
        if path == Literal::TRUE {
            return new;
        }
        if new.known().is_some() && new.known() == old.known() {
            return new;
        }
        if let Some((new, old)) = new.exact_whole().zip(old.exact_whole()) {
            return RealValue::Whole(self.choose(path, &new, &old));
        }
        match new.exact_cell().zip(old.exact_cell()) {
            Some((new, old)) => RealValue::Cell(self.choose(path, &new, &old)),
            None => RealValue::Unknown,
        }
    }

    pub(super) fn set_integer(&mut self, run: &mut Evaluation, value: Integer) {
        run.integer = self.merged(run.path, value, &run.integer);
    }

    pub(super) fn set_real(&mut self, run: &mut Evaluation, value: RealValue) {
        run.real = self.merged_real(run.path, value, &run.real);
    }
}
