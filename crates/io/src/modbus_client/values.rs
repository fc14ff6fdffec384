//! Converts the bits of registers to values of memory, and back. No I/O.
//!
//! For an input, the number is scaled, and limited to the range of memory. For an output, the
//! value is scaled back, and limited to the range of the registers. `io::scaling` computes; this
//! file decides which numbers it computes with as reals. Half a number is 32 bits, neither scaled
//! nor limited.

use super::settings::{NumberPart, RegisterNumber};

/// The value of memory for a number's bits (the lower 16 for one register, 32 for two); `None`: a
/// real that is not a number.
pub fn decode(number: &RegisterNumber, bits: u64) -> Option<i32> {
    let RegisterNumber { kind, part, scaling, .. } = number;
    match part {
        NumberPart::Whole if kind.is_real() => Some(scaling.of_real(kind.number(bits)?)),
        NumberPart::Whole => Some(scaling.of_integer(kind.value(bits)?)),
        NumberPart::High => Some((bits >> 32) as i32),
        NumberPart::Low => Some(bits as i32),
    }
}

/// The bits of a number, or of its half, for a value of memory.
pub fn encode(number: &RegisterNumber, value: i32) -> u64 {
    let RegisterNumber { kind, part, scaling, .. } = number;
    match part {
        NumberPart::Whole if kind.is_real() => kind.nearest_bits(scaling.to_real(value)),
        NumberPart::Whole => kind.bits(scaling.to_integer(value)),
        NumberPart::High | NumberPart::Low => u64::from(value.cast_unsigned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modbus::number::{NumberOrder, RegisterNumberType};
    use crate::scaling::Scaling;
    use proptest::prelude::*;
    use rungd_engine::isa::Real;

    fn number(kind: RegisterNumberType, multiply: i32, divide: i32, offset: i32) -> RegisterNumber {
        let scaling = Scaling { real: false, multiply, divide, offset };
        RegisterNumber { kind, order: NumberOrder::default(), part: NumberPart::Whole, scaling }
    }

    fn plain(kind: RegisterNumberType) -> RegisterNumber {
        number(kind, 1, 1, 0)
    }

    #[test]
    fn register_bits_are_decoded_by_their_number_type() {
        let cases = [
            (RegisterNumberType::U16, 0xffff, 65_535),
            (RegisterNumberType::I16, 0xffff, -1),
            (RegisterNumberType::I16, 0x8000, -32_768),
            (RegisterNumberType::U32, 0x7fff_ffff, i32::MAX),
            (RegisterNumberType::I32, 0xffff_fffe, -2),
            (RegisterNumberType::F32, 12.0f32.to_bits().into(), 12),
            (RegisterNumberType::F32, (-2.5f32).to_bits().into(), -3),
        ];
        for (kind, bits, value) in cases {
            assert_eq!(decode(&plain(kind), bits), Some(value), "{kind:?} {bits:#x}");
        }
        assert_eq!(
            decode(&plain(RegisterNumberType::U32), u32::MAX.into()),
            Some(i32::MAX),
            "the nearest"
        );
        assert_eq!(
            decode(&plain(RegisterNumberType::F32), 1e30f32.to_bits().into()),
            Some(i32::MAX)
        );
        for bits in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(decode(&plain(RegisterNumberType::F32), bits.to_bits().into()), None);
        }
    }

    #[test]
    fn scaling_rounds_to_the_nearest_integer_and_half_away_from_zero() {
        // 4 to 20 mA as 0 to 27648, shown in tenths of a percent.
        let percent = number(RegisterNumberType::I16, 1000, 27_648, 0);
        assert_eq!(decode(&percent, 13_824), Some(500));
        assert_eq!(decode(&percent, 27_648), Some(1000));
        let halved = number(RegisterNumberType::I16, 1, 2, 0);
        assert_eq!(decode(&halved, 3), Some(2));
        assert_eq!(decode(&halved, -3i16 as u16 as u64), Some(-2));
        let kelvin = number(RegisterNumberType::U16, 1, 10, -273);
        assert_eq!(decode(&kelvin, 2931), Some(20));
        let turned = number(RegisterNumberType::I16, -1, 2, 0);
        assert_eq!(decode(&turned, 3), Some(-2));
    }

    #[test]
    fn outputs_are_scaled_back_and_limited_to_the_range_of_the_register() {
        let percent = number(RegisterNumberType::I16, 1000, 27_648, 0);
        assert_eq!(encode(&percent, 500), 13_824);
        assert_eq!(encode(&percent, 100_000), i16::MAX as u64);
        assert_eq!(encode(&percent, -100_000), 0x8000);
        let kelvin = number(RegisterNumberType::U16, 1, 10, -273);
        assert_eq!(encode(&kelvin, 20), 2930);
        assert_eq!(encode(&kelvin, -300), 0);
        assert_eq!(encode(&plain(RegisterNumberType::I16), -1), 0xffff);
        assert_eq!(encode(&plain(RegisterNumberType::U32), -1), 0);
        assert_eq!(encode(&plain(RegisterNumberType::I32), -1), u64::from(u32::MAX));
        assert_eq!(encode(&plain(RegisterNumberType::F32), 12), u64::from(12.0f32.to_bits()));
        let turned = number(RegisterNumberType::I16, -1, 2, 0);
        assert_eq!(encode(&turned, -2), 4);
    }

    #[test]
    fn an_r_word_holds_a_number_of_any_type_without_rounding_to_integers() {
        let into_real = |kind| RegisterNumber {
            scaling: Scaling { divide: 10, ..Scaling::none(true) },
            ..plain(kind)
        };
        let real = |text: &str| text.parse::<Real>().unwrap().cell();
        for (kind, bits, text) in [
            (RegisterNumberType::U16, 0xffff, "6553.5"),
            (RegisterNumberType::I16, 0xffff, "-0.1"),
            (RegisterNumberType::U32, u32::MAX.into(), "429496729.5"),
            (RegisterNumberType::I32, 0x8000_0000, "-214748364.8"),
            (RegisterNumberType::F32, 2.5f32.to_bits().into(), "0.25"),
        ] {
            assert_eq!(decode(&into_real(kind), bits), Some(real(text)), "{kind:?}");
        }
        assert_eq!(encode(&into_real(RegisterNumberType::I16), real("-0.1")), 0xffff);
        assert_eq!(encode(&into_real(RegisterNumberType::U16), real("-0.1")), 0);
        assert_eq!(encode(&into_real(RegisterNumberType::U16), real("1e30")), 0xffff);
        assert_eq!(
            encode(&into_real(RegisterNumberType::F32), real("1e38")),
            u64::from(f32::MAX.to_bits())
        );
        for bits in [f32::NAN, f32::INFINITY] {
            assert_eq!(decode(&into_real(RegisterNumberType::F32), bits.to_bits().into()), None);
        }
    }

    #[test]
    fn a_number_of_64_bits_is_scaled_before_it_is_limited() {
        let wh = number(RegisterNumberType::U64, 1, 1000, 0);
        assert_eq!(decode(&wh, 8_150_091_776), Some(8_150_092));
        assert_eq!(decode(&wh, u64::MAX), Some(i32::MAX), "the nearest");
        let (u64s, i64s) = (plain(RegisterNumberType::U64), plain(RegisterNumberType::I64));
        assert_eq!(decode(&u64s, i32::MAX as u64 + 1), Some(i32::MAX));
        assert_eq!(decode(&i64s, i64::MIN as u64), Some(i32::MIN));
        assert_eq!(decode(&i64s, -2i64 as u64), Some(-2));
        assert_eq!((encode(&i64s, -2), encode(&u64s, -2)), (-2i64 as u64, 0));
        assert_eq!(encode(&wh, 8_150_092), 8_150_092_000);
        let reals = plain(RegisterNumberType::F64);
        assert_eq!(decode(&reals, (-2.5f64).to_bits()), Some(-3));
        assert_eq!(decode(&reals, 1e300f64.to_bits()), Some(i32::MAX));
        assert_eq!(encode(&reals, 12), 12.0f64.to_bits());
        for bits in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(decode(&reals, bits.to_bits()), None);
        }
    }

    #[test]
    fn an_r_word_holds_a_64_bit_number_as_the_nearest_real() {
        let into_real = |kind| RegisterNumber { scaling: Scaling::none(true), ..plain(kind) };
        let real = |text: &str| text.parse::<Real>().unwrap().cell();
        let largest = into_real(RegisterNumberType::U64);
        assert_eq!(decode(&largest, u64::MAX), Some(real("18446744073709551615.0")));
        let reals = into_real(RegisterNumberType::F64);
        assert_eq!(decode(&reals, 0.1f64.to_bits()), Some(real("0.1")));
        assert_eq!(decode(&reals, 1e300f64.to_bits()), Some(f32::MAX.to_bits().cast_signed()));
        assert_eq!(encode(&reals, real("0.5")), 0.5f64.to_bits());
        let tera = RegisterNumber {
            scaling: Scaling { multiply: 1_000_000, ..Scaling::none(true) },
            ..reals
        };
        assert_eq!(decode(&tera, f64::MAX.to_bits()), Some(f32::MAX.to_bits().cast_signed()));
    }

    #[test]
    fn the_halves_of_a_64_bit_number_keep_their_bits() {
        let half = |part| RegisterNumber { part, ..plain(RegisterNumberType::U64) };
        let (high, low) = (half(NumberPart::High), half(NumberPart::Low));
        assert_eq!(decode(&high, 0xffff_fffe_8000_0001), Some(-2));
        assert_eq!(decode(&low, 0xffff_fffe_8000_0001), Some(0x8000_0001u32.cast_signed()));
        assert_eq!((encode(&high, -2), encode(&low, -2)), (0xffff_fffe, 0xffff_fffe));
    }

    fn kinds() -> impl Strategy<Value = RegisterNumberType> {
        prop::sample::select(RegisterNumberType::NAMES.map(|(_, kind)| kind).to_vec())
    }

    fn scalings() -> impl Strategy<Value = Scaling> {
        let multiply = prop_oneof![-1_000_000i32..=-1, 1i32..=1_000_000];
        let scaling =
            |(multiply, divide, offset)| Scaling { real: false, multiply, divide, offset };
        (multiply, 1i32..=1_000_000, any::<i32>()).prop_map(scaling)
    }

    proptest! {
        #[test]
        fn decoding_and_encoding_never_overflow(
            kind in kinds(), bits in any::<u64>(), value in any::<i32>(), scaling in scalings(),
        ) {
            let number = RegisterNumber { scaling, ..plain(kind) };
            let _ = (decode(&number, bits), encode(&number, value));
        }

        #[test]
        fn encoding_and_decoding_give_the_same_value(
            kind in kinds(),
            value in -32_768i32..=32_767,
        ) {
            let number = plain(kind);
            let held = match kind {
                RegisterNumberType::U16 | RegisterNumberType::U32 | RegisterNumberType::U64 => {
                    value.max(0)
                }
                RegisterNumberType::I16
                | RegisterNumberType::I32
                | RegisterNumberType::I64
                | RegisterNumberType::F32
                | RegisterNumberType::F64 => value,
            };
            prop_assert_eq!(decode(&number, encode(&number, value)), Some(held));
        }
    }
}
