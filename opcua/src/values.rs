//! Contents of cells as values of OPC UA, and values of clients as values of operators.

use opcua::types::{
    Array, DataTypeId, DataValue, DateTime, NodeId, StatusCode, Variant, VariantScalarTypeId,
};
use rungd_client::live::TagType;
use rungd_client::operator::protocol::{GivenValue, RefusalKind};
use rungd_engine::isa::Real;

/// The ticks of OPC UA (100 ns since 1601) at the beginning of 1970.
const UNIX_TICKS: i64 = 116_444_736_000_000_000;

/// A time, of ns since 1970 (UTC).
pub fn time(unix_ns: i64) -> DateTime {
    DateTime::from(UNIX_TICKS + unix_ns / 100)
}

/// ns since 1970 (UTC) of a time.
pub fn unix_ns(time: &DateTime) -> i64 {
    time.ticks().saturating_sub(UNIX_TICKS).saturating_mul(100)
}

/// The type of a value.
pub fn data_type(tag_type: TagType) -> NodeId {
    NodeId::from(match tag_type {
        TagType::Bit => DataTypeId::Boolean,
        TagType::Unsigned16 => DataTypeId::UInt16,
        TagType::Signed16 => DataTypeId::Int16,
        TagType::Signed32 => DataTypeId::Int32,
        TagType::Real => DataTypeId::Float,
    })
}

fn scalar_type(tag_type: TagType) -> VariantScalarTypeId {
    match tag_type {
        TagType::Bit => VariantScalarTypeId::Boolean,
        TagType::Unsigned16 => VariantScalarTypeId::UInt16,
        TagType::Signed16 => VariantScalarTypeId::Int16,
        TagType::Signed32 => VariantScalarTypeId::Int32,
        TagType::Real => VariantScalarTypeId::Float,
    }
}

/// A content as a value. An output whose state is not known has none.
pub fn scalar(tag_type: TagType, content: i32) -> Variant {
    match tag_type {
        TagType::Bit => Variant::Boolean(content != 0),
        TagType::Unsigned16 => Variant::UInt16(content as u16),
        TagType::Signed16 => Variant::Int16(content as i16),
        TagType::Signed32 => Variant::Int32(content),
        TagType::Real => Variant::Float(Real::of_cell(content).number()),
    }
}

/// Contents as an array.
pub fn array(tag_type: TagType, contents: impl Iterator<Item = i32>) -> Variant {
    let values: Vec<Variant> = contents.map(|content| scalar(tag_type, content)).collect();
    match Array::new(scalar_type(tag_type), values) {
        Ok(array) => Variant::from(array),
        Err(_) => Variant::Empty,
    }
}

/// A value with its status and the time of its scan.
pub fn stamped(value: Variant, status: StatusCode, source: DateTime) -> DataValue {
    DataValue {
        value: Some(value),
        status: Some(status),
        source_timestamp: Some(source),
        server_timestamp: Some(DateTime::now()),
        ..DataValue::default()
    }
}

/// A client's value in the form in which an operator gives it; `None`: it is of another type.
// A client may send any of the standard's types.
#[allow(clippy::wildcard_enum_match_arm)]
pub fn given(tag_type: TagType, value: &Variant) -> Option<GivenValue> {
    let whole = match value {
        Variant::Boolean(on) => {
            return (tag_type == TagType::Bit).then_some(GivenValue::Bit(*on));
        }
        Variant::Float(value) => {
            return (tag_type == TagType::Real && value.is_finite())
                .then(|| GivenValue::Real(f64::from(*value)));
        }
        Variant::Double(value) => {
            return (tag_type == TagType::Real && value.is_finite())
                .then_some(GivenValue::Real(*value));
        }
        Variant::SByte(value) => i64::from(*value),
        Variant::Byte(value) => i64::from(*value),
        Variant::Int16(value) => i64::from(*value),
        Variant::UInt16(value) => i64::from(*value),
        Variant::Int32(value) => i64::from(*value),
        Variant::UInt32(value) => i64::from(*value),
        Variant::Int64(value) => *value,
        Variant::UInt64(value) => i64::try_from(*value).ok()?,
        _ => return None,
    };
    let is_whole = matches!(tag_type, TagType::Unsigned16 | TagType::Signed16 | TagType::Signed32);
    is_whole.then_some(GivenValue::Number(whole))
}

/// The values of a client's array; `None`: it is no array, or of another type.
pub fn given_array(tag_type: TagType, value: &Variant) -> Option<Vec<GivenValue>> {
    let Variant::Array(array) = value else { return None };
    array.values.iter().map(|value| given(tag_type, value)).collect()
}

/// The status for a refusal of the controller.
pub fn refused(kind: RefusalKind) -> StatusCode {
    match kind {
        RefusalKind::BadRequest => StatusCode::BadInvalidArgument,
        RefusalKind::BadOperand => StatusCode::BadNodeIdUnknown,
        RefusalKind::BadValue => StatusCode::BadOutOfRange,
        RefusalKind::NotPermitted => StatusCode::BadUserAccessDenied,
        RefusalKind::Refused | RefusalKind::BadFiles => StatusCode::BadInvalidState,
        RefusalKind::NoAnswer | RefusalKind::TooLate => StatusCode::BadTimeout,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_keeps_its_hundred_nanoseconds() {
        let ns = 1_795_910_400_123_456_700;
        assert_eq!(unix_ns(&time(ns)), ns);
        assert_eq!(time(0).to_rfc3339(), "1970-01-01T00:00:00.000Z");
    }

    #[test]
    fn a_value_of_another_type_is_no_value_of_the_tag() {
        assert_eq!(given(TagType::Bit, &Variant::Int32(1)), None);
        assert_eq!(given(TagType::Signed16, &Variant::Boolean(true)), None);
        assert_eq!(given(TagType::Signed16, &Variant::Double(2.0)), None);
        assert_eq!(given(TagType::Real, &Variant::Float(f32::NAN)), None);
        assert_eq!(given(TagType::Real, &Variant::Float(0.5)), Some(GivenValue::Real(0.5)));
        // An integer beyond the tag's range is refused by the controller, which knows the range.
        let wide = given(TagType::Unsigned16, &Variant::Int64(70_000));
        assert_eq!(wide, Some(GivenValue::Number(70_000)));
        let array = Variant::from(vec![1_i16, -2]);
        let both = vec![GivenValue::Number(1), GivenValue::Number(-2)];
        assert_eq!(given_array(TagType::Signed32, &array), Some(both));
        assert_eq!(given_array(TagType::Bit, &array), None);
    }

    #[test]
    fn contents_keep_their_type_in_a_value() {
        assert_eq!(scalar(TagType::Unsigned16, 65_535), Variant::UInt16(65_535));
        assert_eq!(scalar(TagType::Signed16, -3), Variant::Int16(-3));
        assert_eq!(array(TagType::Bit, [0, 1].into_iter()), Variant::from(vec![false, true]));
    }
}
