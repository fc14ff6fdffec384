//! Getters for constants: numbers, durations, `true` and `false`.
// `_` matches the values that TOML allows and a ladder does not; the enum is the parser's.
#![allow(clippy::wildcard_enum_match_arm)]

use toml::de::DeValue;

use super::{Constant, DeNode, InitialRecords, Table, ValueForm, WrittenInitial};
use crate::source::atom::{Atom, AtomKind};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{advise, possible};
use crate::source::key::Key;
use crate::source::reader::Text;
use crate::source::span::Located;

impl<'a> Table<'a> {
    /// A constant: an integer, `true` or `false`, or a string that contains a constant.
    pub fn constant(&mut self, key: Key) -> Option<Located<Constant>> {
        let value = self.get(key, ValueForm::Constant)?;
        self.constant_of(value, key.name)
    }

    /// One constant or a list of constants; of records a table, or a list of tables.
    pub fn initial(&mut self, key: Key) -> WrittenInitial {
        let mut initial = WrittenInitial::default();
        let Some(value) = self.get(key, ValueForm::Constants) else { return initial };
        let span = self.doc.span(value.span());
        let is_table = |value: &DeValue<'_>| matches!(value, DeValue::Table(_));
        match value.get_ref() {
            DeValue::Table(_) => {
                let values = vec![self.fields_of(value, key.name)];
                let records = InitialRecords { is_list: false, values };
                initial.records = Some(Located { value: records, span });
            }
            DeValue::Array(items) if items.iter().any(|item| is_table(item.get_ref())) => {
                let values = items.iter().map(|item| self.fields_of(item, key.name)).collect();
                let records = InitialRecords { is_list: true, values };
                initial.records = Some(Located { value: records, span });
            }
            DeValue::Array(items) => {
                let each = items.iter().filter_map(|item| self.constant_of(item, key.name));
                initial.list = Some(Located { value: each.collect(), span });
            }
            _ => initial.one = self.constant_of(value, key.name),
        }
        initial
    }

    /// The values of a record's fields, in file order.
    fn fields_of(&self, value: DeNode<'a>, key: &str) -> Vec<(Text, Located<Constant>)> {
        let DeValue::Table(table) = value.get_ref() else {
            self.doc.wrong_type(value, &self.what(key), "tables of values");
            return Vec::new();
        };
        let fields = self.below(table, value.span(), "a record").in_file_order().into_iter();
        let fields = fields
            .filter_map(|(name, value)| Some((self.key_text(name), self.constant_of(value, key)?)));
        fields.collect()
    }

    pub(super) fn constant_of(&self, value: DeNode<'a>, key: &str) -> Option<Located<Constant>> {
        let span = self.doc.span(value.span());
        match value.get_ref() {
            DeValue::Boolean(on) => Some(Located { value: Constant::Bit(*on), span }),
            DeValue::Integer(_) => {
                let integer = self.number(value, key, &(i32::MIN.into()..=i32::MAX.into()))?;
                Some(Located { value: Constant::Integer(i32::try_from(integer).ok()?), span })
            }
            DeValue::Float(float) => {
                let text = Text { text: float.as_str().to_owned(), span, exact: true };
                self.constant_text(key, &text)
            }
            DeValue::String(text) => self.constant_text(key, &self.doc.text(text, value.span())),
            _ => {
                self.doc.wrong_type(value, &self.what(key), "a number or a duration");
                None
            }
        }
    }

    fn constant_text(&self, key: &str, text: &Text) -> Option<Located<Constant>> {
        let value = match Atom::parse(&text.text, text.span).map(|atom| atom.kind) {
            Ok(AtomKind::Integer(n)) => Constant::Integer(n),
            Ok(AtomKind::Duration(ms)) => Constant::Duration(ms),
            Ok(AtomKind::Real(real)) => Constant::Real(real),
            Ok(AtomKind::Name(name)) => {
                let message = format!("{} is a constant, not `{name}`", self.what(key));
                let finding = Finding::new(Code::WrongType, text.span, message);
                let words = "write a number, or a duration as `{}`";
                self.find(finding.help(advise(words, [possible("\"2s500ms\"")])));
                return None;
            }
            Err(mut finding) => {
                if finding.code == Code::InstructionSyntax {
                    finding.code = Code::WrongType;
                }
                self.find(finding);
                return None;
            }
        };
        Some(Located { value, span: text.span })
    }
}
