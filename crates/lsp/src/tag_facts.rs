//! The keys of a declared tag or parameter, with their values as written.
//!
//! Completion, hover and the live view read them. They check nothing: a tag with a mistake in its
//! declaration still has its keys.

use super::file::EditorFile;
use super::names::Declaration;
use super::outline::KeyPair;
use rungd_engine::isa::address_text;
use rungd_engine::isa::{Address, MemorySizes, Word};
use rungd_language::resolve::ParameterKind;
use rungd_language::resolve::places::space_of;

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

    /// An element of the kind that a tag or parameter names, of any number; `None` for a constant
    /// and for a record.
    pub fn element(&self) -> Option<Address> {
        match self.text("at") {
            Some(_) => self.address(),
            None => element_of(self.text("type")?),
        }
    }

    /// The word that a tag or parameter names, of any number.
    pub fn word(&self) -> Option<Word> {
        match self.element()? {
            Address::Word(word) => Some(word),
            Address::Bit(_) | Address::Structure(_) => None,
        }
    }

    /// The address of a tag; `None` if it has none, or a text that is none.
    pub fn address(&self) -> Option<Address> {
        address_text::parse(self.text("at")?, &MemorySizes::default()).ok()
    }
}

/// An element of the type of a tag or parameter, of any number.
fn element_of(type_name: &str) -> Option<Address> {
    let parameter = || ParameterKind::from_name(type_name)?.trial_type();
    let space = space_of(type_name).or_else(|| space_of(parameter()?))?;
    Some(space.address(0))
}
