//! A TOML table, read with typed getters by the readers of ladder and controller files.
//!
//! A value of the wrong type becomes a finding, and [`Table::finish`] makes a finding for every key
//! that no getter requested. Reading continues after a mistake: the getter returns `None`, as for
//! an absent key.
// `_` matches the values that TOML allows and a ladder does not; the enum is the parser's.
#![allow(clippy::wildcard_enum_match_arm)]

mod constants;
mod entries;
mod places;
mod values;

use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use super::atom::bad_duration;
use super::doc::{Doc, Text, describe};
use super::finding::{Code, Finding};
use super::fix::{Help, give_one, pair, text};
use super::headers;
use super::key::Key;
use super::nearest::key_help;
use super::renaming;
use super::shape::{TableShape, ValueForm};
use super::span::{Located, Span};
use rungd_engine::isa::{Real, duration};

/// A constant: `12`, `true`, `"2s500ms"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Constant {
    /// An integer.
    Integer(i32),
    /// A duration in ms.
    Duration(i32),
    /// A real.
    Real(Real),
    /// `true` or `false`.
    Bit(bool),
}

/// An entry of a table whose keys are names.
pub struct NamedTable<'a> {
    /// Its key.
    pub name: Text,
    /// Its value; `None` for a value of a wrong type, which is reported.
    pub table: Option<Table<'a>>,
}

/// A value of a table, with the place that it is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlacedValue {
    /// The place, as an operand is written: `size`, `p1.limit`, `recipe[2]`.
    pub place: String,
    /// The value, as a person types it: `true`, `12`, `0.5`, `1m30s`.
    pub value: String,
    /// The value's place in the file.
    pub span: Span,
}

/// A value that may have two forms.
pub enum TextOrTable<'a> {
    /// A string.
    Text(Text),
    /// A table.
    Table(Table<'a>),
}

/// The values of records in `initial`.
#[derive(Clone, Debug, Default)]
pub struct InitialRecords {
    /// Whether they are a list.
    pub is_list: bool,
    /// For each record, its values by the names of the fields.
    pub values: Vec<Vec<(Text, Located<Constant>)>>,
}

/// The value of `initial`: at most one of these.
#[derive(Default)]
pub struct WrittenInitial {
    /// One constant.
    pub one: Option<Located<Constant>>,
    /// A list of constants, with its place.
    pub list: Option<Located<Vec<Located<Constant>>>>,
    /// The values of a record's fields, or a list of records.
    pub records: Option<Located<InitialRecords>>,
}

/// A table, and the keys that were requested.
pub struct Table<'a> {
    doc: Doc<'a>,
    table: &'a DeTable<'a>,
    span: Span,
    place: &'static str,
    asked: Vec<&'static str>,
    /// The record of requested keys, if this is an empty table that is read to collect its keys.
    shape: Option<TableShape>,
}

/// The keys of most tables, so that a table needs one allocation for those that are requested.
const KEYS_MANY: usize = 12;

type DeNode<'a> = &'a Spanned<DeValue<'a>>;

impl<'a> Table<'a> {
    /// The root table of a file.
    pub(super) fn root(doc: Doc<'a>, table: &'a DeTable<'a>) -> Self {
        let span = doc.span(0..0);
        let asked = Vec::with_capacity(KEYS_MANY);
        Table { doc, table, span, place: "the file", asked, shape: None }
    }

    /// The same table, with requested keys recorded in `shape`.
    pub(super) fn noting(mut self, shape: &TableShape) -> Self {
        self.shape = Some(shape.clone());
        self
    }

    /// The file that contains it.
    pub fn doc(&self) -> Doc<'a> {
        self.doc
    }

    /// The place of its header, or of the whole inline table.
    pub fn span(&self) -> Span {
        self.span
    }

    /// Its kind, in words for a message (`a rung`).
    pub fn place(&self) -> &'static str {
        self.place
    }

    /// Sets the words for its kind in findings.
    pub fn call(&mut self, place: &'static str) {
        self.place = place;
    }

    /// From its header to the end of its last value.
    pub fn extent(&self) -> Span {
        Span { end: end_of(self.table).max(self.span.end as usize) as u32, ..self.span }
    }

    /// Whether it has no key.
    pub fn is_empty(&self) -> bool {
        self.table.is_empty()
    }

    /// Whether a key is present. Does not count as a request for it.
    pub fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// Whether a key is present and a table.
    pub fn has_table(&self, key: &str) -> bool {
        self.table.get(key).is_some_and(|value| matches!(value.get_ref(), DeValue::Table(_)))
    }

    /// The place of a key, if it is present.
    pub fn key_span(&self, key: &str) -> Option<Span> {
        self.table.get_key_value(key).map(|(k, _)| self.doc.span(k.span()))
    }

    /// Adds a finding.
    pub fn find(&self, finding: Finding) {
        self.doc.find(finding);
    }

    /// All strings in the table and in the arrays and tables below it, in no order.
    pub fn all_strings(&self) -> Vec<String> {
        let mut strings = Vec::new();
        let mut waiting: Vec<&DeValue<'_>> = self.table.values().map(Spanned::get_ref).collect();
        while let Some(value) = waiting.pop() {
            match value {
                DeValue::String(text) => strings.push(text.to_string()),
                DeValue::Array(items) => waiting.extend(items.iter().map(Spanned::get_ref)),
                DeValue::Table(table) => waiting.extend(table.values().map(Spanned::get_ref)),
                _ => {}
            }
        }
        strings
    }

    fn get(&mut self, key: Key, form: ValueForm) -> Option<DeNode<'a>> {
        self.asked.push(key.name);
        if let Some(shape) = &self.shape {
            shape.note(key, form);
        }
        self.table.get(key.name)
    }

    /// Records a JSON Schema for the table as a whole.
    pub fn together(&self, schema: &'static str) {
        self.shape.iter().for_each(|shape| shape.note_together(schema));
    }

    fn what(&self, key: &str) -> String {
        format!("`{key}` of {}", self.place)
    }

    /// A string.
    pub fn string(&mut self, key: Key) -> Option<Text> {
        self.string_for(key, "a string", ValueForm::Text)
    }

    /// A string; `wanted` names its meaning in the finding for a value of a wrong type.
    fn string_for(&mut self, key: Key, wanted: &str, form: ValueForm) -> Option<Text> {
        let value = self.get(key, form)?;
        match value.get_ref() {
            DeValue::String(text) => Some(self.doc.text(text, value.span())),
            _ => {
                self.doc.wrong_type(value, &self.what(key.name), wanted);
                None
            }
        }
    }

    /// A required string.
    pub fn required_string(&mut self, key: Key) -> Option<Text> {
        self.require(key.name, "\"…\"");
        self.string(key)
    }

    /// Makes a finding if a key is absent; `example` is a value for the help.
    pub fn require(&mut self, key: &'static str, example: &str) {
        if let Some(shape) = &self.shape {
            shape.note_required(key);
        }
        if self.has(key) {
            return;
        }
        let message = format!("{} has no `{key}`", self.place);
        let finding = Finding::new(Code::MissingKey, self.span, message);
        let finding = finding.help(give_one(key, example));
        self.find(match (key, self.place.rsplit(' ').next()) {
            ("name", Some(thing)) => {
                let name = renaming::first_of(thing);
                finding.fix(pair(format!("name = \"{name}\"")).possible())
            }
            _ => finding,
        });
    }

    /// `true` or `false`.
    pub fn boolean(&mut self, key: Key) -> Option<Located<bool>> {
        let value = self.get(key, ValueForm::Flag)?;
        match value.get_ref() {
            DeValue::Boolean(on) => Some(Located { value: *on, span: self.doc.span(value.span()) }),
            _ => {
                self.doc.wrong_type(value, &self.what(key.name), "true or false");
                None
            }
        }
    }

    /// An integer within a range.
    pub fn integer(&mut self, key: Key, range: RangeInclusive<i64>) -> Option<Located<i64>> {
        let value = self.get(key, ValueForm::Integer(*range.start(), *range.end()))?;
        let span = self.doc.span(value.span());
        self.number(value, key.name, &range).map(|value| Located { value, span })
    }

    fn number(&self, value: DeNode<'a>, key: &str, range: &RangeInclusive<i64>) -> Option<i64> {
        let DeValue::Integer(integer) = value.get_ref() else {
            self.doc.wrong_type(value, &self.what(key), "an integer");
            return None;
        };
        let parsed = i64::from_str_radix(integer.as_str(), integer.radix()).ok();
        let number = parsed.filter(|n| range.contains(n));
        if number.is_none() {
            let (least, most) = (range.start(), range.end());
            let message = format!("{} lies outside {least}..{most}", self.what(key));
            let limit = if integer.as_str().starts_with('-') { *least } else { *most };
            let limit = parsed.map_or(limit, |n| n.clamp(*least, *most)).to_string();
            let span = self.doc.span(value.span());
            self.find(Finding::new(Code::OutOfRange, span, message).fix(text(limit)));
        }
        number
    }

    /// An array of integers, each within a range.
    pub fn integers(&mut self, key: Key, range: RangeInclusive<i64>) -> Option<Located<Vec<i64>>> {
        let value = self.get(key, ValueForm::Integers(*range.start(), *range.end()))?;
        let DeValue::Array(array) = value.get_ref() else {
            self.doc.wrong_type(value, &self.what(key.name), "an array of integers");
            return None;
        };
        let numbers = array.iter().filter_map(|item| self.number(item, key.name, &range)).collect();
        Some(Located { value: numbers, span: self.doc.span(value.span()) })
    }

    /// A duration, in ms, from a string such as `10ms`.
    pub fn duration(&mut self, key: Key) -> Option<Located<i32>> {
        let text = self.string_for(key, "a duration (`\"10ms\"`)", ValueForm::Duration)?;
        match duration::parse(&text.text) {
            Ok(value) => Some(Located { value, span: text.span }),
            Err(error) => {
                self.find(bad_duration(&text.text, text.span, error));
                None
            }
        }
    }

    /// An array of strings, with its place. A bare string is a finding with its own help.
    pub fn strings(&mut self, key: Key) -> Option<Located<Vec<Text>>> {
        let value = self.get(key, ValueForm::Texts)?;
        self.strings_of(value, key.name, "")
    }

    fn strings_of(&self, value: DeNode<'a>, key: &str, prefix: &str) -> Option<Located<Vec<Text>>> {
        let span = self.doc.span(value.span());
        let array = match value.get_ref() {
            DeValue::Array(array) => array,
            DeValue::String(text) => {
                let message = format!("{} is always an array", self.what(key));
                let right = format!("{prefix}{key} = [{}]", self.doc.slice(value.span()));
                self.find(
                    Finding::new(Code::BareString, span, message)
                        .label("a string alone")
                        .write(pair(right).certain()),
                );
                return Some(Located { value: vec![self.doc.text(text, value.span())], span });
            }
            _ => {
                self.doc.wrong_type(value, &self.what(key), "an array of strings");
                return None;
            }
        };
        let mut texts = Vec::new();
        for item in array {
            match item.get_ref() {
                DeValue::String(text) => texts.push(self.doc.text(text, item.span())),
                _ => self.doc.wrong_type(item, &self.what(key), "strings"),
            }
        }
        Some(Located { value: texts, span })
    }

    /// A table of a key: `[key]`, `key = { … }` or `key.… = …`.
    pub fn table(&mut self, key: Key, place: &'static str) -> Option<Table<'a>> {
        if let Some(below) = self.noted_below(place) {
            self.get(key, ValueForm::Table(below.1));
            return Some(below.0);
        }
        let value = self.get(key, ValueForm::Any)?;
        match value.get_ref() {
            DeValue::Table(table) => Some(self.below(table, value.span(), place)),
            _ => {
                self.doc.wrong_type(value, &self.what(key.name), "a table");
                None
            }
        }
    }

    /// The tables of a key: `[[key]]` headers or an array of inline tables.
    pub fn tables(&mut self, key: Key, place: &'static str) -> Vec<Table<'a>> {
        if let Some(below) = self.noted_below(place) {
            self.get(key, ValueForm::Tables(below.1));
            return vec![below.0];
        }
        let Some(value) = self.get(key, ValueForm::Any) else { return Vec::new() };
        let array = match value.get_ref() {
            DeValue::Array(array) => array,
            // A header below a missing one: `headers` has already reported it.
            DeValue::Table(_)
                if headers::is_implicit(self.doc, value) && self.doc.has_headless() =>
            {
                return Vec::new();
            }
            _ => {
                let parent = if self.place == "the file" { "" } else { "…" };
                let mut wanted = format!("an array of tables (`[[{parent}{}]]`)", key.name);
                if matches!(value.get_ref(), DeValue::Table(_)) && !parent.is_empty() {
                    wanted = format!("an array of tables: `{} = [{{ … }}]`", key.name);
                }
                self.doc.wrong_type(value, &self.what(key.name), &wanted);
                return Vec::new();
            }
        };
        let mut tables = Vec::new();
        for item in array {
            match item.get_ref() {
                DeValue::Table(table) => tables.push(self.below(table, item.span(), place)),
                _ => self.doc.wrong_type(item, &self.what(key.name), "tables"),
            }
        }
        tables
    }

    /// All entries, in file order (the form of `[tags]`). An entry that is not a table becomes a
    /// finding with the text of `help`.
    pub fn entries(
        &mut self,
        any: Key,
        place: &'static str,
        help: impl Fn(&str, &str) -> Help,
    ) -> Vec<NamedTable<'a>> {
        let mut entries = Vec::new();
        if let Some((below, form)) = self.noted_below(place) {
            self.shape
                .iter()
                .for_each(|shape| shape.note_others(any, ValueForm::Table(form.clone())));
            entries.push(NamedTable { name: self.doc.text("", 0..0), table: Some(below) });
        }
        for (key, value) in self.in_file_order() {
            let table = match value.get_ref() {
                DeValue::Table(table) => Some(self.below(table, value.span(), place)),
                other => {
                    let message = format!("{place} is a table, not {}", describe(other));
                    let help = help(key.get_ref(), self.doc.slice(value.span()));
                    let span = self.doc.span(value.span());
                    self.find(Finding::new(Code::WrongType, span, message).help(help));
                    None
                }
            };
            entries.push(NamedTable { name: self.key_text(key), table });
        }
        entries
    }

    fn in_file_order(&self) -> Vec<(&'a Spanned<DeString<'a>>, DeNode<'a>)> {
        let mut entries: Vec<_> = self.table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        entries
    }

    fn key_text(&self, key: &Spanned<DeString<'a>>) -> Text {
        let raw = self.doc.slice(key.span());
        if raw == key.get_ref() {
            let span = self.doc.span(key.span());
            return Text { text: raw.to_owned(), span, exact: true };
        }
        self.doc.text(key.get_ref(), key.span())
    }

    fn below(&self, table: &'a DeTable<'a>, span: Range<usize>, place: &'static str) -> Table<'a> {
        let span = self.doc.span(span);
        let asked = Vec::with_capacity(KEYS_MANY);
        Table { doc: self.doc, table, span, place, asked, shape: None }
    }

    /// If keys are recorded: an empty table below this one, and the shape for its keys.
    fn noted_below(&self, place: &'static str) -> Option<(Table<'a>, TableShape)> {
        self.shape.as_ref()?;
        let shape = TableShape::of_place(place);
        Some((self.below(self.table, 0..0, place).noting(&shape), shape))
    }

    /// Whether the table has a key that no getter has requested.
    pub fn has_unknown(&self) -> bool {
        self.table.keys().any(|key| !self.asked.contains(&key.get_ref().as_ref()))
    }

    /// Makes a finding for every key that no getter requested: it is probably one that is missing.
    pub fn finish(self) {
        let all = self.in_file_order().into_iter().map(|(key, _)| key);
        let unknown = all.filter(|key| !self.asked.contains(&key.get_ref().as_ref()));
        if self.has_unknown() {
            self.doc.drop_missing(self.span);
        }
        for key in unknown {
            let name: &str = key.get_ref();
            let message = format!("{} has no key `{name}`", self.place);
            let has = |key: &str| self.table.contains_key(key);
            let help = key_help(name, &self.asked, self.place, has);
            let finding = Finding::new(Code::UnknownKey, self.doc.span(key.span()), message);
            self.find(finding.label("unknown key").help(help));
        }
    }
}

/// The byte after the last key or value of a table and all tables below it.
fn end_of(table: &DeTable<'_>) -> usize {
    let ends = table.iter().map(|(key, value)| key.span().end.max(end_of_value(value)));
    ends.max().unwrap_or(0)
}

fn end_of_value(value: &Spanned<DeValue<'_>>) -> usize {
    let below = match value.get_ref() {
        DeValue::Table(table) => end_of(table),
        DeValue::Array(array) => array.iter().map(end_of_value).max().unwrap_or(0),
        _ => 0,
    };
    below.max(value.span().end)
}
