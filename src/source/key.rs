//! A key of a file, with its explanation: what a getter of [`super::table::Table`] asks for.
//!
//! The reader notes both where it reads an empty table ([`super::shape`]); `rungd schema` makes a
//! JSON Schema of them, and so the editors that read it show what a key is for.

/// A key, and its meaning.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// As written; `*` stands for any name.
    pub name: &'static str,
    /// Its explanation, a sentence.
    pub doc: &'static str,
    /// What its value can be, beyond its type.
    pub limit: Limit,
}

/// What the value of a key can be, beyond its type.
#[derive(Clone, Copy, Debug)]
pub enum Limit {
    /// Everything.
    None,
    /// What this JSON Schema takes.
    Schema(&'static str),
    /// One of these words.
    Words(fn() -> Vec<&'static str>),
    /// Nothing: the reader knows the key only to refuse it.
    Refused,
}

/// An array of at least one.
pub const NOT_EMPTY: &str = r#"{"minItems":1}"#;
/// A duration that is not nothing.
pub const LEAST_1MS: &str = r#"{"not":{"const":"0ms"}}"#;
/// The name of a block or device; the grammar in `docs/language.md`.
pub const BLOCK_NAME: &str = r#"{"pattern":"^[A-Za-z][A-Za-z0-9_-]*$"}"#;

/// A key with its explanation.
pub const fn key(name: &'static str, doc: &'static str) -> Key {
    assert!(!doc.is_empty(), "a key without an explanation");
    Key { name, doc, limit: Limit::None }
}

impl Key {
    /// The same, limited to what a JSON Schema takes.
    pub const fn limited(self, schema: &'static str) -> Key {
        Key { limit: Limit::Schema(schema), ..self }
    }

    /// The same, limited to some words.
    pub const fn one_of(self, words: fn() -> Vec<&'static str>) -> Key {
        Key { limit: Limit::Words(words), ..self }
    }

    /// The same, refused.
    pub const fn refused(self) -> Key {
        Key { limit: Limit::Refused, ..self }
    }
}

/// The words of a table of named things.
pub fn words<T>(named: &[(&'static str, T)]) -> Vec<&'static str> {
    named.iter().map(|(word, _)| *word).collect()
}
