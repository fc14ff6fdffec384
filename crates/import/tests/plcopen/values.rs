//! Values of IEC 61131-3.

/// A value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    Bool(bool),
    Whole(i64),
    /// Of a REAL or an LREAL.
    Real(f64),
}

impl Value {
    pub fn is_on(self) -> bool {
        match self {
            Value::Bool(is_on) => is_on,
            Value::Whole(value) => value != 0,
            Value::Real(_) => panic!("a REAL is no power"),
        }
    }

    pub fn whole(self) -> i64 {
        match self {
            Value::Whole(value) => value,
            Value::Bool(is_on) => i64::from(is_on),
            Value::Real(_) => panic!("a REAL is no whole number"),
        }
    }
}

/// The value of a whole number in its type.
pub fn wrapped(kind: &str, value: i64) -> Value {
    Value::Whole(match kind {
        "INT" => i64::from(value as i16),
        "UINT" => i64::from(value as u16),
        "DINT" => i64::from(value as i32),
        "LINT" => value,
        "TIME" => value.clamp(i32::MIN.into(), i32::MAX.into()),
        _ => panic!("the type {kind}"),
    })
}
