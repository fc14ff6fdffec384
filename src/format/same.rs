//! The proof of a formatted text: it says what the text before it says.
//!
//! Called by `format` for each text that it has changed. The values are compared as parsed; the
//! headers in their order; the comments as a list without an order, since keys may have moved.

use toml::de::{DeTable, DeValue};

use super::parse;
use super::tree::{Array, Piece, Row, Tail, Value};

/// Whether two texts have the same values, headers and comments.
pub(super) fn is_same(before: &str, after: &str) -> bool {
    has_same_values(before, after) && Outline::of(before) == Outline::of(after)
}

fn has_same_values(before: &str, after: &str) -> bool {
    match (DeTable::parse(before), DeTable::parse(after)) {
        (Ok(before), Ok(after)) => is_same_table(before.get_ref(), after.get_ref()),
        (Ok(_) | Err(_), _) => false,
    }
}

fn is_same_table(before: &DeTable<'_>, after: &DeTable<'_>) -> bool {
    before.len() == after.len()
        && before.iter().zip(after.iter()).all(|((key, value), (key2, value2))| {
            key.get_ref() == key2.get_ref() && is_same_value(value.get_ref(), value2.get_ref())
        })
}

fn is_same_value(before: &DeValue<'_>, after: &DeValue<'_>) -> bool {
    match (before, after) {
        (DeValue::Table(before), DeValue::Table(after)) => is_same_table(before, after),
        (DeValue::Array(before), DeValue::Array(after)) => {
            let mut both = before.iter().zip(after.iter());
            before.len() == after.len()
                && both.all(|(before, after)| is_same_value(before.get_ref(), after.get_ref()))
        }
        (DeValue::String(before), DeValue::String(after)) => before == after,
        (DeValue::Boolean(before), DeValue::Boolean(after)) => before == after,
        (DeValue::Datetime(before), DeValue::Datetime(after)) => before == after,
        (DeValue::Integer(before), DeValue::Integer(after)) => {
            before.as_str() == after.as_str() && before.radix() == after.radix()
        }
        (DeValue::Float(before), DeValue::Float(after)) => before.as_str() == after.as_str(),
        (_, _) => false,
    }
}

/// The headers of a text, and its comments in byte order.
#[derive(Debug, Default, PartialEq, Eq)]
struct Outline<'a> {
    heads: Vec<(Vec<&'a str>, bool)>,
    remarks: Vec<&'a str>,
}

impl<'a> Outline<'a> {
    fn of(text: &'a str) -> Outline<'a> {
        let mut outline = Outline::default();
        for piece in parse::pieces(text) {
            match piece {
                Piece::Blank => {}
                Piece::Remark(remark) => outline.remarks.push(remark),
                Piece::Head(head) => {
                    outline.tail(head.tail);
                    outline.heads.push((head.path, head.is_array));
                }
                Piece::Pair(pair) => {
                    outline.value(&pair.value);
                    outline.tail(pair.tail);
                }
            }
        }
        outline.remarks.sort_unstable();
        outline
    }

    fn tail(&mut self, tail: Option<Tail<'a>>) {
        self.remarks.extend(tail.map(|tail| tail.text));
    }

    fn value(&mut self, value: &Value<'a>) {
        match value {
            Value::Scalar(_) => {}
            Value::Table(pairs) => pairs.iter().for_each(|pair| self.value(&pair.value)),
            Value::Array(array) => self.array(array),
        }
    }

    fn array(&mut self, array: &Array<'a>) {
        self.tail(array.opening);
        for row in &array.rows {
            match row {
                Row::Blank => {}
                Row::Remark(remark) => self.remarks.push(remark),
                Row::Element(value, tail) => {
                    self.value(value);
                    self.tail(*tail);
                }
            }
        }
    }
}
