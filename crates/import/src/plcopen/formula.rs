//! Values that are no power: variables, literals, results of functions.

use super::literals::{IecLiteral, duration, real};
use super::types::IecType;
use crate::condition::TouchedPlace;

/// A value, as an expression of rungd.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct IecFormula {
    pub(super) text: String,
    pub(super) kind: FormulaType,
    pub(super) reads: Vec<TouchedPlace>,
    /// Whether it is a variable or a literal.
    pub(super) is_atom: bool,
}

/// The type of a value; a literal takes the type of what it stands beside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FormulaType {
    Known(IecType),
    Literal(IecLiteral),
}

impl IecFormula {
    pub(super) fn of_literal(literal: IecLiteral) -> IecFormula {
        let text = match literal {
            IecLiteral::Bool(is_on) => u8::from(is_on).to_string(),
            IecLiteral::Whole(value) => value.to_string(),
            IecLiteral::Real(value) => real(value),
            IecLiteral::Time { ms, .. } => duration(ms),
        };
        IecFormula { text, kind: FormulaType::Literal(literal), reads: Vec::new(), is_atom: true }
    }

    /// It as a value of a type; a whole number may be one of a wider type.
    ///
    /// # Errors
    /// It is of another type.
    pub(super) fn fitted(self, wanted: IecType) -> Result<IecFormula, String> {
        let fits = match self.kind {
            FormulaType::Known(kind) => wanted.holds(kind),
            FormulaType::Literal(literal) => match (literal, wanted) {
                (IecLiteral::Whole(value), IecType::Whole { .. } | IecType::Bool) => {
                    let [low, high] = wanted.range();
                    (low..=high).contains(&value)
                }
                (IecLiteral::Whole(value), IecType::Real) => {
                    let text = real(value as f64);
                    return Ok(IecFormula { text, kind: FormulaType::Known(wanted), ..self });
                }
                (IecLiteral::Real(_), IecType::Real)
                | (IecLiteral::Time { .. }, IecType::Time)
                | (IecLiteral::Bool(_), IecType::Bool) => true,
                _ => false,
            },
        };
        match fits {
            true => Ok(IecFormula { kind: FormulaType::Known(wanted), ..self }),
            false => Err(format!("`{}` where another type is wanted", self.text)),
        }
    }

    /// It beside an operator.
    pub(super) fn operand(&self) -> String {
        let is_sign = self.text.starts_with('-');
        if self.is_atom && !is_sign { self.text.clone() } else { format!("({})", self.text) }
    }
}

/// The type in which values are calculated: that of the widest.
///
/// # Errors
/// They are of types that do not go together, or all are literals of no certain type.
pub(super) fn common(values: &[IecFormula]) -> Result<IecType, String> {
    let mut common: Option<IecType> = None;
    for value in values {
        let FormulaType::Known(kind) = value.kind else { continue };
        common = match common {
            None => Some(kind),
            Some(before) if before.holds(kind) => Some(before),
            Some(before) if kind.holds(before) => Some(kind),
            Some(IecType::Whole { .. }) if matches!(kind, IecType::Whole { .. }) => {
                Some(IecType::Whole { bits: 32, is_signed: true })
            }
            Some(_) => return Err("values of different types".to_owned()),
        };
    }
    let of_literal = |value: &IecFormula| match value.kind {
        FormulaType::Literal(IecLiteral::Real(_)) => Some(IecType::Real),
        FormulaType::Literal(IecLiteral::Time { .. }) => Some(IecType::Time),
        FormulaType::Literal(IecLiteral::Bool(_)) => Some(IecType::Bool),
        FormulaType::Literal(IecLiteral::Whole(_)) | FormulaType::Known(_) => None,
    };
    let is_short = |value: &IecFormula| match value.kind {
        FormulaType::Literal(IecLiteral::Whole(value)) => i16::try_from(value).is_ok(),
        FormulaType::Literal(_) | FormulaType::Known(_) => true,
    };
    let whole = match values.iter().all(is_short) {
        true => super::types::INT,
        false => IecType::Whole { bits: 32, is_signed: true },
    };
    common
        .or_else(|| values.iter().find_map(of_literal))
        .or(Some(whole).filter(|_| !values.is_empty()))
        .ok_or_else(|| "a function without values".to_owned())
}

/// Whether the values have different types.
pub(super) fn are_mixed(values: &[IecFormula]) -> bool {
    let known = values.iter().filter_map(|value| match value.kind {
        FormulaType::Known(kind) => Some(kind),
        FormulaType::Literal(_) => None,
    });
    let mut known = known.collect::<Vec<_>>();
    known.dedup();
    known.len() > 1
}
