//! Converts the bits of one or two registers to a value in memory, and back.
//!
//! In: the number times `multiply`, divided by `divide` (rounded to the nearest, halves away from
//! zero), plus `offset`; beyond an i32, the nearest i32. Out: the same in reverse, to the nearest
//! value that the registers hold. Integers are computed in 64 bits without overflow, because the
//! reader of the controller file limits the factors. An R word is scaled in binary64, without
//! rounding to an integer.

use super::settings::Number;
use crate::io::modbus::number::NumberType;
use crate::isa::Real;

/// The value in memory of a number's bits (the lower 16 for one register); `None`: an f32 that is
/// not a number.
pub fn decode(number: &Number, bits: u32) -> Option<i32> {
    let (multiply, divide, offset) = (number.multiply, number.divide, number.offset);
    if number.real {
        let raw = number.kind.number(bits)?;
        let scaled = raw * f64::from(multiply) / f64::from(divide) + f64::from(offset);
        return Some(Real::stored(scaled).0.cell());
    }
    if number.kind == NumberType::F32 {
        // Scaled before rounding.
        let raw = f64::from(f32::from_bits(bits));
        let scaled = raw * f64::from(multiply) / f64::from(divide) + f64::from(offset);
        // Beyond an i32, `as` gives the nearest i32.
        return raw.is_finite().then(|| scaled.round() as i32);
    }
    let raw = number.kind.value(bits)?;
    let scaled = nearest(raw * i64::from(multiply), i64::from(divide)) + i64::from(offset);
    Some(scaled.clamp(i32::MIN.into(), i32::MAX.into()) as i32)
}

/// The bits of a number for a value in memory.
pub fn encode(number: &Number, value: i32) -> u32 {
    let (multiply, divide) = (number.multiply, number.divide);
    if number.real {
        let apart = f64::from(Real::of_cell(value)) - f64::from(number.offset);
        return number.kind.nearest_bits(apart * f64::from(divide) / f64::from(multiply));
    }
    if number.kind == NumberType::F32 {
        let apart = f64::from(value) - f64::from(number.offset);
        return ((apart * f64::from(divide) / f64::from(multiply)) as f32).to_bits();
    }
    let apart = i64::from(value) - i64::from(number.offset);
    number.kind.bits(nearest(apart * i64::from(divide), i64::from(multiply)))
}

/// A quotient rounded to the nearest, halves away from zero. The divisor is never 0.
fn nearest(dividend: i64, divisor: i64) -> i64 {
    let (quotient, rest) = (dividend / divisor, dividend % divisor);
    let away = (rest.abs() * 2 >= divisor.abs()) as i64;
    quotient + away * dividend.signum() * divisor.signum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::modbus::number::WordOrder;
    use proptest::prelude::*;

    fn number(kind: NumberType, multiply: i32, divide: i32, offset: i32) -> Number {
        Number { kind, order: WordOrder::HighFirst, real: false, multiply, divide, offset }
    }

    fn plain(kind: NumberType) -> Number {
        number(kind, 1, 1, 0)
    }

    #[test]
    fn bits_are_what_their_type_says() {
        let cases = [
            (NumberType::U16, 0xffff, 65_535),
            (NumberType::I16, 0xffff, -1),
            (NumberType::I16, 0x8000, -32_768),
            (NumberType::U32, 0x7fff_ffff, i32::MAX),
            (NumberType::I32, 0xffff_fffe, -2),
            (NumberType::F32, 12.0f32.to_bits(), 12),
            (NumberType::F32, (-2.5f32).to_bits(), -3),
        ];
        for (kind, bits, value) in cases {
            assert_eq!(decode(&plain(kind), bits), Some(value), "{kind:?} {bits:#x}");
        }
        assert_eq!(decode(&plain(NumberType::U32), u32::MAX), Some(i32::MAX), "the nearest");
        assert_eq!(decode(&plain(NumberType::F32), 1e30f32.to_bits()), Some(i32::MAX));
        for bits in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(decode(&plain(NumberType::F32), bits.to_bits()), None);
        }
    }

    #[test]
    fn scaling_rounds_to_the_nearest_and_halves_away_from_zero() {
        // 4 to 20 mA as 0 to 27648, shown in tenths of a percent.
        let percent = number(NumberType::I16, 1000, 27_648, 0);
        assert_eq!(decode(&percent, 13_824), Some(500));
        assert_eq!(decode(&percent, 27_648), Some(1000));
        let halved = number(NumberType::I16, 1, 2, 0);
        assert_eq!(decode(&halved, 3), Some(2));
        assert_eq!(decode(&halved, -3i16 as u16 as u32), Some(-2));
        let kelvin = number(NumberType::U16, 1, 10, -273);
        assert_eq!(decode(&kelvin, 2931), Some(20));
        let turned = number(NumberType::I16, -1, 2, 0);
        assert_eq!(decode(&turned, 3), Some(-2));
    }

    #[test]
    fn outputs_go_the_way_back_and_stop_at_the_registers_end() {
        let percent = number(NumberType::I16, 1000, 27_648, 0);
        assert_eq!(encode(&percent, 500), 13_824);
        assert_eq!(encode(&percent, 100_000), i16::MAX as u32);
        assert_eq!(encode(&percent, -100_000), 0x8000);
        let kelvin = number(NumberType::U16, 1, 10, -273);
        assert_eq!(encode(&kelvin, 20), 2930);
        assert_eq!(encode(&kelvin, -300), 0);
        assert_eq!(encode(&plain(NumberType::I16), -1), 0xffff);
        assert_eq!(encode(&plain(NumberType::U32), -1), 0);
        assert_eq!(encode(&plain(NumberType::I32), -1), u32::MAX);
        assert_eq!(encode(&plain(NumberType::F32), 12), 12.0f32.to_bits());
        let turned = number(NumberType::I16, -1, 2, 0);
        assert_eq!(encode(&turned, -2), 4);
    }

    fn kinds() -> impl Strategy<Value = NumberType> {
        prop::sample::select(vec![
            NumberType::U16,
            NumberType::I16,
            NumberType::U32,
            NumberType::I32,
            NumberType::F32,
        ])
    }

    proptest! {
        #[test]
        fn nothing_overflows(
            kind in kinds(), bits: u32, value: i32, offset: i32,
            multiply in prop_oneof![-1_000_000..=-1, 1..=1_000_000], divide in 1..=1_000_000,
        ) {
            let number = number(kind, multiply, divide, offset);
            let _ = (decode(&number, bits), encode(&number, value));
        }

        #[test]
        fn there_and_back_is_the_same(kind in kinds(), value in -32_768i32..=32_767) {
            let number = plain(kind);
            let held = match kind {
                NumberType::U16 | NumberType::U32 => value.max(0),
                NumberType::I16 | NumberType::I32 | NumberType::F32 => value,
            };
            prop_assert_eq!(decode(&number, encode(&number, value)), Some(held));
        }
    }
}
