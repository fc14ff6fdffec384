//! The arithmetic of MATH on integers: 64 bits; a result beyond the limits becomes the limit.
//!
//! Behaviour: `docs/semantics.md`, section 8. `math` calls one function for each operator. Every
//! function notes its mishaps and never panics.

use super::mishap::{Mishap, Mishaps};

/// The result; after an overflow (`None`), the limit on that side.
#[inline(always)]
fn limited(result: Option<i64>, is_below: impl Fn() -> bool, mishaps: &mut Mishaps) -> i64 {
    let Some(value) = result else {
        mishaps.note(Mishap::Overflow);
        return limit(is_below());
    };
    value
}

/// A limit. A separate function, so that this rare case takes no room in its callers.
#[cold]
#[inline(never)]
fn limit(is_low: bool) -> i64 {
    if is_low { i64::MIN } else { i64::MAX }
}

/// `a + b`.
#[inline(always)]
pub fn add(a: i64, b: i64, mishaps: &mut Mishaps) -> i64 {
    limited(a.checked_add(b), || a < 0, mishaps)
}

/// `a - b`.
#[inline(always)]
pub fn sub(a: i64, b: i64, mishaps: &mut Mishaps) -> i64 {
    limited(a.checked_sub(b), || a < 0, mishaps)
}

/// `a * b`.
#[inline(always)]
pub fn mul(a: i64, b: i64, mishaps: &mut Mishaps) -> i64 {
    limited(a.checked_mul(b), || (a < 0) != (b < 0), mishaps)
}

/// `-a`.
#[inline(always)]
pub fn neg(a: i64, mishaps: &mut Mishaps) -> i64 {
    sub(0, a, mishaps)
}

/// `abs(a)`.
#[inline(always)]
pub fn abs(a: i64, mishaps: &mut Mishaps) -> i64 {
    limited(a.checked_abs(), || false, mishaps)
}

/// `a / b`, rounded towards zero; 0 if `b` is 0.
#[inline(always)]
pub fn div(a: i64, b: i64, mishaps: &mut Mishaps) -> i64 {
    // Most numbers are small, and a 32-bit division takes a third of the time of a 64-bit one.
    if let (Ok(a), Ok(b @ 1..)) = (u32::try_from(a), u32::try_from(b)) {
        return i64::from(a / b);
    }
    if b == 0 {
        mishaps.note(Mishap::DivideByZero);
        return 0;
    }
    limited(a.checked_div(b), || false, mishaps)
}

/// `a % b`, with the sign of `a`; 0 if `b` is 0.
#[inline(always)]
pub fn rem(a: i64, b: i64, mishaps: &mut Mishaps) -> i64 {
    if let (Ok(a), Ok(b @ 1..)) = (u32::try_from(a), u32::try_from(b)) {
        return i64::from(a % b);
    }
    if b == 0 {
        mishaps.note(Mishap::DivideByZero);
        return 0;
    }
    a.wrapping_rem(b)
}

/// `a ** n`: repeated `*`.
pub fn pow(a: i64, n: i64, mishaps: &mut Mishaps) -> i64 {
    if n < 0 {
        mishaps.note(if a == 0 { Mishap::DivideByZero } else { Mishap::OutOfRange });
        return 0;
    }
    let is_odd = n % 2 == 1;
    match a {
        _ if n == 0 => 1,
        0 | 1 => a,
        -1 => {
            if is_odd {
                -1
            } else {
                1
            }
        }
        // For every other base, a power with an exponent above 63 is beyond a limit.
        _ => match a.checked_pow(n.min(64) as u32) {
            Some(power) => power,
            None => {
                mishaps.note(Mishap::Overflow);
                if a < 0 && is_odd { i64::MIN } else { i64::MAX }
            }
        },
    }
}

/// The low 32 bits: the operands of operators on bits.
#[inline(always)]
fn low(a: i64) -> i32 {
    a as i32
}

/// `a & b`.
#[inline(always)]
pub fn and(a: i64, b: i64, _: &mut Mishaps) -> i64 {
    i64::from(low(a) & low(b))
}

/// `a | b`.
#[inline(always)]
pub fn or(a: i64, b: i64, _: &mut Mishaps) -> i64 {
    i64::from(low(a) | low(b))
}

/// `a ^ b`.
#[inline(always)]
pub fn xor(a: i64, b: i64, _: &mut Mishaps) -> i64 {
    i64::from(low(a) ^ low(b))
}

/// `~a`.
#[inline(always)]
pub fn complement(a: i64, _: &mut Mishaps) -> i64 {
    i64::from(!low(a))
}

/// `a << count`; 0 if `count` is outside 0 to 31.
#[inline(always)]
pub fn shift_left(a: i64, count: i64, _: &mut Mishaps) -> i64 {
    match count {
        0..=31 => i64::from(low(a) << count),
        _ => 0,
    }
}

/// `a >> count`, filled with the sign; 0 or -1 if `count` is outside 0 to 31.
#[inline(always)]
pub fn shift_right(a: i64, count: i64, _: &mut Mishaps) -> i64 {
    let count = if (0..=31).contains(&count) { count } else { 31 };
    i64::from(low(a) >> count)
}

/// `a >>> count`, filled with zeros; 0 if `count` is outside 0 to 31.
#[inline(always)]
pub fn shift_right_zeros(a: i64, count: i64, _: &mut Mishaps) -> i64 {
    match count {
        0..=31 => i64::from((low(a).cast_unsigned() >> count).cast_signed()),
        _ => 0,
    }
}

/// `min(a, b)`.
#[inline(always)]
pub fn min(a: i64, b: i64, _: &mut Mishaps) -> i64 {
    a.min(b)
}

/// `max(a, b)`.
#[inline(always)]
pub fn max(a: i64, b: i64, _: &mut Mishaps) -> i64 {
    a.max(b)
}

/// The compares of integers, or of reals.
macro_rules! compares {
    ($number:ident) => {
        compares! { $number: equal ==; not_equal !=; less <; at_most <=; }
    };
    ($number:ident: $($name:ident $sign:tt;)*) => {$(
        #[doc = concat!("Whether `a ", stringify!($sign), " b`: 0 or 1.")]
        #[inline(always)]
        pub fn $name(a: $number, b: $number, _: &mut Mishaps) -> i64 {
            i64::from(a $sign b)
        }
    )*};
}

pub(super) use compares;

compares!(i64);

/// An integer, limited to a range.
#[inline(always)]
pub fn within(value: i64, low: i32, high: i32, mishaps: &mut Mishaps) -> i32 {
    let limited = value.clamp(i64::from(low), i64::from(high));
    if limited != value {
        mishaps.note(Mishap::Overflow);
    }
    limited as i32
}

#[cfg(test)]
mod tests {
    use super::Mishap::{DivideByZero, OutOfRange, Overflow};
    use super::*;

    const MIN: i64 = i64::MIN;
    const MAX: i64 = i64::MAX;

    type Two = fn(i64, i64, &mut Mishaps) -> i64;

    fn check(rows: &[(Two, i64, i64, i64, &[Mishap])]) {
        for (row, (operator, a, b, expected, noted)) in rows.iter().enumerate() {
            let mut mishaps = Mishaps::default();
            let found = operator(*a, *b, &mut mishaps);
            let found = (found, mishaps.each().collect::<Vec<_>>());
            assert_eq!(found, (*expected, noted.to_vec()), "row {row}: {a}, {b}");
        }
    }

    #[test]
    fn results_beyond_64_bits_saturate_and_set_overflow() {
        check(&[
            (add, 2, 3, 5, &[]),
            (add, MAX, 1, MAX, &[Overflow]),
            (add, MIN, -1, MIN, &[Overflow]),
            (sub, MIN, 1, MIN, &[Overflow]),
            (sub, MAX, -1, MAX, &[Overflow]),
            (mul, MAX, 2, MAX, &[Overflow]),
            (mul, MAX, -2, MIN, &[Overflow]),
            (mul, MIN, -1, MAX, &[Overflow]),
            (mul, 1 << 31, 1 << 31, 1 << 62, &[]),
            (div, MIN, -1, MAX, &[Overflow]),
            (|a, _, m| neg(a, m), MIN, 0, MAX, &[Overflow]),
            (|a, _, m| neg(a, m), 5, 0, -5, &[]),
            (|a, _, m| abs(a, m), MIN, 0, MAX, &[Overflow]),
            (|a, _, m| abs(a, m), -5, 0, 5, &[]),
        ]);
    }

    #[test]
    fn division_truncates_and_the_remainder_has_the_sign_of_the_dividend() {
        check(&[
            (div, 7, 2, 3, &[]),
            (div, -7, 2, -3, &[]),
            (div, 7, -2, -3, &[]),
            (div, 1 << 40, 1 << 20, 1 << 20, &[]),
            (div, 7, 0, 0, &[DivideByZero]),
            (div, 0, 0, 0, &[DivideByZero]),
            (div, MIN, 0, 0, &[DivideByZero]),
            (rem, 7, 2, 1, &[]),
            (rem, -7, 2, -1, &[]),
            (rem, 7, -2, 1, &[]),
            (rem, MIN, -1, 0, &[]),
            (rem, 7, 0, 0, &[DivideByZero]),
            (rem, -7, 0, 0, &[DivideByZero]),
        ]);
    }

    #[test]
    fn a_power_equals_repeated_multiplication() {
        check(&[
            (pow, 3, 4, 81, &[]),
            (pow, 0, 0, 1, &[]),
            (pow, 5, 0, 1, &[]),
            (pow, 0, 3, 0, &[]),
            (pow, -2, 63, MIN, &[]),
            (pow, 2, 63, MAX, &[Overflow]),
            (pow, -3, 40, MAX, &[Overflow]),
            (pow, -3, 41, MIN, &[Overflow]),
            (pow, -2, MAX, MIN, &[Overflow]),
            (pow, 1, MAX, 1, &[]),
            (pow, -1, MAX, -1, &[]),
            (pow, 2, -1, 0, &[OutOfRange]),
            (pow, 1, -1, 0, &[OutOfRange]),
            (pow, 0, -1, 0, &[DivideByZero]),
        ]);
    }

    #[test]
    fn bit_operators_use_the_low_32_bits_and_shift_by_at_most_31() {
        check(&[
            (and, 0xF_0000_000F, 0x0F0F, 0xF, &[]),
            (or, 0x8000_0000, 1, -0x7FFF_FFFF, &[]),
            (xor, -1, 0xFF, -256, &[]),
            (|a, _, m| complement(a, m), 1 << 40, 0, -1, &[]),
            (shift_left, 1, 31, i64::from(i32::MIN), &[]),
            (shift_left, 1, 32, 0, &[]),
            (shift_left, 1, -1, 0, &[]),
            (shift_left, 1, (1 << 32) + 1, 0, &[]),
            (shift_right, -8, 1, -4, &[]),
            (shift_right, -8, 32, -1, &[]),
            (shift_right, 8, -1, 0, &[]),
            (shift_right_zeros, -1, 28, 15, &[]),
            (shift_right_zeros, -1, 0, -1, &[]),
            (shift_right_zeros, -1, 32, 0, &[]),
        ]);
    }

    #[test]
    fn a_stored_integer_is_limited_to_the_range_of_its_target() {
        let mut mishaps = Mishaps::default();
        assert_eq!(within(65_535, 0, 65_535, &mut mishaps), 65_535);
        assert!(mishaps.is_empty());
        assert_eq!(within(-1, 0, 65_535, &mut mishaps), 0);
        assert!(mishaps.has(Overflow));
    }
}
