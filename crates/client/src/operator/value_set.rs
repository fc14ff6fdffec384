//! A set of values: the writes of one change, in a request and in a file.
//!
//! `rungd write` sends a set, `rungd read --file` writes one into a file, and `rungd write --file`
//! reads it back. A file is a TOML table of operands and values: an array of the ladder is a list,
//! what has members is a table. Part of [`super::protocol`]. The names are resolved by the
//! controller, not here.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt::Write as _;
use std::iter::Peekable;
use std::slice::Iter;

use super::protocol::{BitOrNumber, GivenValue, GivenWrite, ShownValue, WRITES_MAX};
use rungd_language::source::finding::Finding;
use rungd_language::source::reader::{PlacedValue, Table, document};
use rungd_language::source::span::{FileId, Span};
use rungd_language::source::wording::escaped;

/// A write of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct FileWrite {
    /// The write.
    pub write: GivenWrite,
    /// The place of the value in the file.
    pub span: Span,
}

/// The writes of a file, and its mistakes.
pub fn read_file(text: &str) -> (Vec<FileWrite>, Vec<Finding>) {
    let read = |root: Table<'_>| root.values_by_place(WRITES_MAX);
    let (values, findings) = document(text, FileId(0), read);
    let write = |PlacedValue { place, value, span }| FileWrite {
        write: GivenWrite { operand: place, value: GivenValue::Text(value) },
        span,
    };
    (values.unwrap_or_default().into_iter().map(write).collect(), findings)
}

/// The text of a file that writes these values: a line for each bit and word, one for each array
/// from its first element on, a table for each record, a list of tables for an array of records.
/// `records`: the names of the tags of records.
pub fn file_text(values: &[ShownValue], records: &[String]) -> String {
    let records: HashSet<&str> = records.iter().map(String::as_str).collect();
    let mut tables: HashMap<&str, RecordTables> = HashMap::new();
    for field in values.iter().filter_map(|value| RecordFieldValue::of(value, &records)) {
        tables.entry(field.record).or_default().add(field);
    }
    let mut text = String::new();
    let mut rest = values.iter().peekable();
    while let Some(value) = rest.next() {
        let key = &value.operand;
        if let Some(RecordFieldValue { record, .. }) = RecordFieldValue::of(value, &records) {
            // All fields of a record are at its first one: a key stands once.
            if let Some(fields) = tables.remove(record) {
                text.push_str(&fields.text(record));
            }
            continue;
        }
        let Some(array) = key.strip_suffix("[0]") else {
            text.push_str(&line(key, &written(value.value), &remark(value)));
            continue;
        };
        let list: Vec<String> = std::iter::once(written(value.value))
            .chain(further_elements(array, &mut rest).map(|element| written(element.value)))
            .collect();
        text.push_str(&line(array, &format!("[{}]", list.join(", ")), &unit(value)));
    }
    text
}

/// A value of a field of a record.
struct RecordFieldValue<'v> {
    /// The tag of records.
    record: &'v str,
    /// Which of its records; `None` if it has no `count`.
    at: Option<usize>,
    /// The field, with the rest of the name.
    field: &'v str,
    value: BitOrNumber,
}

impl<'v> RecordFieldValue<'v> {
    /// The field that a value is of; `None` if its name begins with that of no record.
    fn of(shown: &'v ShownValue, records: &HashSet<&str>) -> Option<RecordFieldValue<'v>> {
        let (name, value) = (&shown.operand, shown.value);
        let mut ends = name.match_indices(['.', '[']).map(|(end, _)| end);
        let end = ends.find(|end| records.contains(&name[..*end]))?;
        let (record, rest) = name.split_at(end);
        let (at, field) = match rest.strip_prefix('[') {
            Some(rest) => {
                let (at, field) = rest.split_once("].")?;
                (Some(at.parse().ok()?), field)
            }
            None => (None, rest.strip_prefix('.')?),
        };
        Some(RecordFieldValue { record, at, field, value })
    }
}

/// The tables of the records of one tag, by their numbers.
#[derive(Default)]
struct RecordTables(BTreeMap<Option<usize>, Vec<String>>);

impl RecordTables {
    fn add(&mut self, field: RecordFieldValue<'_>) {
        // A member of a field is a key of two names: `over.Acc`.
        let key: Vec<Cow<'_, str>> = field.field.split('.').map(shown_key).collect();
        let pair = format!("{} = {}", key.join("."), written(field.value));
        self.0.entry(field.at).or_default().push(pair);
    }

    /// The lines: a list of the records from the first on, then those behind a gap.
    fn text(self, record: &str) -> String {
        let (mut list, mut others) = (String::new(), String::new());
        let mut next = 0;
        for (at, pairs) in self.0 {
            let table = format!("{{ {} }}", pairs.join(", "));
            match at {
                Some(at) if at == next => {
                    list.push_str(&format!("    {table},\n"));
                    next += 1;
                }
                Some(at) => others.push_str(&line(&format!("{record}[{at}]"), &table, "")),
                None => others.push_str(&line(record, &table, "")),
            }
        }
        if !list.is_empty() {
            list = line(record, &format!("[\n{list}]"), "");
        }
        list + &others
    }
}

/// Takes the elements that follow the first one of an array.
fn further_elements<'v>(
    array: &str,
    rest: &mut Peekable<Iter<'v, ShownValue>>,
) -> impl Iterator<Item = &'v ShownValue> {
    let mut elements = Vec::new();
    while let Some(element) =
        rest.next_if(|next| next.operand == format!("{array}[{}]", elements.len() + 1))
    {
        elements.push(element);
    }
    elements.into_iter()
}

/// A line of the file.
fn line(key: &str, value: &str, remark: &str) -> String {
    let mut line = format!("{} = {value}", shown_key(key));
    if !remark.is_empty() {
        let _ = write!(line, "  # {remark}");
    }
    line.push('\n');
    line
}

/// The unit and the text, for a comment.
fn remark(value: &ShownValue) -> String {
    let parts = value.unit.iter().chain(&value.text).map(String::as_str);
    escaped(&parts.collect::<Vec<_>>().join(", ")).into_owned()
}

/// The unit, for a comment.
fn unit(value: &ShownValue) -> String {
    value.unit.as_deref().map(escaped).unwrap_or_default().into_owned()
}

/// A value in TOML. A real has a point or an exponent, however large it is.
fn written(value: BitOrNumber) -> String {
    match value {
        BitOrNumber::Bit(on) => on.to_string(),
        BitOrNumber::Word(_) | BitOrNumber::Real(_) => value.to_string(),
    }
}

/// A key as TOML takes it, as one name.
fn shown_key(key: &str) -> Cow<'_, str> {
    if is_bare(key) { Cow::Borrowed(key) } else { Cow::Owned(quoted(key)) }
}

/// Whether TOML takes a key without quotes, as one name.
fn is_bare(key: &str) -> bool {
    let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    !key.is_empty() && key.chars().all(fits)
}

/// A key as a string of TOML.
fn quoted(key: &str) -> String {
    let mut text = String::from("\"");
    for c in key.chars() {
        match c {
            '"' | '\\' => text.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(text, "\\u{:04X}", u32::from(c));
            }
            c => text.push(c),
        }
    }
    text.push('"');
    text
}

#[cfg(test)]
#[path = "value_set_tests.rs"]
mod tests;
