//! `multiply`, `divide` and `offset` of a row: the keys of every driver whose points are numbers.
//!
//! Used by the drivers' folders. The driver decides which of its points have a scaling.

use std::ops::RangeInclusive;

use rungd_io::scaling::Scaling;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::key;
use rungd_language::source::reader::Table;
use rungd_language::source::span::{Located, Span};

const FACTORS: RangeInclusive<i64> = -1_000_000..=1_000_000;
const DIVISORS: RangeInclusive<i64> = 1..=1_000_000;
const OFFSETS: RangeInclusive<i64> = i32::MIN as i64..=i32::MAX as i64;

/// The keys of a row for its scaling.
#[derive(Clone, Debug, Default)]
pub struct ScalingKeys {
    /// `multiply`.
    pub multiply: Option<Located<i64>>,
    /// `divide`.
    pub divide: Option<Located<i64>>,
    /// `offset`.
    pub offset: Option<Located<i64>>,
}

impl ScalingKeys {
    /// Reads the keys.
    pub fn read(row: &mut Table<'_>) -> ScalingKeys {
        ScalingKeys {
            multiply: row.integer(
                key(
                    "multiply",
                    "Of numbers: the factor that the device's number is multiplied by.",
                )
                .limited(r#"{"not":{"const":0}}"#),
                FACTORS,
            ),
            divide: row.integer(key("divide", "Of numbers: the divisor of the product."), DIVISORS),
            offset: row.integer(
                key("offset", "Of numbers: the number that is added then; memory holds the sum."),
                OFFSETS,
            ),
        }
    }

    /// Whether any of the keys is given.
    pub fn is_given(&self) -> bool {
        [&self.multiply, &self.divide, &self.offset].into_iter().any(Option::is_some)
    }

    /// The findings for a row of bits, which has no scaling.
    pub fn refuse(&self, findings: &mut Vec<Finding>) {
        for (name, key) in
            [("multiply", &self.multiply), ("divide", &self.divide), ("offset", &self.offset)]
        {
            if let Some(key) = key {
                findings.push(finding(key.span, format!("a bit has no `{name}`")));
            }
        }
    }

    /// The scaling; `real`: whether memory holds a real.
    pub fn resolve(&self, real: bool, findings: &mut Vec<Finding>) -> Scaling {
        if let Some(zero) = self.multiply.as_ref().filter(|multiply| multiply.value == 0) {
            findings.push(finding(zero.span, "`multiply` by 0 leaves nothing".to_owned()));
        }
        let or = |key: &Option<Located<i64>>, default| {
            key.as_ref().map_or(default, |number| number.value as i32)
        };
        Scaling {
            real,
            multiply: or(&self.multiply, 1),
            divide: or(&self.divide, 1),
            offset: or(&self.offset, 0),
        }
    }
}

fn finding(span: Span, message: String) -> Finding {
    Finding::new(Code::Controller, span, message)
}
