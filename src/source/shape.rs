//! Which keys a file can have, told by its reader itself.
//!
//! [`super::ladder`] and `controller` read an empty table that notes what they ask for
//! (`of`): `rungd schema` makes a JSON Schema of it, which therefore cannot know a key that the
//! reader does not, or the other way round. Each key brings its explanation ([`super::key`]).

use std::cell::{Ref, RefCell};
use std::rc::Rc;

use toml::de::DeTable;

use super::key::Key;
use super::reader::{Doc, Table};
use super::span::FileId;

/// The keys of a table. A copy is the same shape, not another one.
#[derive(Clone, Debug, Default)]
pub struct Shape(Rc<RefCell<Noted>>);

/// What was noted of a table.
#[derive(Debug, Default)]
pub struct Noted {
    /// What the table is, in words (`a rung`).
    pub place: &'static str,
    /// Its keys, in the order in which the reader asks for them.
    pub keys: Vec<(Key, ValueForm)>,
    /// What stands behind any other key (a tag's name, a leg's).
    pub others: Option<(Key, ValueForm)>,
    /// What holds for the table as a whole, as JSON Schema.
    pub together: Vec<&'static str>,
    /// Keys that must be there.
    pub required: Vec<&'static str>,
}

/// What can stand behind a key.
#[derive(Clone, Debug)]
pub enum ValueForm {
    /// The reader looked at the value in a way of its own.
    Any,
    /// A string.
    Text,
    /// `true` or `false`.
    Flag,
    /// An integer, from and to.
    Integer(i64, i64),
    /// An array of integers, from and to.
    Integers(i64, i64),
    /// A duration: `"10ms"`.
    Duration,
    /// An integer, a duration, `true` or `false`.
    Constant,
    /// An array of strings.
    Texts,
    /// A table.
    Table(Shape),
    /// An array of tables.
    Tables(Shape),
}

impl Shape {
    pub(super) fn of_place(place: &'static str) -> Shape {
        let shape = Shape::default();
        shape.0.borrow_mut().place = place;
        shape
    }

    /// What was noted.
    pub fn noted(&self) -> Ref<'_, Noted> {
        self.0.borrow()
    }

    /// Notes a key; a later note of the same key says it better.
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

/// The shape of the files that a reader reads.
pub(crate) fn of(read: impl FnOnce(Table<'_>)) -> Shape {
    let shape = Shape::of_place("the file");
    let (findings, empty) = (RefCell::default(), DeTable::parse_recoverable("").0);
    let doc = Doc::of_nothing(FileId(0), &findings);
    read(Table::root(doc, empty.get_ref()).noting(&shape));
    shape
}
