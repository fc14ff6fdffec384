//! The types of metrics, and their values.

use super::payload::MetricContent;
use rungd_base::variants::all_variants;

/// The types that rungd knows, with their numbers in the specification (6.4.16).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
#[repr(u32)]
pub enum DataType {
    Int8 = 1,
    Int16 = 2,
    Int32 = 3,
    Int64 = 4,
    UInt8 = 5,
    UInt16 = 6,
    UInt32 = 7,
    UInt64 = 8,
    Float = 9,
    Double = 10,
    Boolean = 11,
    String = 12,
    /// ms since 1970 (UTC).
    DateTime = 13,
    /// A text for people.
    Text = 14,
}

/// All types.
const ALL: [DataType; 14] = all_variants![
    DataType::Int8,
    DataType::Int16,
    DataType::Int32,
    DataType::Int64,
    DataType::UInt8,
    DataType::UInt16,
    DataType::UInt32,
    DataType::UInt64,
    DataType::Float,
    DataType::Double,
    DataType::Boolean,
    DataType::String,
    DataType::DateTime,
    DataType::Text,
];

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub enum MetricValue {
    /// A value of `Int8` to `Int64`.
    Signed(i64),
    /// A value of `UInt8` to `UInt64` or `DateTime`.
    Unsigned(u64),
    /// A value of `Float` or `Double`.
    Real(f64),
    /// A value of `Boolean`.
    Bool(bool),
    /// A value of `String` or `Text`.
    Text(String),
}

/// The reason why a value cannot be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueFault {
    /// The value is sent in the field of a different type.
    WrongField,
    /// The value is outside the range of its type.
    OutOfRange,
}

impl DataType {
    /// The type with this number; `None`: the number is unknown to the specification or to rungd.
    pub fn of(number: u32) -> Option<DataType> {
        ALL.into_iter().find(|datatype| datatype.number() == number)
    }

    /// Its number.
    pub const fn number(self) -> u32 {
        self as u32
    }

    /// Its name in the specification.
    pub const fn name(self) -> &'static str {
        match self {
            DataType::Int8 => "Int8",
            DataType::Int16 => "Int16",
            DataType::Int32 => "Int32",
            DataType::Int64 => "Int64",
            DataType::UInt8 => "UInt8",
            DataType::UInt16 => "UInt16",
            DataType::UInt32 => "UInt32",
            DataType::UInt64 => "UInt64",
            DataType::Float => "Float",
            DataType::Double => "Double",
            DataType::Boolean => "Boolean",
            DataType::String => "String",
            DataType::DateTime => "DateTime",
            DataType::Text => "Text",
        }
    }

    /// Reads a value of this type.
    ///
    /// # Errors
    /// [`ValueFault`].
    pub fn read(self, content: &MetricContent) -> Result<MetricValue, ValueFault> {
        use MetricContent as In;
        match (self, content) {
            // The bits are two's complement of 32 bits; some encoders truncate them to the type's
            // width.
            (DataType::Int8, In::Int(bits)) => signed(*bits, i8::MIN.into(), u8::MAX.into()),
            (DataType::Int16, In::Int(bits)) => signed(*bits, i16::MIN.into(), u16::MAX.into()),
            (DataType::Int32, In::Int(bits)) => signed(*bits, i32::MIN, u32::MAX),
            (DataType::Int64, In::Long(bits)) => Ok(MetricValue::Signed(*bits as i64)),
            (DataType::UInt8, In::Int(value)) => unsigned(*value, u8::MAX.into()),
            (DataType::UInt16, In::Int(value)) => unsigned(*value, u16::MAX.into()),
            // Some encoders send it as a 64-bit number.
            (DataType::UInt32, In::Int(value) | In::Long(value)) => unsigned(*value, u32::MAX),
            (DataType::UInt64 | DataType::DateTime, In::Long(value)) => {
                Ok(MetricValue::Unsigned(*value))
            }
            (DataType::Float, In::Float(value)) => Ok(MetricValue::Real((*value).into())),
            (DataType::Double, In::Double(value)) => Ok(MetricValue::Real(*value)),
            (DataType::Boolean, In::Boolean(value)) => Ok(MetricValue::Bool(*value)),
            (DataType::String | DataType::Text, In::Text(text)) => {
                Ok(MetricValue::Text(text.clone()))
            }
            (
                _,
                In::Int(_)
                | In::Long(_)
                | In::Float(_)
                | In::Double(_)
                | In::Boolean(_)
                | In::Text(_)
                | In::Bytes(_),
            ) => Err(ValueFault::WrongField),
        }
    }

    /// The content that is sent for a value; `None`: the value is not of this type.
    pub fn write(self, value: &MetricValue) -> Option<MetricContent> {
        let int = |low: i64, high: i64| match value {
            MetricValue::Signed(value) if (low..=high).contains(value) => {
                Some(MetricContent::Int(u64::from(*value as u32)))
            }
            MetricValue::Unsigned(value) if *value <= high as u64 => {
                Some(MetricContent::Int(*value))
            }
            MetricValue::Signed(_)
            | MetricValue::Unsigned(_)
            | MetricValue::Real(_)
            | MetricValue::Bool(_)
            | MetricValue::Text(_) => None,
        };
        match (self, value) {
            (DataType::Int8, _) => {
                int(i8::MIN.into(), i8::MAX.into()).map(|it| cut(it, u8::MAX.into()))
            }
            (DataType::Int16, _) => {
                int(i16::MIN.into(), i16::MAX.into()).map(|it| cut(it, u16::MAX.into()))
            }
            (DataType::Int32, _) => int(i32::MIN.into(), i32::MAX.into()),
            (DataType::UInt8, _) => int(0, u8::MAX.into()),
            (DataType::UInt16, _) => int(0, u16::MAX.into()),
            (DataType::UInt32, _) => int(0, u32::MAX.into()),
            (DataType::Int64, MetricValue::Signed(value)) => {
                Some(MetricContent::Long(*value as u64))
            }
            (DataType::UInt64 | DataType::DateTime, MetricValue::Unsigned(value)) => {
                Some(MetricContent::Long(*value))
            }
            (DataType::Float, MetricValue::Real(value)) => {
                Some(MetricContent::Float(*value as f32))
            }
            (DataType::Double, MetricValue::Real(value)) => Some(MetricContent::Double(*value)),
            (DataType::Boolean, MetricValue::Bool(value)) => Some(MetricContent::Boolean(*value)),
            (DataType::String | DataType::Text, MetricValue::Text(text)) => {
                Some(MetricContent::Text(text.clone()))
            }
            (
                DataType::Int64
                | DataType::UInt64
                | DataType::DateTime
                | DataType::Float
                | DataType::Double
                | DataType::Boolean
                | DataType::String
                | DataType::Text,
                _,
            ) => None,
        }
    }
}

/// Truncates a signed value of fewer than 32 bits to its own width: -1 of 16 bits is 65,535. A
/// library that checks the type's range would refuse 32 bits of ones.
fn cut(content: MetricContent, own_bits: u32) -> MetricContent {
    match content {
        MetricContent::Int(bits) => MetricContent::Int(bits & u64::from(own_bits)),
        MetricContent::Long(_)
        | MetricContent::Float(_)
        | MetricContent::Double(_)
        | MetricContent::Boolean(_)
        | MetricContent::Text(_)
        | MetricContent::Bytes(_) => content,
    }
}

/// Reads a signed value of up to 32 bits: two's complement of 32 bits, of 64 bits (the varint of a
/// negative `int32`), or of its own width.
fn signed(bits: u64, low: i32, own_bits: u32) -> Result<MetricValue, ValueFault> {
    let value = u32::try_from(bits).map_or(bits as i64, |bits| i64::from(bits as i32));
    let range = i64::from(low)..=-(i64::from(low) + 1);
    if range.contains(&value) {
        return Ok(MetricValue::Signed(value));
    }
    if bits <= own_bits.into() {
        return Ok(MetricValue::Signed(bits as i64 - i64::from(own_bits) - 1));
    }
    Err(ValueFault::OutOfRange)
}

fn unsigned(value: u64, high: u32) -> Result<MetricValue, ValueFault> {
    if value <= high.into() {
        Ok(MetricValue::Unsigned(value))
    } else {
        Err(ValueFault::OutOfRange)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A written value is read again unchanged, for the extremes of each type.
    #[test]
    fn a_written_value_is_read_back() {
        let signed = |datatype, low: i64, high: i64| {
            [low, -1, 0, 1, high].map(|value| (datatype, MetricValue::Signed(value)))
        };
        let unsigned = |datatype, high: u64| {
            [0, 1, high].map(|value| (datatype, MetricValue::Unsigned(value)))
        };
        let mut all = Vec::new();
        all.extend(signed(DataType::Int8, i8::MIN.into(), i8::MAX.into()));
        all.extend(signed(DataType::Int16, i16::MIN.into(), i16::MAX.into()));
        all.extend(signed(DataType::Int32, i32::MIN.into(), i32::MAX.into()));
        all.extend(signed(DataType::Int64, i64::MIN, i64::MAX));
        all.extend(unsigned(DataType::UInt8, u8::MAX.into()));
        all.extend(unsigned(DataType::UInt16, u16::MAX.into()));
        all.extend(unsigned(DataType::UInt32, u32::MAX.into()));
        all.extend(unsigned(DataType::UInt64, u64::MAX));
        all.extend(unsigned(DataType::DateTime, u64::MAX));
        all.push((DataType::Boolean, MetricValue::Bool(true)));
        all.push((DataType::Double, MetricValue::Real(0.1)));
        all.push((DataType::Float, MetricValue::Real(0.5)));
        all.push((DataType::String, MetricValue::Text("é".to_owned())));
        for (datatype, value) in all {
            let sent =
                datatype.write(&value).unwrap_or_else(|| panic!("{value:?} is no {datatype:?}"));
            assert_eq!(datatype.read(&sent), Ok(value), "{datatype:?}");
        }
    }

    #[test]
    fn a_short_negative_number_is_read_as_negative() {
        assert_eq!(DataType::Int16.read(&MetricContent::Int(65_535)), Ok(MetricValue::Signed(-1)));
        assert_eq!(DataType::Int16.read(&MetricContent::Int(65_536)), Err(ValueFault::OutOfRange));
        assert_eq!(DataType::Int8.read(&MetricContent::Int(128)), Ok(MetricValue::Signed(-128)));
        let long = MetricContent::Int(-5_i64 as u64);
        assert_eq!(DataType::Int32.read(&long), Ok(MetricValue::Signed(-5)));
    }

    /// 2^32 + 5 must not be read as 5.
    #[test]
    fn a_number_beyond_32_bits_is_refused_and_not_truncated() {
        let long = MetricContent::Int((1 << 32) + 5);
        for datatype in [DataType::Int32, DataType::Int16, DataType::UInt32, DataType::UInt16] {
            assert_eq!(datatype.read(&long), Err(ValueFault::OutOfRange), "{datatype:?}");
        }
        let below = MetricContent::Int((i64::from(i32::MIN) - 1) as u64);
        assert_eq!(DataType::Int32.read(&below), Err(ValueFault::OutOfRange));
    }

    #[test]
    fn a_short_negative_number_is_written_in_its_own_width() {
        let written = |datatype: DataType| datatype.write(&MetricValue::Signed(-1));
        assert_eq!(written(DataType::Int8), Some(MetricContent::Int(255)));
        assert_eq!(written(DataType::Int16), Some(MetricContent::Int(65_535)));
        assert_eq!(written(DataType::Int32), Some(MetricContent::Int(u32::MAX.into())));
    }

    #[test]
    fn a_value_beyond_its_type_is_not_written() {
        assert_eq!(DataType::Int16.write(&MetricValue::Signed(32_768)), None);
        assert_eq!(DataType::UInt8.write(&MetricValue::Signed(-1)), None);
        assert_eq!(DataType::Boolean.write(&MetricValue::Signed(1)), None);
    }

    #[test]
    fn each_type_is_found_by_its_number() {
        for datatype in ALL {
            assert_eq!(DataType::of(datatype.number()), Some(datatype));
        }
        assert_eq!(DataType::of(0), None);
        assert_eq!(DataType::of(15), None);
    }
}
