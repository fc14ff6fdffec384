//! Getters for values of a kind, for flags and numbers with a default, and for lists.

use std::ops::RangeInclusive;

use super::Table;
use crate::source::finding::Finding;
use crate::source::key::{Key, KeyLimit, NOT_EMPTY};
use crate::source::reader::Text;
use crate::source::span::{Located, Span};
use crate::source::value_kind::ValueKind;

impl Table<'_> {
    /// A value of a kind.
    pub fn value<K: ValueKind>(&mut self, key: Key, kind: &K) -> Option<Located<K::Value>> {
        let limit = match key.limit {
            KeyLimit::None => kind.limit(),
            given @ (KeyLimit::Schema(_) | KeyLimit::Refused) => given,
        };
        let text = self.string_for(Key { limit, ..key }, kind.noun(), kind.form())?;
        let value = kind.read(key.name, &text, &mut |finding| self.find(finding))?;
        Some(Located { value, span: text.span })
    }

    /// A value of a kind, without its place.
    pub fn value_of<K: ValueKind>(&mut self, key: Key, kind: &K) -> Option<K::Value> {
        self.value(key, kind).map(|located| located.value)
    }

    /// `true` or `false`; `default` if it is not given.
    pub fn flag(&mut self, key: Key, default: bool) -> bool {
        self.boolean(key).map_or(default, |flag| flag.value)
    }

    /// An integer within a range that its type can hold.
    pub fn whole<N: TryFrom<i64>>(
        &mut self,
        key: Key,
        range: RangeInclusive<i64>,
    ) -> Option<Located<N>> {
        let Located { value, span } = self.integer(key, range)?;
        Some(Located { value: N::try_from(value).ok()?, span })
    }

    /// An array of strings; empty if it is not given.
    pub fn texts(&mut self, key: Key) -> Vec<Text> {
        self.strings(key).map_or(Vec::new(), |texts| texts.value)
    }

    /// An array of at least one string; `empty` is the finding about an empty one.
    pub fn some_texts(&mut self, key: Key, empty: impl FnOnce(Span) -> Finding) -> Vec<Text> {
        let Some(texts) = self.strings(key.limited(NOT_EMPTY)) else { return Vec::new() };
        if texts.value.is_empty() && !self.doc.has_finding_in(texts.span) {
            self.find(empty(texts.span));
        }
        texts.value
    }
}
