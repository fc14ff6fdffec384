//! Reals: IEEE 754 binary32, as constants and as the contents of an R word.
//!
//! A leaf module. The behaviour is that of `docs/semantics.md`, section 8: a real is never an
//! infinity, a NaN or -0. The engine computes with reals in binary64 and stores them through
//! [`Real::stored`].
//!
//! The cell of an R word is an `i32`, as that of every other word. Its integer sorts as the real
//! does, and 0 is 0.0. So limits, forces, images and equal tests treat an R as any other word; only
//! arithmetic, texts and peers need the number itself.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A binary32 that is finite and not -0.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(into = "f32", try_from = "f32")]
pub struct Real(i32);

/// The real that is nearest to a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NearestReal {
    /// The real.
    pub real: Real,
    /// Whether the number is beyond the largest real.
    pub is_beyond: bool,
}

/// Why a text is no real constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RealError {
    /// It does not have the form of a real constant: `12.5`, `-0.02`, `1e3`, `2.5e-7`.
    Form,
    /// It is beyond the largest binary32.
    Beyond,
}

impl Real {
    /// The largest real.
    pub const MAX: Real = Real(f32::MAX.to_bits().cast_signed());
    /// The least real: the opposite of the largest.
    pub const MIN: Real = Real(!Real::MAX.0);

    /// The content of an R word's cell.
    #[inline(always)]
    pub fn of_cell(cell: i32) -> Real {
        Real(cell)
    }

    /// The cell's content. Cells sort as the reals do.
    #[inline(always)]
    pub fn cell(self) -> i32 {
        self.0
    }

    /// The number.
    #[inline(always)]
    pub fn number(self) -> f32 {
        f32::from_bits((self.0 ^ lower_bits_if_negative(self.0)).cast_unsigned())
    }

    /// The real of a finite number; -0 becomes 0. `None` for an infinity and a NaN.
    pub fn finite(number: f32) -> Option<Real> {
        number.is_finite().then(|| Real::of(number))
    }

    /// The nearest real of a number (ties to even). For a number beyond the largest real it is the
    /// largest or the least real.
    #[inline(always)]
    pub fn stored(number: f64) -> NearestReal {
        let nearest = number as f32;
        let is_beyond = !nearest.is_finite();
        NearestReal { real: Real::of(nearest.clamp(-f32::MAX, f32::MAX)), is_beyond }
    }

    /// The nearest real of an integer.
    pub fn nearest(integer: i32) -> Real {
        Real::stored(f64::from(integer)).real
    }

    /// The real of a finite number.
    #[inline(always)]
    fn of(number: f32) -> Real {
        debug_assert!(number.is_finite());
        // Adding 0 turns -0 into 0, and changes no other number.
        let bits = (number + 0.0).to_bits().cast_signed();
        Real(bits ^ lower_bits_if_negative(bits))
    }
}

/// All bits but the sign for a negative number, no bits for any other number.
#[inline(always)]
fn lower_bits_if_negative(bits: i32) -> i32 {
    (bits >> 31) & i32::MAX
}

impl From<Real> for f64 {
    #[inline(always)]
    fn from(real: Real) -> f64 {
        f64::from(real.number())
    }
}

impl From<Real> for f32 {
    fn from(real: Real) -> f32 {
        real.number()
    }
}

impl TryFrom<f32> for Real {
    type Error = &'static str;

    fn try_from(number: f32) -> Result<Real, &'static str> {
        Real::finite(number).ok_or("a real is finite")
    }
}

impl FromStr for Real {
    type Err = RealError;

    /// Reads a real constant: digits on both sides of its point, or an exponent.
    fn from_str(text: &str) -> Result<Real, RealError> {
        let digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
        let unsigned = text.strip_prefix('-').unwrap_or(text);
        let (mantissa, exponent) = match unsigned.split_once('e') {
            Some((mantissa, exponent)) => (mantissa, Some(exponent)),
            None => (unsigned, None),
        };
        let mantissa_fits = match mantissa.split_once('.') {
            Some((whole, fraction)) => digits(whole) && digits(fraction),
            None => digits(mantissa) && exponent.is_some(),
        };
        let exponent_fits = exponent.is_none_or(|e| digits(e.strip_prefix('-').unwrap_or(e)));
        if !mantissa_fits || !exponent_fits {
            return Err(RealError::Form);
        }
        let number: f32 = text.parse().map_err(|_| RealError::Form)?;
        Real::finite(number).ok_or(RealError::Beyond)
    }
}

impl fmt::Display for Real {
    /// The shortest digits that read back to the same real: `12.5`, `3.0`, `1.5e-7`, `1e20`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.number())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_reals_parse_to_the_same_value() {
        for text in ["12.5", "-0.02", "0.0", "3.0", "1.5e-7", "1e20", "0.0001", "-3.4028235e38"] {
            assert_eq!(text.parse::<Real>().map(|real| real.to_string()).as_deref(), Ok(text));
        }
        assert_eq!("1e3".parse::<Real>().map(|real| real.to_string()).as_deref(), Ok("1000.0"));
        assert_eq!("-0.0".parse(), Ok(Real::default()));
        assert_eq!("1e-99".parse(), Ok(Real::default()));
        assert_eq!("1e39".parse::<Real>(), Err(RealError::Beyond));
        for text in ["12", ".5", "5.", "1e", "1e+3", "1E3", "inf", "NaN", "0x1e3", "1.0f", "", "e3"]
        {
            assert_eq!(text.parse::<Real>(), Err(RealError::Form), "{text}");
        }
    }

    #[test]
    fn cells_of_reals_sort_as_the_reals_do() {
        let texts = ["-3.4028235e38", "-1e0", "-1e-45", "0.0", "1e-45", "0.5", "1e0", "1e20"];
        let reals: Vec<Real> = texts.iter().filter_map(|text| text.parse().ok()).collect();
        assert_eq!(reals.len(), texts.len());
        assert!(reals.is_sorted_by(|a, b| a.cell() < b.cell()));
        assert!(reals.is_sorted_by(|a, b| a.number() < b.number()));
        assert_eq!((reals[0], Real::MAX.number()), (Real::MIN, f32::MAX));
        assert_eq!((Real::default().number(), Real::default().cell()), (0.0, 0));
        for real in reals {
            assert_eq!(Real::finite(real.number()), Some(real));
        }
    }

    #[test]
    fn a_stored_real_is_rounded_to_even_and_limited() {
        let stored = |number: f64| {
            let NearestReal { real, is_beyond } = Real::stored(number);
            (real.number(), is_beyond)
        };
        assert_eq!(stored(16_777_217.0), (16_777_216.0, false));
        assert_eq!(stored(16_777_219.0), (16_777_220.0, false));
        assert_eq!(stored(1e300), (f32::MAX, true));
        assert_eq!(stored(-1e300), (-f32::MAX, true));
        // Beyond the largest binary32, but nearer to it than to the next number that would follow.
        assert_eq!(stored(3.402_823_5e38), (f32::MAX, false));
        assert_eq!(stored(-0.0).0.to_bits(), 0);
        assert_eq!(stored(-1e-99).0.to_bits(), 0);
        assert_eq!(Real::nearest(i32::MIN).number(), -2_147_483_648.0);
    }
}
