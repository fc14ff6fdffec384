//! The types of IEC 61131-3 that rungd has a place for.

use super::document::{NamedType, WrittenType};

/// An elementary type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum IecType {
    Bool,
    /// A whole number, or a string of bits.
    Whole {
        bits: u32,
        is_signed: bool,
    },
    /// In ms.
    Time,
    Real,
}

/// INT.
pub(super) const INT: IecType = IecType::Whole { bits: 16, is_signed: true };

impl IecType {
    /// The type with a name.
    ///
    /// # Errors
    /// rungd has no place for it.
    pub(super) fn named(name: &str) -> Result<IecType, String> {
        let whole = |bits, is_signed| Ok(IecType::Whole { bits, is_signed });
        match name.to_uppercase().as_str() {
            "BOOL" => Ok(IecType::Bool),
            "SINT" => whole(8, true),
            "INT" => whole(16, true),
            "DINT" => whole(32, true),
            "USINT" | "BYTE" => whole(8, false),
            "UINT" | "WORD" => whole(16, false),
            "TIME" => Ok(IecType::Time),
            "REAL" | "LREAL" => Ok(IecType::Real),
            "UDINT" | "LINT" | "ULINT" | "DWORD" => whole(32, true),
            other => Err(format!("the type {other}")),
        }
    }

    /// What a variable of a type loses here.
    pub(super) fn loss(name: &str) -> Option<&'static str> {
        match name.to_uppercase().as_str() {
            "LREAL" => Some("an LREAL: here it is a REAL"),
            "UDINT" => Some("a UDINT: here it is a DINT"),
            "LINT" => Some("an LINT: here it is a DINT"),
            "ULINT" => Some("a ULINT: here it is a DINT"),
            "DWORD" => Some("a DWORD: here it is a DINT"),
            _ => None,
        }
    }

    /// `type` of a tag.
    pub(super) fn plain(self) -> &'static str {
        match self {
            IecType::Bool => "bit",
            IecType::Whole { .. } | IecType::Time => "int",
            IecType::Real => "real",
        }
    }

    /// The least and the greatest value of a whole number.
    pub(super) fn range(self) -> [i64; 2] {
        match self {
            IecType::Whole { bits, is_signed: true } => {
                [-(1_i64 << (bits - 1)), (1_i64 << (bits - 1)) - 1]
            }
            IecType::Whole { bits, is_signed: false } => [0, (1_i64 << bits) - 1],
            IecType::Bool => [0, 1],
            IecType::Time | IecType::Real => [i64::from(i32::MIN), i64::from(i32::MAX)],
        }
    }

    /// Whether each value of another type is one of this type.
    pub(super) fn holds(self, other: IecType) -> bool {
        if self == other {
            return true;
        }
        match (self, other) {
            (IecType::Whole { .. }, IecType::Whole { .. }) => {
                let ([low, high], [least, most]) = (self.range(), other.range());
                low <= least && most <= high
            }
            _ => false,
        }
    }

    /// A calculated text with the bits of this type only. The values of whole numbers wrap.
    pub(super) fn cut(self, text: &str) -> String {
        match self {
            IecType::Whole { bits: 32, .. } => format!("({text}) & -1"),
            IecType::Whole { bits, is_signed: true } => {
                let shift = 32 - bits;
                format!("({text}) << {shift} >> {shift}")
            }
            IecType::Whole { bits, is_signed: false } => {
                format!("({text}) & {}", (1_i64 << bits) - 1)
            }
            IecType::Bool | IecType::Time | IecType::Real => text.to_owned(),
        }
    }
}

/// What a variable is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum VariableKind {
    Plain(IecType),
    Array {
        element: IecType,
        low: i64,
        count: u32,
    },
    Struct(Vec<StructField>),
    /// An instance of a block: of the standard, or of the file.
    Instance(String),
    /// What rungd has no place for, with the reason.
    Missing(String),
}

/// A member of a structure.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StructField {
    pub(super) name: String,
    pub(super) field: String,
    pub(super) kind: IecType,
}

/// A step, as a tag.
#[derive(Clone, Debug)]
pub(super) struct StepTag {
    pub(super) name: String,
    /// Whether it has a `T`.
    pub(super) is_timed: bool,
}

/// A type as it is written, without names of data types.
pub(super) fn resolved(kind: &WrittenType, types: &[NamedType]) -> WrittenType {
    let mut kind = kind.clone();
    for _ in 0..16 {
        let WrittenType::Derived(name) = &kind else { return kind };
        let found = types.iter().find(|named| named.name.eq_ignore_ascii_case(name));
        match found {
            Some(named) => kind = named.kind.clone(),
            None => return kind,
        }
    }
    WrittenType::Other("a type that names itself".to_owned())
}
