//! The memory of the interpreter: names with values, and operands of Logix.

use std::collections::HashMap;

/// The memory: a bit is 0 or 1, a whole number is kept at its own width, a REAL by its bits.
#[derive(Debug, Default)]
pub struct Values {
    words: HashMap<String, i64>,
}

/// A value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    Whole(i64),
    Real(f32),
}

impl Value {
    pub fn real(self) -> f32 {
        match self {
            Value::Whole(value) => value as f32,
            Value::Real(value) => value,
        }
    }
}

/// The type of a tag, by the beginning of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    Bit,
    Signed(u32),
    Real,
}

pub fn width(name: &str) -> Width {
    if name.rsplit_once('.').is_some_and(|(_, bit)| bit.parse::<u32>().is_ok()) {
        return Width::Bit;
    }
    let name = name.split('[').next().unwrap();
    match name {
        name if name.starts_with("shrt") => Width::Signed(16),
        name if name.starts_with("tiny") => Width::Signed(8),
        name if name.starts_with("real") => Width::Real,
        name if ["num", "arr", "fifo", "shift", "idx"].iter().any(|one| name.starts_with(one)) => {
            Width::Signed(32)
        }
        name if [".ACC", ".PRE", ".POS", ".LEN"].iter().any(|one| name.ends_with(one)) => {
            Width::Signed(32)
        }
        _ => Width::Bit,
    }
}

/// A value cut to a number of bits.
pub fn cut(value: i64, bits: u32) -> i64 {
    value << (64 - bits) >> (64 - bits)
}

/// A REAL as a whole number: to the nearest, half to even.
pub fn rounded(value: f32) -> i64 {
    let value = f64::from(value);
    let floor = value.floor();
    let rest = value - floor;
    let whole = floor as i64;
    match rest {
        rest if rest < 0.5 => whole,
        rest if rest > 0.5 => whole + 1,
        _ if whole % 2 == 0 => whole,
        _ => whole + 1,
    }
}

impl Values {
    /// The name with its index as a number: `arr[idx+1]` is `arr[3]`.
    pub fn plain(&self, text: &str) -> String {
        let Some((before, rest)) = text.split_once('[') else { return text.to_owned() };
        let (index, behind) = rest.split_once(']').unwrap();
        let at: i64 = match index.split_once('+') {
            Some((one, other)) => self.whole(one) + self.whole(other),
            None => self.whole(index),
        };
        format!("{before}[{at}]{behind}")
    }

    fn whole(&self, text: &str) -> i64 {
        match self.value(text.trim()) {
            Value::Whole(value) => value,
            Value::Real(_) => panic!("{text} is no index"),
        }
    }

    /// The bit number of a text that names a bit of a word.
    fn bit_of(text: &str) -> Option<(&str, u32)> {
        let (word, number) = text.rsplit_once('.')?;
        Some((word, number.parse().ok()?))
    }

    pub fn value(&self, text: &str) -> Value {
        if let Ok(value) = text.parse::<i64>() {
            return Value::Whole(value);
        }
        if let Ok(value) = text.parse::<f32>() {
            return Value::Real(value);
        }
        let text = self.plain(text);
        let raw = self.words.get(&text).copied().unwrap_or(0);
        match width(&text) {
            Width::Real => Value::Real(f32::from_bits(raw as u32)),
            _ => Value::Whole(raw),
        }
    }

    pub fn bit(&self, text: &str) -> bool {
        let text = self.plain(text);
        match Values::bit_of(&text) {
            Some((word, bit)) => (self.words.get(word).copied().unwrap_or(0) >> bit) & 1 == 1,
            None => self.words.get(&text).copied().unwrap_or(0) != 0,
        }
    }

    pub fn set_bit(&mut self, text: &str, is_on: bool) {
        let text = self.plain(text);
        match Values::bit_of(&text) {
            Some((word, bit)) => {
                let Width::Signed(bits) = width(word) else { panic!("{text}") };
                let old = self.words.get(word).copied().unwrap_or(0);
                let new = if is_on { old | (1 << bit) } else { old & !(1 << bit) };
                self.words.insert(word.to_owned(), cut(new, bits));
            }
            None => {
                self.words.insert(text, i64::from(is_on));
            }
        }
    }

    /// Stores a value as the type of its target wants it.
    pub fn store(&mut self, text: &str, value: Value) {
        let text = self.plain(text);
        let raw = match (width(&text), value) {
            (Width::Real, value) => i64::from((value.real() + 0.0).to_bits()),
            (Width::Signed(bits), Value::Whole(value)) => cut(value, bits),
            (Width::Signed(bits), Value::Real(value)) => cut(rounded(value), bits),
            (Width::Bit, _) => panic!("{text} is a bit"),
        };
        self.words.insert(text, raw);
    }
}

pub fn negated(value: Value) -> Value {
    match value {
        Value::Whole(value) => Value::Whole(-value),
        Value::Real(value) => Value::Real(-value),
    }
}

pub fn arithmetic(name: &str, sides: [Value; 2], into_real: bool) -> Value {
    let [one, other] = sides;
    if let (Value::Whole(one), Value::Whole(other), false) = (one, other, into_real) {
        return Value::Whole(match name {
            "ADD" => one + other,
            "SUB" => one - other,
            "MUL" => one * other,
            "DIV" => one / other,
            _ => one % other,
        });
    }
    let (one, other) = (one.real(), other.real());
    Value::Real(match name {
        "ADD" => one + other,
        "SUB" => one - other,
        "MUL" => one * other,
        "DIV" => one / other,
        _ => one % other,
    })
}
