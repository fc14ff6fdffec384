//! Numbers in registers: their types, and the orders of registers and of their bytes. No I/O.
//!
//! Used by both ends of Modbus: by the server for the words of its map, by the clients for the
//! registers of a peer. Numbers are not scaled here: the clients do that (`modbus_client::values`).
//! A word of memory never has 64 bits, so the server uses only the types of
//! [`RegisterNumberType::NARROW`].

use rungd_base::variants::all_variants;
use rungd_engine::isa::{Real, Structure, Word, WordSpace};

/// The type of the number in one, two or four registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum RegisterNumberType {
    U16,
    I16,
    U32,
    I32,
    F32,
    U64,
    I64,
    F64,
}

/// The order of the registers of a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WordOrder {
    /// The first register has the highest 16 bits.
    #[default]
    HighFirst,
    /// The first register has the lowest 16 bits.
    LowFirst,
}

/// The order of the two bytes in each register. Modbus has the high byte first; some devices swap
/// them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum ByteOrder {
    #[default]
    HighFirst,
    LowFirst,
}

/// The order of all bytes of a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NumberOrder {
    /// The order of its registers.
    pub words: WordOrder,
    /// The order of the bytes in each register.
    pub bytes: ByteOrder,
}

impl RegisterNumberType {
    /// All types with their names; those of a word of memory first.
    pub const NAMES: [(&'static str, RegisterNumberType); 8] = all_variants![
        ("u16", RegisterNumberType::U16),
        ("i16", RegisterNumberType::I16),
        ("u32", RegisterNumberType::U32),
        ("i32", RegisterNumberType::I32),
        ("f32", RegisterNumberType::F32),
        ("u64", RegisterNumberType::U64),
        ("i64", RegisterNumberType::I64),
        ("f64", RegisterNumberType::F64),
    ];

    /// The types that the server has: those of one or two registers.
    pub const NARROW: &'static [(&'static str, RegisterNumberType)] = Self::NAMES.split_at(5).0;

    /// The type that holds every value of a word.
    pub fn of(word: Word) -> RegisterNumberType {
        match word {
            Word::Space(WordSpace::V | WordSpace::Mhr | WordSpace::Mir, _) => {
                RegisterNumberType::U16
            }
            Word::Acc(Structure::Sensaphone(_)) | Word::Pre(_) => RegisterNumberType::I16,
            Word::Space(WordSpace::D | WordSpace::Dst, _) | Word::Acc(_) => RegisterNumberType::I32,
            Word::Space(WordSpace::R, _) => RegisterNumberType::F32,
        }
    }

    /// The number of its registers: 1, 2 or 4.
    pub fn registers(self) -> u16 {
        match self {
            RegisterNumberType::U16 | RegisterNumberType::I16 => 1,
            RegisterNumberType::U32 | RegisterNumberType::I32 | RegisterNumberType::F32 => 2,
            RegisterNumberType::U64 | RegisterNumberType::I64 | RegisterNumberType::F64 => 4,
        }
    }

    /// Whether it is a binary32 or binary64; else an integer.
    pub(crate) fn is_real(self) -> bool {
        match self {
            RegisterNumberType::F32 | RegisterNumberType::F64 => true,
            RegisterNumberType::U16
            | RegisterNumberType::I16
            | RegisterNumberType::U32
            | RegisterNumberType::I32
            | RegisterNumberType::U64
            | RegisterNumberType::I64 => false,
        }
    }

    /// The least and the greatest integer that the registers hold; for a real, the range of memory.
    pub(crate) fn range(self) -> (i128, i128) {
        match self {
            RegisterNumberType::U16 => (0, u16::MAX.into()),
            RegisterNumberType::I16 => (i16::MIN.into(), i16::MAX.into()),
            RegisterNumberType::U32 => (0, u32::MAX.into()),
            RegisterNumberType::I32 | RegisterNumberType::F32 | RegisterNumberType::F64 => {
                (i32::MIN.into(), i32::MAX.into())
            }
            RegisterNumberType::U64 => (0, u64::MAX.into()),
            RegisterNumberType::I64 => (i64::MIN.into(), i64::MAX.into()),
        }
    }

    /// The integer of these bits (of the lower 16 for one register, 32 for two); a real is rounded.
    /// `None`: a real that is not a number.
    pub(crate) fn value(self, bits: u64) -> Option<i128> {
        Some(match self {
            RegisterNumberType::U16 => (bits as u16).into(),
            RegisterNumberType::I16 => (bits as u16 as i16).into(),
            RegisterNumberType::U32 => (bits as u32).into(),
            RegisterNumberType::I32 => (bits as u32 as i32).into(),
            RegisterNumberType::U64 => bits.into(),
            RegisterNumberType::I64 => (bits as i64).into(),
            RegisterNumberType::F32 | RegisterNumberType::F64 => {
                return Some(self.number(bits)?.round() as i128);
            }
        })
    }

    /// The number of these bits, as text.
    pub fn text(self, bits: u64) -> String {
        match self {
            RegisterNumberType::F32 => format!("{:?}", f32::from_bits(bits as u32)),
            RegisterNumberType::F64 => format!("{:?}", f64::from_bits(bits)),
            RegisterNumberType::U16 => (bits as u16).to_string(),
            RegisterNumberType::I16 => (bits as u16 as i16).to_string(),
            RegisterNumberType::U32 => (bits as u32).to_string(),
            RegisterNumberType::I32 => (bits as u32).cast_signed().to_string(),
            RegisterNumberType::U64 => bits.to_string(),
            RegisterNumberType::I64 => bits.cast_signed().to_string(),
        }
    }

    /// The number of these bits, exactly, or as the nearest binary64 for an integer of 64 bits.
    /// `None`: a real that is not a number.
    pub fn number(self, bits: u64) -> Option<f64> {
        match self {
            RegisterNumberType::F32 => Real::finite(f32::from_bits(bits as u32)).map(f64::from),
            // Not -0, like every real of memory.
            RegisterNumberType::F64 => {
                Some(f64::from_bits(bits) + 0.0).filter(|number| number.is_finite())
            }
            RegisterNumberType::U16
            | RegisterNumberType::I16
            | RegisterNumberType::U32
            | RegisterNumberType::I32
            | RegisterNumberType::U64
            | RegisterNumberType::I64 => self.value(bits).map(|value| value as f64),
        }
    }

    /// The bits of the nearest number that the registers hold; for an integer, halves are rounded
    /// away from zero.
    pub fn nearest_bits(self, number: f64) -> u64 {
        match self {
            RegisterNumberType::F32 => Real::stored(number).real.number().to_bits().into(),
            RegisterNumberType::F64 => (number + 0.0).to_bits(),
            RegisterNumberType::U16
            | RegisterNumberType::I16
            | RegisterNumberType::U32
            | RegisterNumberType::I32
            | RegisterNumberType::U64
            | RegisterNumberType::I64 => self.bits(number.round() as i128),
        }
    }

    /// The bits of an integer, or of the nearest integer that the registers hold.
    pub(crate) fn bits(self, value: i128) -> u64 {
        let (min, max) = self.range();
        let value = value.clamp(min, max);
        match self {
            RegisterNumberType::U16 | RegisterNumberType::I16 => (value as u16).into(),
            RegisterNumberType::U32 | RegisterNumberType::I32 => (value as u32).into(),
            RegisterNumberType::U64 | RegisterNumberType::I64 => value as u64,
            RegisterNumberType::F32 => (value as f32).to_bits().into(),
            RegisterNumberType::F64 => (value as f64).to_bits(),
        }
    }
}

impl WordOrder {
    /// Both orders with their names.
    pub const NAMES: [(&'static str, WordOrder); 2] =
        all_variants![("high-first", WordOrder::HighFirst), ("low-first", WordOrder::LowFirst)];

    /// The bits of two registers.
    pub(crate) fn join(self, first: u16, second: u16) -> u32 {
        let (high, low) = match self {
            WordOrder::HighFirst => (first, second),
            WordOrder::LowFirst => (second, first),
        };
        u32::from(high) << 16 | u32::from(low)
    }

    /// The two registers of these bits.
    pub(crate) fn split(self, bits: u32) -> [u16; 2] {
        let (high, low) = ((bits >> 16) as u16, bits as u16);
        match self {
            WordOrder::HighFirst => [high, low],
            WordOrder::LowFirst => [low, high],
        }
    }
}

impl ByteOrder {
    /// Both orders with their names.
    pub const NAMES: [(&'static str, ByteOrder); 2] =
        all_variants![("high-first", ByteOrder::HighFirst), ("low-first", ByteOrder::LowFirst)];
}

impl NumberOrder {
    /// The bits of one to four registers, whose bytes these are.
    pub(crate) fn join(self, bytes: &[u8]) -> u64 {
        let registers = bytes.chunks_exact(2).map(|pair| match self.bytes {
            ByteOrder::HighFirst => u64::from(pair[0]) << 8 | u64::from(pair[1]),
            ByteOrder::LowFirst => u64::from(pair[1]) << 8 | u64::from(pair[0]),
        });
        let join = |bits, register| bits << 16 | register;
        match self.words {
            WordOrder::HighFirst => registers.fold(0, join),
            WordOrder::LowFirst => registers.rev().fold(0, join),
        }
    }

    /// Sets all of a number's registers to these bits.
    pub(crate) fn split(self, bits: u64, registers: &mut [u16]) {
        let last = registers.len().saturating_sub(1);
        for (at, register) in registers.iter_mut().enumerate() {
            let place = match self.words {
                WordOrder::HighFirst => last - at,
                WordOrder::LowFirst => at,
            };
            let content = (bits >> (16 * place)) as u16;
            *register = match self.bytes {
                ByteOrder::HighFirst => content,
                ByteOrder::LowFirst => content.swap_bytes(),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn orders() -> [NumberOrder; 4] {
        [WordOrder::HighFirst, WordOrder::LowFirst]
            .into_iter()
            .flat_map(|words| {
                [ByteOrder::HighFirst, ByteOrder::LowFirst]
                    .map(|bytes| NumberOrder { words, bytes })
            })
            .collect::<Vec<_>>()
            .try_into()
            .unwrap()
    }

    /// The letters of manuals: A is the highest byte of the number.
    #[test]
    fn byte_orders_equal_the_letter_notation_of_manuals() {
        let eight = [["ABCDEFGH", "BADCFEHG"], ["GHEFCDAB", "HGFEDCBA"]].concat();
        let four = [["ABCD", "BADC"], ["CDAB", "DCBA"]].concat();
        let two = [["AB", "BA"], ["AB", "BA"]].concat();
        for letters in [eight, four, two] {
            let highest = letters[0].as_bytes();
            let bits = highest.iter().fold(0, |bits, byte| bits << 8 | u64::from(*byte));
            for (order, letters) in orders().into_iter().zip(letters) {
                assert_eq!(order.join(letters.as_bytes()), bits, "{letters}");
                let mut registers = vec![0; letters.len() / 2];
                order.split(bits, &mut registers);
                let bytes: Vec<u8> = registers.iter().flat_map(|r| r.to_be_bytes()).collect();
                assert_eq!(bytes, letters.as_bytes(), "{letters}");
            }
        }
    }

    #[test]
    fn every_number_type_holds_its_minimum_and_maximum() {
        for (name, kind) in
            RegisterNumberType::NAMES.into_iter().filter(|(_, kind)| !kind.is_real())
        {
            let (min, max) = kind.range();
            for (value, held) in [(min, min), (max, max), (min - 1, min), (max + 1, max)] {
                assert_eq!(kind.value(kind.bits(value)), Some(held), "{name}");
            }
            assert_eq!(kind.text(kind.bits(max)), max.to_string());
        }
        assert_eq!(RegisterNumberType::F64.number(f64::INFINITY.to_bits()), None);
        assert_eq!(RegisterNumberType::F64.number((-0.0f64).to_bits()).map(f64::to_bits), Some(0));
        assert_eq!(RegisterNumberType::F64.value(2.5f64.to_bits()), Some(3));
        assert_eq!(RegisterNumberType::F64.text(2.5f64.to_bits()), "2.5");
    }

    proptest! {
        #[test]
        fn a_split_number_joins_to_the_same_number(
            bits: u64, registers in prop::sample::select(vec![1u32, 2, 4]),
        ) {
            let bits = bits >> (64 - 16 * registers);
            for order in orders() {
                let mut split = vec![0; registers as usize];
                order.split(bits, &mut split);
                let bytes: Vec<u8> = split.iter().flat_map(|r| r.to_be_bytes()).collect();
                prop_assert_eq!(order.join(&bytes), bits);
            }
        }
    }
}
