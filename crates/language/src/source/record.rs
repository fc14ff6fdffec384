//! Records as written: named lists of fields.
//!
//! Called by the reader of ladder files. A field is read as a tag without a place. The resolver
//! makes the tags of records: one for each field. No name is looked up here.

use std::collections::BTreeMap;

use super::key::key;
use super::reader::{Table, Text};
use super::slot::DeclaredKind;
use super::span::Span;
use super::tag::{self, WrittenTag};

/// A record.
#[derive(Clone, Debug)]
pub struct WrittenRecord {
    /// The place of its header.
    pub span: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `doc`.
    pub doc: Option<String>,
    /// `[record.fields]`, in file order.
    pub fields: Vec<WrittenTag>,
}

/// The records of all files, by their names.
pub(crate) type Records = BTreeMap<String, WrittenRecord>;

/// The name of a record; its grammar is that of a tag's.
const NAME: &str = r#"{"pattern":"^[A-Za-z][A-Za-z0-9_]*$"}"#;

/// Reads a record.
pub(super) fn read(mut table: Table<'_>) -> WrittenRecord {
    table.require("fields", "{ … }");
    let record = WrittenRecord {
        span: table.span(),
        name: table.required_string(
            key("name", "Its name, a `type` of tags.").limited(NAME).declares(DeclaredKind::Record),
        ),
        doc: table.string(key("doc", "What it is.")).map(|doc| doc.text),
        fields: tag::read_fields(&mut table),
    };
    table.finish();
    record
}
