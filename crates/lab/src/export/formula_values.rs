//! Values of expressions: bits, whole numbers and reals, and how one is stored.
//!
//! A whole number is a DINT as long as none of its possible values is beyond 32 bits, else an
//! LINT; a real is an LREAL, as rungd calculates in 64 bits.

use super::functions::{self, limited, number};
use super::literals::CallLiteral;
use super::project::{BlockCall, CallInput, CallSource, NetworkPower};
use super::rung_acts::RungExport;
use rungd_engine::isa::Word;

/// A part of an expression with its value.
#[derive(Clone, Debug)]
pub(super) enum FormulaResult {
    Power(NetworkPower),
    Whole(WholeResult),
    /// An LREAL.
    Real(CallSource),
}

/// A whole number, and between which values it lies.
#[derive(Clone, Debug)]
pub(super) struct WholeResult {
    pub(super) source: CallSource,
    pub(super) low: i128,
    pub(super) high: i128,
    /// Whether it is an LINT.
    pub(super) is_long: bool,
}

impl WholeResult {
    pub(super) fn constant(value: i64) -> WholeResult {
        let (source, value) = (number(value), value.into());
        WholeResult { source, low: value, high: value, is_long: !is_short(value, value) }
    }

    /// The content of a word that has no reals.
    pub(super) fn of_word(word: Word, source: CallSource) -> WholeResult {
        let (low, high) = word.range();
        WholeResult { source, low: low.into(), high: high.into(), is_long: false }
    }

    /// Its type.
    pub(super) fn type_name(&self) -> &'static str {
        if self.is_long { "LINT" } else { "DINT" }
    }

    /// The number, if it is a literal.
    fn literal(&self) -> Option<i64> {
        functions::literal(&self.source)
    }

    /// As an LINT.
    pub(super) fn long(self) -> WholeResult {
        if self.is_long || self.literal().is_some() {
            return WholeResult { is_long: true, ..self };
        }
        let source = converted("DINT_TO_LINT", self.source);
        WholeResult { source, is_long: true, ..self }
    }

    /// Two operands of one function. Two literals get their type, else the function has none.
    pub(super) fn beside(sides: [WholeResult; 2]) -> [CallSource; 2] {
        let are_literals = sides.iter().all(|side| side.literal().is_some());
        sides.map(|side| match side.literal().filter(|_| are_literals) {
            Some(number) => {
                let is_long = side.is_long;
                CallSource::Literal(CallLiteral::TypedWhole { number, is_long })
            }
            None => side.source,
        })
    }

    /// As an LREAL.
    pub(super) fn real(self) -> CallSource {
        match (self.literal(), self.is_long) {
            (Some(number), _) => long_real(number as f64),
            (None, true) => converted("LINT_TO_LREAL", self.source),
            (None, false) => converted("DINT_TO_LREAL", self.source),
        }
    }
}

/// A literal of an LREAL.
fn long_real(number: f64) -> CallSource {
    CallSource::Literal(CallLiteral::LongReal(number))
}

/// Whether all values from one to another are DINTs.
pub(super) fn is_short(low: i128, high: i128) -> bool {
    low >= i128::from(i32::MIN) && high <= i128::from(i32::MAX)
}

/// A function of one value.
pub(super) fn converted(name: &str, source: CallSource) -> CallSource {
    CallSource::Call(BlockCall::function(name, vec![CallInput { pin: "IN", source }]))
}

/// A value that is stored.
pub(super) enum StoredValue {
    /// Of the type of its target.
    Plain(CallSource),
    Formula(FormulaResult),
}

impl RungExport<'_, '_> {
    /// Whether a value is not 0.
    pub(super) fn as_power(&mut self, value: FormulaResult) -> NetworkPower {
        match value {
            FormulaResult::Power(power) => power,
            FormulaResult::Whole(whole) => self.compared("NE", whole.source, number(0)),
            FormulaResult::Real(source) => self.compared("NE", source, long_real(0.0)),
        }
    }

    /// A value as a whole number: a bit is 0 or 1. A real never comes here.
    pub(super) fn as_whole(&mut self, value: FormulaResult) -> WholeResult {
        match value {
            FormulaResult::Whole(whole) => whole,
            FormulaResult::Power(NetworkPower::Constant(is_on)) => {
                WholeResult::constant(is_on.into())
            }
            FormulaResult::Power(power) => {
                let source = converted("BOOL_TO_DINT", CallSource::Power(power));
                WholeResult { source, low: 0, high: 1, is_long: false }
            }
            FormulaResult::Real(_) => unreachable!("the resolver makes no whole number of a real"),
        }
    }

    /// A value as an LREAL.
    pub(super) fn as_real(&mut self, value: FormulaResult) -> CallSource {
        match value {
            FormulaResult::Real(source) => source,
            value @ (FormulaResult::Power(_) | FormulaResult::Whole(_)) => {
                self.as_whole(value).real()
            }
        }
    }

    /// Two values as whole numbers of one type.
    pub(super) fn both_whole(&mut self, sides: [FormulaResult; 2]) -> [WholeResult; 2] {
        let sides = sides.map(|side| self.as_whole(side));
        match sides.iter().any(|side| side.is_long) {
            true => sides.map(WholeResult::long),
            false => sides,
        }
    }

    /// A variable with a value that is needed more than once.
    pub(super) fn stored_number(&mut self, source: CallSource, type_name: &str) -> CallSource {
        if matches!(source, CallSource::Variable(_) | CallSource::Literal(_)) {
            return source;
        }
        let variable = self.fresh("value", type_name);
        self.assign(&variable, source, NetworkPower::Constant(true));
        CallSource::Variable(variable)
    }

    /// A value that may be read several times.
    pub(super) fn steady(&mut self, value: FormulaResult) -> FormulaResult {
        match value {
            FormulaResult::Power(power) => FormulaResult::Power(power),
            FormulaResult::Real(source) => FormulaResult::Real(self.stored_number(source, "LREAL")),
            FormulaResult::Whole(whole) => {
                let type_name = whole.type_name();
                let source = self.stored_number(whole.source, type_name);
                FormulaResult::Whole(WholeResult { source, ..whole })
            }
        }
    }

    /// A value as the content of a word, within its limits.
    pub(super) fn content(&mut self, word: Word, value: FormulaResult) -> CallSource {
        let (low, high) = self.facts.limits.get(word);
        match (word.is_real(), value) {
            (true, FormulaResult::Whole(whole)) if !whole.is_long => {
                let source = match whole.literal() {
                    Some(_) => whole.real(),
                    None => converted("DINT_TO_REAL", whole.source),
                };
                self.within_limits(word, source)
            }
            (true, value) => {
                let source = converted("LREAL_TO_REAL", self.as_real(value));
                self.within_limits(word, source)
            }
            (false, FormulaResult::Real(source)) => {
                let limit = |limit: i32| long_real(limit.into());
                let limited = limited(limit(low), source, limit(high));
                converted("TRUNC", limited)
            }
            (false, value) => {
                let whole = self.as_whole(value);
                let is_within = whole.low >= low.into() && whole.high <= high.into();
                let source = match is_within {
                    true => whole.source,
                    false => limited(number(low.into()), whole.source, number(high.into())),
                };
                if whole.is_long { converted("LINT_TO_DINT", source) } else { source }
            }
        }
    }

    /// Writes a value to a word, within its limits, while a power is ON.
    pub(super) fn store_value(&mut self, word: Word, value: StoredValue, power: NetworkPower) {
        let source = self.stored_source(word, value);
        self.store(word, source, power);
    }

    /// A value within the limits of the word that gets it.
    pub(super) fn stored_source(&mut self, word: Word, value: StoredValue) -> CallSource {
        match value {
            StoredValue::Plain(source) => self.within_limits(word, source),
            StoredValue::Formula(value) => self.content(word, value),
        }
    }
}
