//! Numbers in registers: their types, and the order of two registers. No I/O.
//!
//! Used by both ends of Modbus: by the server for the words of its map, by the clients for the
//! registers of a peer. Numbers are not scaled here: the clients do that (`modbus_client::values`).

use crate::isa::{Real, Structure, Word, WordSpace};
use crate::variants::all_variants;

/// The type of the number in a register or a pair of registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum NumberType {
    U16,
    I16,
    U32,
    I32,
    F32,
}

/// The order of the two registers of a number with 32 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WordOrder {
    /// The first register has the higher 16 bits.
    #[default]
    HighFirst,
    /// The first register has the lower 16 bits.
    LowFirst,
}

impl NumberType {
    /// All types with their names; the integers first.
    pub(crate) const NAMES: [(&'static str, NumberType); 5] = all_variants![
        ("u16", NumberType::U16),
        ("i16", NumberType::I16),
        ("u32", NumberType::U32),
        ("i32", NumberType::I32),
        ("f32", NumberType::F32),
    ];

    /// The type that holds every value of a word.
    pub(crate) fn of(word: Word) -> NumberType {
        match word {
            Word::Space(WordSpace::V | WordSpace::Mhr | WordSpace::Mir, _) => NumberType::U16,
            Word::Acc(Structure::Sensaphone(_)) | Word::Pre(_) => NumberType::I16,
            Word::Space(WordSpace::D | WordSpace::Dst, _) | Word::Acc(_) => NumberType::I32,
            Word::Space(WordSpace::R, _) => NumberType::F32,
        }
    }

    /// The number of its registers, 1 or 2.
    pub(crate) fn registers(self) -> u16 {
        match self {
            NumberType::U16 | NumberType::I16 => 1,
            NumberType::U32 | NumberType::I32 | NumberType::F32 => 2,
        }
    }

    /// The least and the greatest integer that the registers hold; for an f32, the range of memory.
    pub(crate) fn range(self) -> (i64, i64) {
        match self {
            NumberType::U16 => (0, u16::MAX.into()),
            NumberType::I16 => (i16::MIN.into(), i16::MAX.into()),
            NumberType::U32 => (0, u32::MAX.into()),
            NumberType::I32 | NumberType::F32 => (i32::MIN.into(), i32::MAX.into()),
        }
    }

    /// The integer of these bits (of the lower 16 for one register); an f32 is rounded. `None`: an
    /// f32 that is not a number.
    pub(crate) fn value(self, bits: u32) -> Option<i64> {
        Some(match self {
            NumberType::U16 => i64::from(bits as u16),
            NumberType::I16 => i64::from(bits as u16 as i16),
            NumberType::U32 => i64::from(bits),
            NumberType::I32 => i64::from(bits as i32),
            NumberType::F32 => {
                let number = f32::from_bits(bits);
                return number.is_finite().then(|| number.round() as i64);
            }
        })
    }

    /// The number of these bits, as text.
    pub fn text(self, bits: u32) -> String {
        match self {
            NumberType::F32 => format!("{:?}", f32::from_bits(bits)),
            NumberType::U16 => (bits as u16).to_string(),
            NumberType::I16 => (bits as u16 as i16).to_string(),
            NumberType::U32 => bits.to_string(),
            NumberType::I32 => bits.cast_signed().to_string(),
        }
    }

    /// The number of these bits, exactly. `None`: an f32 that is not a number.
    pub fn number(self, bits: u32) -> Option<f64> {
        match self {
            NumberType::F32 => Real::finite(f32::from_bits(bits)).map(f64::from),
            NumberType::U16 | NumberType::I16 | NumberType::U32 | NumberType::I32 => {
                self.value(bits).map(|value| value as f64)
            }
        }
    }

    /// The bits of the nearest number that the registers hold; for an integer, halves are rounded
    /// away from zero.
    pub fn nearest_bits(self, number: f64) -> u32 {
        match self {
            NumberType::F32 => Real::stored(number).real.number().to_bits(),
            NumberType::U16 | NumberType::I16 | NumberType::U32 | NumberType::I32 => {
                self.bits(number.round() as i64)
            }
        }
    }

    /// The bits of an integer, or of the nearest integer that the registers hold.
    pub(crate) fn bits(self, value: i64) -> u32 {
        let (min, max) = self.range();
        let value = value.clamp(min, max);
        match self {
            NumberType::U16 | NumberType::I16 => u32::from(value as u16),
            NumberType::U32 | NumberType::I32 => value as u32,
            NumberType::F32 => (value as f32).to_bits(),
        }
    }
}

impl WordOrder {
    /// Both orders with their names.
    pub(crate) const NAMES: [(&'static str, WordOrder); 2] =
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
