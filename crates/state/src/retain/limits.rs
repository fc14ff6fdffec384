//! The limits of words in the running program. An image may hold a value outside the limits, which
//! no operator could write and no MOVE would store.
//!
//! `plan` makes and uses the limits. Structures are not included: counters and timers may exceed
//! their limits.

use std::collections::HashMap;

use super::content::{self, RetainedElement};
use rungd_engine::isa::{Address, Word};
use rungd_language::lower::Symbols;
use rungd_language::resolve::program::{Program, TagMeaning};

/// The limits of words, if they are narrower than the range of the word.
#[derive(Clone, Debug, Default)]
pub(super) struct RetainedLimits(HashMap<RetainedElement, RetainedLimit>);

#[derive(Clone, Copy, Debug)]
struct RetainedLimit {
    min: i32,
    max: i32,
    /// The value after a cold start.
    initial: i32,
}

impl RetainedLimits {
    /// The limits of a program.
    pub fn new(
        program: &Program,
        symbols: &Symbols,
        element_of: impl Fn(Address) -> Option<RetainedElement>,
    ) -> RetainedLimits {
        let mut limits: HashMap<RetainedElement, RetainedLimit> = HashMap::new();
        for tag in &program.tags {
            let TagMeaning::Address(at @ Address::Word(word @ Word::Space(..))) = tag.meaning
            else {
                continue;
            };
            let ((min, max), Some(element)) = (symbols.limits(word), element_of(at)) else {
                continue;
            };
            let limit = limits.entry(element).or_insert(RetainedLimit { min, max, initial: 0 });
            limit.initial = tag.initial.map_or(limit.initial, |(initial, _)| initial);
        }
        RetainedLimits(limits)
    }

    /// The limits of a word that has any.
    pub fn limits(&self, element: RetainedElement) -> Option<[i32; 2]> {
        self.0.get(&element).map(|limit| [limit.min, limit.max])
    }

    /// The reason why a word cannot take a value; `None` if it can.
    pub fn refuse(&self, element: RetainedElement, value: i32) -> Option<String> {
        let RetainedLimit { min, max, initial } = *self.0.get(&element)?;
        // A cold start sets the initial value anyway, so nothing is lost.
        if (min..=max).contains(&value) || value == initial {
            return None;
        }
        let [value, min, max, initial] =
            [value, min, max, initial].map(|cell| content::text(element.space, cell));
        Some(format!(
            "it was {value}, but its limits are {min} to {max} now; it begins with {initial}"
        ))
    }
}
