//! The keys of a declared tag or parameter, with their values as written.
//!
//! Completion, hover and the live view read them. They check nothing: a tag with a mistake in its
//! declaration still has its keys.

use super::file::EditorFile;
use super::names::Declaration;
use super::outline::KeyPair;
use rungd_engine::isa::address_text;
use rungd_engine::isa::{Address, MemorySizes, Word, WordSpace};

/// The keys of a tag or parameter, with their values as written.
pub(super) struct TagFacts<'f>(Vec<(&'f str, &'f str)>);

impl<'f> TagFacts<'f> {
    /// The keys of a declaration, from the pairs that follow its own pair.
    pub fn of(declared: &Declaration, file: &'f EditorFile) -> TagFacts<'f> {
        let outline = &file.outline;
        let own = &outline.pairs[declared.pair];
        let length = own.keys.iter().position(|key| key.span.start == declared.span.start);
        let length = length.map_or(own.keys.len(), |at| at + 1);
        let is_same = |pair: &&KeyPair| {
            let mut both = pair.keys.iter().zip(&own.keys).take(length);
            pair.object == own.object
                && pair.keys.len() >= length
                && both.all(|(a, b)| a.text == b.text)
        };
        let numbers = declared.pair..outline.pairs.len();
        let pairs = outline.pairs[numbers.clone()].iter().take_while(is_same).zip(numbers);
        let fact = |(pair, number): (&'f KeyPair, usize)| {
            let key = pair.keys.get(length)?;
            let text = outline.value_of[number]
                .map_or("", |value| file.slice(outline.values[value].inner.clone()));
            Some((key.text.as_str(), text))
        };
        TagFacts(pairs.filter_map(fact).collect())
    }

    /// The value of a key, without quotes.
    pub fn text(&self, key: &str) -> Option<&'f str> {
        self.0.iter().find(|(name, _)| *name == key).map(|(_, text)| *text)
    }

    /// The word that a tag or parameter names, of any number.
    pub fn word(&self) -> Option<Word> {
        match (self.address(), self.text("type")) {
            (Some(Address::Word(word)), _) => Some(word),
            (None, Some("int" | "int-out")) => Some(Word::Space(WordSpace::D, 0)),
            (None, Some("word")) => Some(Word::Space(WordSpace::V, 0)),
            (Some(Address::Bit(_) | Address::Structure(_)), _) | (None, Some(_) | None) => None,
        }
    }

    /// The address of a tag; `None` if it has none, or a text that is none.
    pub fn address(&self) -> Option<Address> {
        address_text::parse(self.text("at")?, &MemorySizes::default()).ok()
    }
}
