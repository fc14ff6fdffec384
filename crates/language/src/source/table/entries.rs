//! Getters for the entries of a table whose keys are names and whose values are not only tables.
// `_` matches the values that TOML allows and a ladder does not; the enum is the parser's.
#![allow(clippy::wildcard_enum_match_arm)]

use std::ops::RangeInclusive;

use toml::de::DeValue;

use super::{Constant, DeNode, Table, TextOrTable, ValueForm};
use crate::source::finding::{Code, Finding};
use crate::source::fix::possible;
use crate::source::key::Key;
use crate::source::reader::Text;
use crate::source::span::Located;

impl<'a> Table<'a> {
    /// All entries as arrays of strings, by key and in file order (the form of `leg`). Help texts
    /// have `prefix` before the keys.
    pub fn string_arrays(&mut self, any: Key, prefix: &str) -> Vec<(Text, Located<Vec<Text>>)> {
        self.shape.iter().for_each(|shape| shape.note_others(any, ValueForm::Texts));
        let entries = self.in_file_order();
        let arrays = entries.into_iter().filter_map(|(key, value)| {
            let name = self.key_text(key);
            Some((name, self.strings_of(value, key.get_ref(), prefix)?))
        });
        arrays.collect()
    }

    /// The keys that no getter requested, in file order, for a finding that differs from that of
    /// [`Table::finish`].
    pub fn unasked(&self) -> Vec<Text> {
        let entries = self.in_file_order().into_iter();
        let unasked = entries.filter(|(key, _)| {
            let name: &str = key.get_ref();
            !self.asked.contains(&name)
        });
        unasked.map(|(key, _)| self.key_text(key)).collect()
    }

    /// All entries as integers within a range, by key and in file order (the form of named places).
    pub fn integers_by_name(
        &mut self,
        any: Key,
        range: RangeInclusive<i64>,
    ) -> Vec<(Text, Located<i64>)> {
        self.shape.iter().for_each(|shape| {
            shape.note_others(any, ValueForm::Integer(*range.start(), *range.end()))
        });
        let entries = self.in_file_order();
        let integers = entries.into_iter().filter_map(|(key, value)| {
            let number = self.number(value, key.get_ref(), &range)?;
            let span = self.doc.span(value.span());
            Some((self.key_text(key), Located { value: number, span }))
        });
        integers.collect()
    }

    /// All entries as constants, by key and in file order (the form of `set` in a test).
    pub fn constants_by_name(&mut self, any: Key) -> Vec<(Text, Located<Constant>)> {
        self.shape.iter().for_each(|shape| shape.note_others(any, ValueForm::Constant));
        let entries = self.in_file_order();
        let constants = entries.into_iter().filter_map(|(key, value)| {
            let name = self.key_text(key);
            Some((name, self.constant_of(value, key.get_ref())?))
        });
        constants.collect()
    }

    /// All entries as strings, by key and in file order (the form of `texts`).
    pub fn strings_by_name(&mut self, any: Key) -> Vec<(Text, Text)> {
        self.shape.iter().for_each(|shape| shape.note_others(any, ValueForm::Text));
        let entries = self.in_file_order().into_iter();
        let strings = entries.filter_map(|(key, value)| {
            let DeValue::String(text) = value.get_ref() else {
                self.doc.wrong_type(value, &format!("`{}`", key.get_ref()), "a string");
                return None;
            };
            Some((self.key_text(key), self.doc.text(text, value.span())))
        });
        strings.collect()
    }

    /// All entries as strings or tables, by key and in file order (the form of `change` in a test).
    pub fn texts_or_tables(
        &mut self,
        any: Key,
        place: &'static str,
    ) -> Vec<(Text, TextOrTable<'a>)> {
        if let Some((below, form)) = self.noted_below(place) {
            let form = ValueForm::TextOrTable(form);
            self.shape.iter().for_each(|shape| shape.note_others(any, form.clone()));
            return vec![(Text::default(), TextOrTable::Table(below))];
        }
        let mut entries = Vec::new();
        for (key, value) in self.in_file_order() {
            let found = match value.get_ref() {
                DeValue::String(text) => TextOrTable::Text(self.doc.text(text, value.span())),
                DeValue::Table(table) => TextOrTable::Table(self.below(table, value.span(), place)),
                _ => {
                    let what = format!("`{}`", key.get_ref());
                    self.doc.wrong_type(value, &what, "a string or a table");
                    continue;
                }
            };
            entries.push((self.key_text(key), found));
        }
        entries
    }

    /// A string, or an array of strings; none if the key is absent.
    pub fn string_or_strings(&mut self, key: Key) -> Vec<Text> {
        let Some(value) = self.get(key, ValueForm::TextOrTexts) else { return Vec::new() };
        if let DeValue::String(text) = value.get_ref() {
            return vec![self.doc.text(text, value.span())];
        }
        self.strings_of(value, key.name, "").map(|texts| texts.value).unwrap_or_default()
    }

    /// All entries as strings or bare numbers, by key and in file order (the form of `with`).
    /// `None` for a value of a wrong type, which is reported.
    pub fn scalars(&mut self, any: Key) -> Vec<(Text, Option<Text>)> {
        self.shape.iter().for_each(|shape| shape.note_others(any, ValueForm::Scalar));
        let entries = self.in_file_order();
        let scalar = |(key, value): (_, DeNode<'a>)| {
            let name = self.key_text(key);
            let text = self.scalar_of(value, &format!("`{}`", name.text));
            (name, text)
        };
        entries.into_iter().map(scalar).collect()
    }

    /// A string or a bare number, as a text.
    pub fn scalar(&mut self, key: Key) -> Option<Text> {
        let value = self.get(key, ValueForm::Scalar)?;
        self.scalar_of(value, &self.what(key.name))
    }

    fn scalar_of(&self, value: DeNode<'a>, what: &str) -> Option<Text> {
        let span = self.doc.span(value.span());
        let text = match value.get_ref() {
            DeValue::String(text) => return Some(self.doc.text(text, value.span())),
            DeValue::Float(float) => float.as_str().to_owned(),
            DeValue::Integer(integer) => {
                let number = i64::from_str_radix(integer.as_str(), integer.radix());
                number.unwrap_or(i64::MAX).to_string()
            }
            DeValue::Boolean(on) => {
                let message = format!("{what} wants a string or a number, not true or false");
                let nickname = if *on { "$On" } else { "$Off" };
                let help = format!(
                    "a bit that never changes is `\"{nickname}\"`; an output is named: `\"Y0\"`"
                );
                let status = possible(format!("\"{nickname}\""));
                self.find(Finding::new(Code::WrongType, span, message).help(help).fix(status));
                return None;
            }
            _ => {
                self.doc.wrong_type(value, what, "a string or a number");
                return None;
            }
        };
        Some(Text { text, span, exact: true })
    }
}
