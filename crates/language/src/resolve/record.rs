//! Tags of records: which tags of the program are their fields.
//!
//! Made by `record_tags`, kept by the program and its scope. A field is a tag of its own, so that
//! only names of whole records need this.

use std::ops::Range;

use crate::source::span::Span;
use rungd_engine::isa::Word;

/// A tag whose type is a record.
#[derive(Clone, Debug)]
pub struct RecordTag {
    /// Its whole name: `recipe`, `p1.recipe`.
    pub name: String,
    /// The name of the record.
    pub record: String,
    /// The place of its name.
    pub span: Span,
    /// `doc`.
    pub doc: Option<String>,
    /// The number of records, if it has a `count`.
    pub count: Option<u32>,
    /// Its fields, in the order of the record.
    pub fields: Vec<RecordField>,
}

/// A field of a tag of records.
#[derive(Clone, Debug)]
pub struct RecordField {
    /// The name in the record: `target`.
    pub name: String,
    /// The index of its tag in the program; of an array, of that of element 0. `None` for a field
    /// with a mistake.
    pub tag: Option<usize>,
}

/// A field of a tag of records.
#[derive(Clone, Copy, Debug)]
pub struct NamedField<'r> {
    /// The name of the record.
    pub record: &'r str,
    /// The name of the field.
    pub field: &'r str,
}

/// A whole record, or an array of records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordPlace {
    /// The index of its tag among the tags of records.
    pub tag: usize,
    /// Which of its records.
    pub at: RecordIndex,
}

/// Which records of a tag are named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordIndex {
    /// The only one.
    Only,
    /// All of an array.
    All,
    /// One of an array.
    Constant(u32),
    /// The one that a word selects.
    Word(Word),
}

impl RecordPlace {
    /// The kind of thing, in words.
    pub fn words(self) -> &'static str {
        match self.at {
            RecordIndex::All => "an array of records",
            RecordIndex::Only | RecordIndex::Constant(_) | RecordIndex::Word(_) => "a record",
        }
    }

    /// The number of its record in its array; `None` for all of them.
    pub fn number(self) -> Option<u32> {
        match self.at {
            RecordIndex::Constant(at) => Some(at),
            RecordIndex::Only | RecordIndex::All | RecordIndex::Word(_) => None,
        }
    }
}

impl RecordTag {
    /// The name of a record: `recipe`, `recipe[3]`.
    pub fn record_name(&self, at: Option<u32>) -> String {
        match at {
            Some(at) => format!("{}[{at}]", self.name),
            None => self.name.clone(),
        }
    }

    /// The field with a name: `current.target`, `recipe[3].target`.
    pub fn field_named(&self, name: &str) -> Option<NamedField<'_>> {
        let rest = name.strip_prefix(&self.name)?;
        let behind = match rest.strip_prefix('[') {
            Some(indexed) => indexed.split_once(']')?.1,
            None => rest,
        };
        let behind = behind.strip_prefix('.')?;
        let field = self.fields.iter().find(|field| field.name == behind)?;
        Some(NamedField { record: &self.record, field: &field.name })
    }

    /// The indices in the program of the tags of one record, or of all of an array, record by
    /// record.
    pub fn tags(&self, at: Option<u32>) -> impl Iterator<Item = usize> + '_ {
        self.numbers(at).flat_map(move |at| {
            let tags = self.fields.iter().filter_map(|field| field.tag);
            tags.map(move |tag| tag + at as usize)
        })
    }

    /// The names of the fields of one record, or of all of an array, record by record.
    pub fn names(&self, at: Option<u32>) -> impl Iterator<Item = String> + '_ {
        self.numbers(at).flat_map(move |at| {
            let record = self.record_name(self.count.map(|_| at));
            self.fields.iter().map(move |field| format!("{record}.{}", field.name))
        })
    }

    /// The names of its fields, in the order of the record.
    pub(super) fn field_names(&self) -> Vec<&str> {
        self.fields.iter().map(|field| field.name.as_str()).collect()
    }

    fn numbers(&self, at: Option<u32>) -> Range<u32> {
        at.map_or(0..self.count.unwrap_or(1), |at| at..at + 1)
    }
}
