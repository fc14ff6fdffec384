//! The arithmetic of MATH on reals: binary64. Every operation is rounded separately, and a result
//! beyond the largest number becomes the largest number.
//!
//! Behaviour: `docs/semantics.md`, section 8. `math` calls one function for each operator and
//! function. No function receives or returns an infinity, a NaN or -0: adding 0 turns -0 into 0,
//! and sums and differences of numbers other than -0 are never -0. The functions of `libm` are
//! compiled into the program, so that every machine computes the same.

use super::integer::compares;
use super::mishap::{Mishap, Mishaps};

/// A result: the largest number in place of an infinity.
#[inline(always)]
fn finite(value: f64, mishaps: &mut Mishaps) -> f64 {
    // One comparison finds both infinities; no result is a NaN.
    if value.abs() > f64::MAX {
        mishaps.note(Mishap::Overflow);
        return largest(value);
    }
    value
}

/// The largest number with the sign of an infinity. A separate function, so that this rare case
/// takes no room in its callers.
#[cold]
#[inline(never)]
fn largest(infinity: f64) -> f64 {
    f64::MAX.copysign(infinity)
}

/// The value as an R word stores it: the nearest binary32, limited to the largest one.
#[inline(always)]
pub fn binary32(value: f64, mishaps: &mut Mishaps) -> f32 {
    let nearest = value as f32;
    if nearest.is_infinite() {
        mishaps.note(Mishap::Overflow);
        return f32::MAX.copysign(nearest);
    }
    nearest + 0.0
}

/// `a + b`.
#[inline(always)]
pub fn add(a: f64, b: f64, mishaps: &mut Mishaps) -> f64 {
    finite(a + b, mishaps)
}

/// `a - b`.
#[inline(always)]
pub fn sub(a: f64, b: f64, mishaps: &mut Mishaps) -> f64 {
    finite(a - b, mishaps)
}

/// `a * b`.
#[inline(always)]
pub fn mul(a: f64, b: f64, mishaps: &mut Mishaps) -> f64 {
    finite(a * b, mishaps) + 0.0
}

/// `a / b`; 0 if `b` is 0.
#[inline(always)]
pub fn div(a: f64, b: f64, mishaps: &mut Mishaps) -> f64 {
    if b == 0.0 {
        mishaps.note(Mishap::DivideByZero);
        return 0.0;
    }
    finite(a / b, mishaps) + 0.0
}

/// `a % b`, with the sign of `a`; 0 if `b` is 0.
pub fn rem(a: f64, b: f64, mishaps: &mut Mishaps) -> f64 {
    if b == 0.0 {
        mishaps.note(Mishap::DivideByZero);
        return 0.0;
    }
    libm::fmod(a, b) + 0.0
}

/// `a ** b`, as a binary32.
pub fn pow(a: f64, b: f64, mishaps: &mut Mishaps) -> f64 {
    if a == 0.0 && b < 0.0 {
        mishaps.note(Mishap::DivideByZero);
        return 0.0;
    }
    if a < 0.0 && libm::trunc(b) != b {
        mishaps.note(Mishap::OutOfRange);
        return 0.0;
    }
    f64::from(binary32(libm::pow(a, b), mishaps))
}

/// `-a`.
#[inline(always)]
pub fn neg(a: f64, _: &mut Mishaps) -> f64 {
    0.0 - a
}

/// `abs(a)`.
#[inline(always)]
pub fn abs(a: f64, _: &mut Mishaps) -> f64 {
    a.abs()
}

/// `min(a, b)`.
#[inline(always)]
pub fn min(a: f64, b: f64, _: &mut Mishaps) -> f64 {
    a.min(b)
}

/// `max(a, b)`.
#[inline(always)]
pub fn max(a: f64, b: f64, _: &mut Mishaps) -> f64 {
    a.max(b)
}

compares!(f64);

/// Converts a real without a fraction to an integer, limited to 64 bits.
fn integer(whole: f64, mishaps: &mut Mishaps) -> i64 {
    const LIMIT: f64 = 9_223_372_036_854_775_808.0;
    if !(-LIMIT..LIMIT).contains(&whole) {
        mishaps.note(Mishap::Overflow);
    }
    // The cast saturates at the limits.
    whole as i64
}

/// `round(a)`: half away from zero.
pub fn round(a: f64, mishaps: &mut Mishaps) -> i64 {
    integer(libm::round(a), mishaps)
}

/// `floor(a)`.
pub fn floor(a: f64, mishaps: &mut Mishaps) -> i64 {
    integer(libm::floor(a), mishaps)
}

/// `ceil(a)`.
pub fn ceil(a: f64, mishaps: &mut Mishaps) -> i64 {
    integer(libm::ceil(a), mishaps)
}

/// `trunc(a)`.
pub fn trunc(a: f64, mishaps: &mut Mishaps) -> i64 {
    integer(libm::trunc(a), mishaps)
}

/// `sqrt(a)`, in binary64.
#[inline(always)]
pub fn sqrt(a: f64, mishaps: &mut Mishaps) -> f64 {
    in_domain(a >= 0.0, mishaps, |_| a.sqrt())
}

/// The result of a function for an argument in its domain; else 0.
fn in_domain(is_in: bool, mishaps: &mut Mishaps, calculate: impl Fn(&mut Mishaps) -> f64) -> f64 {
    if is_in {
        return calculate(mishaps);
    }
    mishaps.note(Mishap::OutOfRange);
    0.0
}

macro_rules! functions {
    ($($name:ident $a:ident $domain:expr;)*) => {$(
        #[doc = concat!("`", stringify!($name), "(a)`, as a binary32.")]
        pub fn $name($a: f64, mishaps: &mut Mishaps) -> f64 {
            in_domain($domain, mishaps, |mishaps| {
                f64::from(binary32(libm::$name($a), mishaps))
            })
        }
    )*};
}

functions! {
    exp a true;
    log a a > 0.0;
    log10 a a > 0.0;
    sin a true;
    cos a true;
    tan a true;
    asin a a.abs() <= 1.0;
    acos a a.abs() <= 1.0;
    atan a true;
}

/// `atan2(y, x)`, as a binary32.
pub fn atan2(y: f64, x: f64, mishaps: &mut Mishaps) -> f64 {
    f64::from(binary32(libm::atan2(y, x), mishaps))
}

#[cfg(test)]
mod tests {
    use super::Mishap::{DivideByZero, OutOfRange, Overflow};
    use super::*;

    const MAX: f64 = f64::MAX;
    const MAX32: f64 = f32::MAX as f64;

    type Two = fn(f64, f64, &mut Mishaps) -> f64;

    /// Compares by bits, so that -0 is not 0.
    fn check(rows: &[(Two, f64, f64, f64, &[Mishap])]) {
        for (row, (operator, a, b, expected, noted)) in rows.iter().enumerate() {
            let mut mishaps = Mishaps::default();
            let found = operator(*a, *b, &mut mishaps);
            let found = (found.to_bits(), mishaps.each().collect::<Vec<_>>());
            let expected = (expected.to_bits(), noted.to_vec());
            assert_eq!(found, expected, "row {row}: {a:?}, {b:?}: {}", f64::from_bits(found.0));
        }
    }

    #[test]
    fn real_results_saturate_and_are_never_negative_zero() {
        check(&[
            (add, 0.1, 0.2, 0.1 + 0.2, &[]),
            (add, MAX, MAX, MAX, &[Overflow]),
            (sub, -MAX, MAX, -MAX, &[Overflow]),
            (mul, 1e200, -1e200, -MAX, &[Overflow]),
            (mul, 0.0, -5.0, 0.0, &[]),
            (mul, 1e-300, -1e-300, 0.0, &[]),
            (div, 1e300, 1e-300, MAX, &[Overflow]),
            (div, 0.0, -5.0, 0.0, &[]),
            (div, 5.0, 0.0, 0.0, &[DivideByZero]),
            (rem, -7.5, 2.0, -1.5, &[]),
            (rem, -6.0, 2.0, 0.0, &[]),
            (rem, 7.5, 0.0, 0.0, &[DivideByZero]),
            (|a, _, m| neg(a, m), 0.0, 0.0, 0.0, &[]),
            (|a, _, m| neg(a, m), 1.5, 0.0, -1.5, &[]),
        ]);
    }

    #[test]
    fn a_power_is_rounded_to_binary32() {
        check(&[
            (pow, 2.0, 0.5, f64::from(std::f32::consts::SQRT_2), &[]),
            (pow, 2.0, -1.0, 0.5, &[]),
            (pow, 0.0, 0.0, 1.0, &[]),
            (pow, 0.0, -1.0, 0.0, &[DivideByZero]),
            (pow, -2.0, 3.0, -8.0, &[]),
            (pow, -2.0, 0.5, 0.0, &[OutOfRange]),
            (pow, -2.0, 1e300, MAX32, &[Overflow]),
            (pow, -1e30, 3.0, -MAX32, &[Overflow]),
            (pow, -1e-30, 3.0, 0.0, &[]),
        ]);
    }

    #[test]
    fn functions_round_to_binary32_and_report_values_outside_their_domains() {
        check(&[
            (|a, _, m| sqrt(a, m), 2.0, 0.0, std::f64::consts::SQRT_2, &[]),
            (|a, _, m| sqrt(a, m), -1.0, 0.0, 0.0, &[OutOfRange]),
            (|a, _, m| exp(a, m), 1.0, 0.0, f64::from(std::f32::consts::E), &[]),
            (|a, _, m| exp(a, m), 1e9, 0.0, MAX32, &[Overflow]),
            (|a, _, m| exp(a, m), -1e9, 0.0, 0.0, &[]),
            (|a, _, m| log(a, m), 1.0, 0.0, 0.0, &[]),
            (|a, _, m| log(a, m), 0.0, 0.0, 0.0, &[OutOfRange]),
            (|a, _, m| log10(a, m), 1000.0, 0.0, 3.0, &[]),
            (|a, _, m| log10(a, m), -1.0, 0.0, 0.0, &[OutOfRange]),
            (|a, _, m| sin(a, m), -1e-60, 0.0, 0.0, &[]),
            (|a, _, m| cos(a, m), 0.0, 0.0, 1.0, &[]),
            (|a, _, m| asin(a, m), 1.5, 0.0, 0.0, &[OutOfRange]),
            (|a, _, m| acos(a, m), -1.0, 0.0, f64::from(std::f32::consts::PI), &[]),
            (|a, _, m| acos(a, m), -1.1, 0.0, 0.0, &[OutOfRange]),
            (atan2, 0.0, -1.0, f64::from(std::f32::consts::PI), &[]),
            (atan2, 0.0, 0.0, 0.0, &[]),
            (atan2, -1e-60, 1.0, 0.0, &[]),
        ]);
    }

    #[test]
    fn roundings_give_integers_and_saturate() {
        type One = fn(f64, &mut Mishaps) -> i64;
        let rows: [(One, f64, i64, bool); 12] = [
            (round, 2.5, 3, false),
            (round, -2.5, -3, false),
            (round, 0.499_999_999_999_999_94, 0, false),
            (floor, -2.5, -3, false),
            (ceil, -2.5, -2, false),
            (ceil, -0.5, 0, false),
            (trunc, 2.9, 2, false),
            (trunc, -2.9, -2, false),
            (trunc, 1e19, i64::MAX, true),
            (trunc, -1e19, i64::MIN, true),
            (trunc, -9_223_372_036_854_775_808.0, i64::MIN, false),
            (trunc, 9_223_372_036_854_775_808.0, i64::MAX, true),
        ];
        for (function, a, expected, over) in rows {
            let mut mishaps = Mishaps::default();
            assert_eq!((function(a, &mut mishaps), mishaps.has(Overflow)), (expected, over), "{a}");
        }
    }

    #[test]
    fn a_stored_real_is_the_nearest_binary32() {
        let above = MAX32 + 2f64.powi(102);
        for (value, expected, over) in [
            (0.1, 0.1f32, false),
            (-1e-60, 0.0, false),
            (1e39, f32::MAX, true),
            (-1e39, -f32::MAX, true),
            (above, f32::MAX, false),
            (MAX32 + 2f64.powi(103), f32::MAX, true),
        ] {
            let mut mishaps = Mishaps::default();
            let found = binary32(value, &mut mishaps).to_bits();
            assert_eq!((found, mishaps.has(Overflow)), (expected.to_bits(), over), "{value}");
        }
    }
}
