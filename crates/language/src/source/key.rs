//! A key of a file, with its explanation. The getters of [`super::table::Table`] receive a [`Key`].
//!
//! [`super::shape`] collects the keys by reading an empty table. `rungd schema` makes a JSON Schema
//! from them, so that editors show the explanation of a key.

/// A key and its explanation.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// As written; `*` stands for any name.
    pub name: &'static str,
    /// Its explanation, a sentence.
    pub doc: &'static str,
    /// The limits of its value, beyond its type.
    pub limit: KeyLimit,
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
    Key { name, doc, limit: KeyLimit::None }
}

impl Key {
    /// The same, limited by a JSON Schema.
    pub const fn limited(self, schema: &'static str) -> Key {
        Key { limit: KeyLimit::Schema(schema), ..self }
    }

    /// The same, refused.
    pub const fn refused(self) -> Key {
        Key { limit: KeyLimit::Refused, ..self }
    }
}
