//! A key of a file, with its explanation and its meaning. The getters of
//! [`super::table::Table`] receive a [`Key`].
//!
//! [`super::shape`] collects the keys by reading an empty table. `rungd schema` makes a JSON Schema
//! from them, so that editors show the explanation of a key; `rungd lsp` finds names by the
//! meaning.

use super::slot::{DeclaredKind, KeySlot, Slot};

/// A key and its explanation.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// As written; `*` stands for any name.
    pub name: &'static str,
    /// Its explanation, a sentence.
    pub doc: &'static str,
    /// The limits of its value, beyond its type.
    pub limit: KeyLimit,
    /// What its value stands for.
    pub value: Slot,
    /// What it stands for itself, if it is any name.
    pub named: KeySlot,
}

/// The limits of a key's value, beyond its type.
#[derive(Clone, Copy, Debug)]
pub enum KeyLimit {
    /// No limit.
    None,
    /// The value must match this JSON Schema.
    Schema(&'static str),
    /// Every value is refused: the reader accepts the key only to make a specific finding.
    Refused,
}

/// A JSON Schema: an array of at least one element.
pub const NOT_EMPTY: &str = r#"{"minItems":1}"#;
/// A JSON Schema: the name of a block or device (grammar: `docs/language.md`).
pub const BLOCK_NAME: &str = r#"{"pattern":"^[A-Za-z][A-Za-z0-9_-]*$"}"#;

/// A key with its explanation.
pub const fn key(name: &'static str, doc: &'static str) -> Key {
    assert!(!doc.is_empty(), "a key without an explanation");
    Key { name, doc, limit: KeyLimit::None, value: Slot::Other, named: KeySlot::Word }
}

impl Key {
    /// The same, limited by a JSON Schema.
    pub const fn limited(self, schema: &'static str) -> Key {
        Key { limit: KeyLimit::Schema(schema), ..self }
    }

    /// The same; its value stands for this.
    pub const fn holds(self, value: Slot) -> Key {
        Key { value, ..self }
    }

    /// The same; its value is the name of a declaration.
    pub const fn declares(self, kind: DeclaredKind) -> Key {
        self.holds(Slot::Declares(kind))
    }

    /// The same; it is any name, and stands for this.
    pub const fn named(self, named: KeySlot) -> Key {
        Key { named, ..self }
    }

    /// Whether it, or its value, is the name of a declaration.
    pub(super) fn is_of_declaration(&self) -> bool {
        matches!(self.value, Slot::Declares(_)) || matches!(self.named, KeySlot::Declares(_))
    }

    /// The same, refused.
    pub const fn refused(self) -> Key {
        Key { limit: KeyLimit::Refused, ..self }
    }
}
