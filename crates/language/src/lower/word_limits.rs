//! The limits of words: their ranges, narrowed by `min` and `max` of their tags.
//!
//! Called by `assembler` for the stores of a ladder, by `symbols` for writes from outside, and by
//! `testing` for constants that are stored alike.

use crate::resolve::program::{Program, TagMeaning};
use rungd_engine::isa::{Address, NumberMap, Word};

/// The limits of all words of a program.
#[derive(Clone, Debug, Default)]
pub struct WordLimits(NumberMap<Word, (i32, i32)>);

impl WordLimits {
    /// The limits that the tags of a program give.
    pub fn of(program: &Program) -> WordLimits {
        let mut limits = WordLimits::default();
        for tag in &program.tags {
            let TagMeaning::Address(Address::Word(word)) = tag.meaning else { continue };
            let (low, high) = limits.get(word);
            let low = tag.min.map_or(low, |(min, _)| low.max(min));
            let high = tag.max.map_or(high, |(max, _)| high.min(max));
            if tag.min.is_some() || tag.max.is_some() {
                limits.0.insert(word, (low, high.max(low)));
            }
        }
        limits
    }

    /// Whether a tag limits a word.
    pub fn has(&self, word: Word) -> bool {
        self.0.contains_key(&word)
    }

    /// The least and the greatest content of a word's cell.
    pub fn get(&self, word: Word) -> (i32, i32) {
        self.0.get(&word).copied().unwrap_or(word.range())
    }
}
