//! Literals of IEC 61131-3, with their values. Used by all parts of the export that write one.

use rungd_engine::isa::Real;

/// A literal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CallLiteral {
    /// Of a DINT or an LINT.
    Whole(i64),
    /// The same, with its type: beside other literals alone it would have no certain one.
    TypedWhole { number: i64, is_long: bool },
    /// Of a REAL.
    Real(Real),
    /// Of an LREAL.
    LongReal(f64),
    /// Of a TIME, in ms.
    TimeMs(u32),
}

impl CallLiteral {
    /// The number; a TIME is none.
    pub(super) fn number(self) -> Option<f64> {
        match self {
            CallLiteral::Whole(number) | CallLiteral::TypedWhole { number, .. } => {
                Some(number as f64)
            }
            CallLiteral::Real(real) => Some(real.number().into()),
            CallLiteral::LongReal(number) => Some(number),
            CallLiteral::TimeMs(_) => None,
        }
    }

    /// As it is written: `-5`, `DINT#5`, `12.5`, `1.0E20`, `T#100ms`.
    pub(super) fn text(self) -> String {
        match self {
            CallLiteral::Whole(number) => number.to_string(),
            CallLiteral::TypedWhole { number, is_long: false } => format!("DINT#{number}"),
            CallLiteral::TypedWhole { number, is_long: true } => format!("LINT#{number}"),
            CallLiteral::Real(real) => with_power(format!("{:?}", real.number())),
            CallLiteral::LongReal(number) => with_power(format!("{number:?}")),
            CallLiteral::TimeMs(ms) => format!("T#{ms}ms"),
        }
    }
}

/// A number as Rust writes it, as the standard does.
fn with_power(text: String) -> String {
    match text.split_once('e') {
        Some((digits, power)) if digits.contains('.') => format!("{digits}E{power}"),
        Some((digits, power)) => format!("{digits}.0E{power}"),
        None => text,
    }
}
