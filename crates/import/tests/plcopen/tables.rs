//! The functions of IEC 61131-3, from its tables.

use std::collections::HashMap;

use super::values::{Value, wrapped};

/// The value of a function; `None` without a result: a division by 0.
pub fn function(name: &str, kind: &str, given: &HashMap<String, Value>) -> Option<Value> {
    let all: Vec<Value> = ["IN1", "IN2", "IN3"]
        .iter()
        .filter_map(|pin| given.get(*pin).copied())
        .chain(given.get("IN").copied().filter(|_| name != "LIMIT"))
        .collect();
    match name {
        "TRUNC" => return Some(Value::Whole(number(all[0]).trunc() as i64)),
        "SEL" => return Some(given[if given["G"].is_on() { "IN1" } else { "IN0" }]),
        "MOVE" => return Some(all[0]),
        "LIMIT" => {
            let (low, value, high) = (given["MN"], given["IN"], given["MX"]);
            return Some(match (less(low, value), less(value, high)) {
                (false, _) => low,
                (true, true) => value,
                (true, false) => high,
            });
        }
        "GT" => return Some(Value::Bool(less(all[1], all[0]))),
        "GE" => return Some(Value::Bool(!less(all[0], all[1]))),
        "EQ" => return Some(Value::Bool(all[0] == all[1])),
        "NE" => return Some(Value::Bool(all[0] != all[1])),
        "LE" => return Some(Value::Bool(!less(all[1], all[0]))),
        "LT" => return Some(Value::Bool(less(all[0], all[1]))),
        "MAX" => {
            return all.into_iter().reduce(|one, other| if less(one, other) { other } else { one });
        }
        "MIN" => {
            return all.into_iter().reduce(|one, other| if less(other, one) { other } else { one });
        }
        _ => {}
    }
    if let Some((_, to)) = name.split_once("_TO_") {
        return Some(converted(all[0], kind, to));
    }
    let are_bits = all.iter().all(|value| matches!(value, Value::Bool(_)));
    // Literals alone have the widest type of their kind.
    let kind = match all.first() {
        _ if are_bits => "BOOL",
        Some(Value::Real(_)) if kind == "BOOL" => "LREAL",
        Some(_) if kind == "BOOL" => "LINT",
        _ => kind,
    };
    match kind {
        "REAL" | "LREAL" => real(name, kind, &all),
        "BOOL" => Some(Value::Bool(match name {
            "AND" => all.iter().all(|value| value.is_on()),
            "OR" => all.iter().any(|value| value.is_on()),
            "XOR" => all.iter().filter(|value| value.is_on()).count() % 2 == 1,
            name => panic!("{name} of BOOLs"),
        })),
        kind => whole(name, kind, &all),
    }
}

fn less(one: Value, other: Value) -> bool {
    match (one, other) {
        (Value::Real(one), Value::Real(other)) => one < other,
        (Value::Whole(one), Value::Whole(other)) => one < other,
        _ => panic!("{one:?} beside {other:?}"),
    }
}

fn number(value: Value) -> f64 {
    match value {
        Value::Real(value) => value,
        Value::Whole(value) => value as f64,
        Value::Bool(_) => panic!("a BOOL is no number"),
    }
}

/// A real in its type. One of rungd stays at the largest number, and is never -0.
fn fitted(kind: &str, value: f64) -> f64 {
    match kind {
        "REAL" => f64::from((value as f32).clamp(f32::MIN, f32::MAX)) + 0.0,
        _ => value.clamp(f64::MIN, f64::MAX) + 0.0,
    }
}

fn real(name: &str, kind: &str, all: &[Value]) -> Option<Value> {
    let value = |at: usize| match all[at] {
        Value::Real(value) => value,
        other => panic!("{name}: {other:?} is no REAL: {all:?}"),
    };
    let values: Vec<f64> = (0..all.len()).map(value).collect();
    let fits = |value: f64| fitted(kind, value);
    let fold = |of: fn(f64, f64) -> f64| {
        values.iter().copied().reduce(|one, other| fits(of(one, other))).map(Value::Real)
    };
    match name {
        "ADD" => fold(|one, other| one + other),
        "SUB" => fold(|one, other| one - other),
        "MUL" => fold(|one, other| one * other),
        "DIV" if values[1] == 0.0 => None,
        "DIV" => fold(|one, other| one / other),
        "ABS" => Some(Value::Real(values[0].abs())),
        name => panic!("{name} of REALs"),
    }
}

fn whole(name: &str, kind: &str, all: &[Value]) -> Option<Value> {
    let values: Vec<i64> = all
        .iter()
        .map(|value| match value {
            Value::Whole(value) => *value,
            value => panic!("{value:?} is no whole number"),
        })
        .collect();
    let fold = |of: fn(i64, i64) -> i64| {
        let step = |one: i64, other: i64| match wrapped(kind, of(one, other)) {
            Value::Whole(value) => value,
            _ => 0,
        };
        values.iter().copied().reduce(step).map(Value::Whole)
    };
    match name {
        "ADD" => fold(|one, other| one + other),
        "SUB" => fold(|one, other| one - other),
        "MUL" => fold(|one, other| one * other),
        "DIV" if values[1] == 0 => None,
        "DIV" => fold(|one, other| one / other),
        "MOD" if values[1] == 0 => Some(Value::Whole(0)),
        "MOD" => fold(|one, other| one % other),
        "AND" => fold(|one, other| one & other),
        "OR" => fold(|one, other| one | other),
        "XOR" => fold(|one, other| one ^ other),
        "NOT" => Some(wrapped(kind, !values[0])),
        "ABS" => Some(wrapped(kind, values[0].abs())),
        name => panic!("{name} of whole numbers"),
    }
}

/// A conversion: the functions of MatIEC's library.
fn converted(value: Value, from: &str, to: &str) -> Value {
    match (value, to) {
        (Value::Bool(is_on), to) => wrapped(to, i64::from(is_on)),
        (Value::Real(real), "REAL" | "LREAL") => Value::Real(fitted(to, real)),
        (Value::Real(real), to) => {
            // Beyond 64 bits C leaves the result open; rungd stays at their limit.
            let round = |real: f64| match real % 1.0 == 0.0 && real.abs() < 2f64.powi(62) {
                true => (real as i64 / 2) * 2,
                false => real as i64,
            };
            match (real >= 0.0, to) {
                (true, _) => wrapped(to, round(real + 0.5)),
                (false, "UINT") => Value::Whole(0),
                (false, _) => wrapped(to, round(real - 0.5)),
            }
        }
        (Value::Whole(ms), "REAL") if from == "TIME" => {
            Value::Real(fitted(to, (ms / 1000) as f64 + (ms % 1000) as f64 / 1000.0))
        }
        (Value::Whole(ms), to) if from == "TIME" => wrapped(to, ms / 1000),
        (Value::Whole(seconds), "TIME") => wrapped(to, seconds * 1000),
        (Value::Whole(whole), "REAL") => Value::Real(f64::from(whole as f32)),
        (Value::Whole(whole), "LREAL") => Value::Real(whole as f64),
        (Value::Whole(whole), to) => wrapped(to, whole),
    }
}
