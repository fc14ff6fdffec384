//! Collects the keys that a file can have, from the file's reader itself.
//!
//! [`super::ladder`] and `controller` read an empty table that records the requested keys
//! (`reader::shape`). `rungd schema` makes a JSON Schema from the record, so the schema and the
//! reader have the same keys. Each key comes with its explanation ([`super::key`]).

use std::cell::{Ref, RefCell};
use std::rc::Rc;

use super::key::{Key, key};
use super::slot::{KeySlot, Slot};

/// A key in the `initial` of a tag.
const FIELD: Key = key("*", "A field of the tag's record.").named(KeySlot::Field);

/// The keys of a table. A clone shares the same record.
#[derive(Clone, Debug, Default)]
pub struct TableShape(Rc<RefCell<NotedKeys>>);

/// The record of a table.
#[derive(Debug, Default)]
pub struct NotedKeys {
    /// The table's kind, in words (`a rung`).
    pub place: &'static str,
    /// Its keys, in the order in which the reader requests them.
    pub keys: Vec<(Key, ValueForm)>,
    /// The value of any other key (a tag's name, a leg's name).
    pub others: Option<(Key, ValueForm)>,
    /// JSON Schemas for the table as a whole.
    pub together: Vec<&'static str>,
    /// Required keys.
    pub required: Vec<&'static str>,
}

/// The type of a key's value.
#[derive(Clone, Debug)]
pub enum ValueForm {
    /// Any type; the reader inspects the value itself.
    Any,
    /// A string.
    Text,
    /// One of these words.
    Words(Vec<&'static str>),
    /// `true` or `false`.
    Flag,
    /// An integer, with its least and greatest value.
    Integer(i64, i64),
    /// An array of integers, with their least and greatest value.
    Integers(i64, i64),
    /// A duration: `"10ms"`.
    Duration,
    /// A scan period: `"10ms"`, `"250us"`.
    Period,
    /// A number, a duration, `true` or `false`.
    Constant,
    /// A constant, or an array of constants.
    Constants,
    /// A string or a number.
    Scalar,
    /// An array of strings.
    Texts,
    /// A string, or an array of strings.
    TextOrTexts,
    /// A string, or a table.
    TextOrTable(TableShape),
    /// A table.
    Table(TableShape),
    /// An array of tables.
    Tables(TableShape),
}

impl ValueForm {
    /// The keys of a value that is a table, or of its elements if they are tables.
    pub fn below(&self) -> Option<&TableShape> {
        match self {
            ValueForm::Table(shape) | ValueForm::Tables(shape) | ValueForm::TextOrTable(shape) => {
                Some(shape)
            }
            ValueForm::Any
            | ValueForm::Text
            | ValueForm::Words(_)
            | ValueForm::Flag
            | ValueForm::Integer(..)
            | ValueForm::Integers(..)
            | ValueForm::Duration
            | ValueForm::Period
            | ValueForm::Constant
            | ValueForm::Constants
            | ValueForm::Scalar
            | ValueForm::Texts
            | ValueForm::TextOrTexts => None,
        }
    }
}

impl TableShape {
    pub(super) fn of_place(place: &'static str) -> TableShape {
        let shape = TableShape::default();
        shape.0.borrow_mut().place = place;
        shape
    }

    /// The record.
    pub fn noted(&self) -> Ref<'_, NotedKeys> {
        self.0.borrow()
    }

    /// The key at the end of a path from this table on, with the form of its value.
    pub fn entry(&self, path: &[&str]) -> Option<(Key, ValueForm)> {
        let (first, rest) = path.split_first()?;
        let (key, form) = {
            let noted = self.noted();
            let known = noted.keys.iter().find(|(key, _)| key.name == *first);
            known.or(noted.others.as_ref())?.clone()
        };
        match rest.is_empty() {
            true => Some((key, form)),
            false => form.below()?.entry(rest),
        }
    }

    /// The key at the end of a path from this table on, also if the path has a mistake: a bracket
    /// that is not closed, a header that is missing, a table that is written wrong.
    pub fn key<'p>(&self, mut path: impl Iterator<Item = &'p str> + Clone) -> Option<Key> {
        let whole = path.clone();
        let first = path.next()?;
        let is_last = path.clone().next().is_none();
        let noted = self.noted();
        let known = noted.keys.iter().find(|(key, _)| key.name == first);
        match known.or(noted.others.as_ref()) {
            Some((key, _)) if is_last => Some(*key),
            Some((key, _)) if key.value == Slot::Initial => Some(FIELD),
            Some((_, form)) => form.below().unwrap_or(self).key(path),
            None if let Some(table) = self.with_key(first) => table.key(whole),
            None => {
                let table = self.with_key(path.clone().next()?)?;
                table.key(path).filter(|key| !key.is_of_declaration())
            }
        }
    }

    /// This table, or the first one below it, that has a key which is not any name.
    fn with_key(&self, name: &str) -> Option<TableShape> {
        let noted = self.noted();
        if noted.keys.iter().any(|(key, _)| key.name == name) {
            return Some(self.clone());
        }
        let mut below = noted.keys.iter().filter_map(|(_, form)| form.below());
        below.find_map(|below| below.with_key(name))
    }

    /// Records a key; a later record of the same key replaces the earlier one.
    pub(super) fn note(&self, key: Key, form: ValueForm) {
        let mut noted = self.0.borrow_mut();
        match noted.keys.iter_mut().find(|(known, _)| known.name == key.name) {
            Some(known) => *known = (key, form),
            None => noted.keys.push((key, form)),
        }
    }

    pub(super) fn note_others(&self, any: Key, form: ValueForm) {
        self.0.borrow_mut().others = Some((any, form));
    }

    pub(super) fn note_together(&self, schema: &'static str) {
        self.0.borrow_mut().together.push(schema);
    }

    pub(super) fn note_required(&self, key: &'static str) {
        self.0.borrow_mut().required.push(key);
    }
}
