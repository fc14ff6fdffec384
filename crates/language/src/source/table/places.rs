//! The getter for values by place: a table whose keys are operands, with lists for arrays and
//! tables for what has members.
//!
//! Used by the reader of a set of values that `rungd write --file` writes. It names no place itself
//! and checks no value: the controller does both.
// `_` matches the values that TOML allows and a set does not; the enum is the parser's.
#![allow(clippy::wildcard_enum_match_arm)]

use toml::de::DeValue;

use super::{DeNode, PlacedValue, Table};
use crate::source::doc::describe;
use crate::source::finding::{Code, Finding};
use crate::source::wording::shown_name;

/// The most bytes in the name of a place.
const PLACE_BYTES_MAX: usize = 512;

/// The values found so far.
struct FoundValues {
    /// The search ends behind this number.
    most: usize,
    values: Vec<PlacedValue>,
}

impl<'a> Table<'a> {
    /// All values, in file order. The elements of an array are places with an index, the entries of
    /// a table places with a member. More than `most` values are a finding.
    pub fn values_by_place(&self, most: usize) -> Vec<PlacedValue> {
        let mut found = FoundValues { most, values: Vec::new() };
        self.note_values_below("", &mut found);
        let values = found.values;
        if let Some(first_beyond) = values.get(most) {
            let message = format!("more than {most} values, and one change has at most {most}");
            let finding = Finding::new(Code::OutOfRange, first_beyond.span, message);
            self.find(finding.help("divide the file: each part is a change of its own"));
        }
        values
    }

    fn note_values_below(&self, parent: &str, found: &mut FoundValues) {
        for (key, value) in self.in_file_order() {
            let key = key.get_ref();
            let place = if parent.is_empty() { key.to_string() } else { format!("{parent}.{key}") };
            self.note_value(place, value, found);
        }
    }

    /// Notes the values below one value. This is the one place that says what a value of TOML
    /// stands for.
    fn note_value(&self, place: String, node: DeNode<'a>, found: &mut FoundValues) {
        let span = self.doc.span(node.span());
        if found.values.len() > found.most {
            return;
        }
        if place.is_empty() || place.len() > PLACE_BYTES_MAX {
            let message = format!("the name of a place has 1 to {PLACE_BYTES_MAX} bytes");
            return self.find(Finding::new(Code::WrongType, span, message).or_omit());
        }
        let value = match node.get_ref() {
            DeValue::Array(items) if !items.is_empty() => {
                for (at, item) in items.iter().enumerate() {
                    self.note_value(format!("{place}[{at}]"), item, found);
                }
                return;
            }
            DeValue::Table(table) if !table.is_empty() => {
                let below = self.below(table, node.span(), "a table of values");
                return below.note_values_below(&place, found);
            }
            DeValue::Boolean(on) => on.to_string(),
            DeValue::String(text) => text.to_string(),
            DeValue::Integer(integer) => {
                match i64::from_str_radix(integer.as_str(), integer.radix()) {
                    Ok(number) => number.to_string(),
                    Err(_) => integer.as_str().to_owned(),
                }
            }
            DeValue::Float(float) if !float.as_str().contains(['n', 'N']) => {
                float.as_str().replace(['_', '+'], "")
            }
            other => {
                let kind = match other {
                    DeValue::Float(_) => "an infinite number or no number",
                    DeValue::Array(_) => "an empty array",
                    DeValue::Table(_) => "an empty table",
                    other => describe(other),
                };
                let wanted = "wants a number, true or false, a duration, or an array of these";
                let message = format!("`{}` {wanted}, not {kind}", shown_name(&place));
                return self.find(Finding::new(Code::WrongType, span, message).or_omit());
            }
        };
        found.values.push(PlacedValue { place, value, span });
    }
}
