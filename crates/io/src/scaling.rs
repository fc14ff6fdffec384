//! Scaling: the straight line from the numbers of a field device to the values of memory.
//!
//! `controller` makes a scaling from a row's `multiply`, `divide` and `offset`; `modbus_client`
//! and `plant` use it. This module does not depend on registers or points. Integers are computed
//! without overflow: they have at most 64 bits, and the reader of the controller file limits the
//! factors. An R word is scaled in binary64, without rounding to an integer.

use rungd_engine::isa::Real;

/// The scaling of one row: a value of memory is the device's number times `multiply`, divided by
/// `divide`, plus `offset`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scaling {
    /// Whether memory holds a real; else an integer.
    pub real: bool,
    /// Never 0.
    pub multiply: i32,
    /// At least 1.
    pub divide: i32,
    /// Any number.
    pub offset: i32,
}

impl Scaling {
    /// The scaling that changes no number.
    pub fn none(real: bool) -> Scaling {
        Scaling { real, multiply: 1, divide: 1, offset: 0 }
    }

    /// The content of memory for an integer of the device: the nearest value that memory holds.
    pub fn of_integer(self, number: i128) -> i32 {
        if self.real {
            return self.of_real(number as f64);
        }
        let scaled = nearest(number * i128::from(self.multiply), i128::from(self.divide));
        (scaled + i128::from(self.offset)).clamp(i32::MIN.into(), i32::MAX.into()) as i32
    }

    /// The content of memory for a real of the device. The number must be finite.
    pub fn of_real(self, number: f64) -> i32 {
        let scaled = number * f64::from(self.multiply) / f64::from(self.divide);
        let scaled = scaled + f64::from(self.offset);
        // For a number beyond an i32, `as` returns the nearest i32.
        if self.real { Real::stored(scaled).real.cell() } else { scaled.round() as i32 }
    }

    /// The device's number for a content of memory, rounded to the nearest integer; halves are
    /// rounded away from zero.
    pub fn to_integer(self, content: i32) -> i128 {
        if self.real {
            return self.to_real(content).round() as i128;
        }
        let apart = i128::from(content) - i128::from(self.offset);
        nearest(apart * i128::from(self.divide), i128::from(self.multiply))
    }

    /// The device's number for a content of memory.
    pub fn to_real(self, content: i32) -> f64 {
        let value = if self.real { Real::of_cell(content).into() } else { f64::from(content) };
        (value - f64::from(self.offset)) * f64::from(self.divide) / f64::from(self.multiply)
    }
}

/// A quotient rounded to the nearest integer; halves are rounded away from zero. The divisor is
/// never 0.
fn nearest(dividend: i128, divisor: i128) -> i128 {
    let (quotient, rest) = (dividend / divisor, dividend % divisor);
    let away = (rest.abs() * 2 >= divisor.abs()) as i128;
    quotient + away * dividend.signum() * divisor.signum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn into_reals(multiply: i32, divide: i32, offset: i32) -> Scaling {
        Scaling { multiply, divide, offset, ..Scaling::none(true) }
    }

    fn real(text: &str) -> i32 {
        text.parse::<Real>().unwrap().cell()
    }

    #[test]
    fn an_r_word_keeps_fractions_in_both_directions() {
        let percent = into_reals(100, 27_648, 0);
        assert_eq!(percent.of_integer(13_824), real("50.0"));
        assert_eq!(percent.of_integer(1), real("0.0036168981"));
        assert_eq!(percent.to_integer(real("50.0")), 13_824);
        let celsius = into_reals(1, 10, -273);
        assert_eq!(celsius.of_integer(2931), real("20.1"));
        assert_eq!(celsius.to_integer(real("20.1")), 2931);
        assert_eq!(celsius.to_integer(real("20.14")), 2931, "the nearest");
        assert_eq!(into_reals(1, 2, 0).to_integer(real("-1.25")), -3, "halves away from zero");
    }

    #[test]
    fn an_r_word_stays_within_its_range_and_is_never_negative_zero() {
        let thousand = into_reals(1000, 1, 0);
        assert_eq!(thousand.of_real(f32::MAX.into()), Real::MAX.cell());
        assert_eq!(thousand.of_real(f32::MIN.into()), Real::MIN.cell());
        assert_eq!(Scaling::none(true).of_real(-0.0), 0);
        assert_eq!(into_reals(-1, 1, 0).of_integer(0), 0);
        assert_eq!(Scaling::none(true).to_integer(Real::MAX.cell()), f32::MAX as i128);
    }

    proptest! {
        #[test]
        fn an_r_word_keeps_every_f32(bits: u32) {
            let number = f32::from_bits(bits);
            prop_assume!(number.is_finite());
            let content = Scaling::none(true).of_real(number.into());
            prop_assert_eq!(Scaling::none(true).to_real(content), f64::from(number));
        }
    }
}
