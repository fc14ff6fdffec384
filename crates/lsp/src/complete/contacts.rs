//! Proposals of names in contacts, in expressions of MATH and in single operands. They depend on
//! the word before the cursor and on the sign before that word.

use std::borrow::Cow;
use std::ops::Range;

use lsp_types::CompletionItemKind;

use super::nature::WantedName;
use super::operands;
use super::proposal::{CompletionProposal, Proposals};
use super::scene::CompletionScene;
use rungd_engine::isa::function::FUNCTIONS;
use rungd_language::source::was::WAS;

/// The rank of functions, after the ranks of names.
const FUNCTION: u8 = 5;

/// The word before a cursor, divided at its last dot.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct DottedWord<'t> {
    /// The text before the word.
    pub lead: &'t str,
    /// The part before its last dot, without an index.
    pub base: Option<Cow<'t, str>>,
    /// The typed text of its last part.
    pub typed: &'t str,
}

impl<'t> DottedWord<'t> {
    /// The word that a text ends with. `hyphens`: whether `-` may be part of a name.
    pub fn of(before: &'t str, hyphens: bool) -> DottedWord<'t> {
        let is_part = |c: char| {
            c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '$') || (hyphens && c == '-')
        };
        let word = &before[before.trim_end_matches(is_part).len()..];
        // `D0..D9` is two words.
        let word = word.rsplit_once("..").map_or(word, |(_, last)| last);
        let word = word.trim_start_matches('-');
        let lead = &before[..before.len() - word.len()];
        if let (Some((rest, typed)), Some(array)) = (word.rsplit_once('.'), array_before(lead)) {
            let base = format!("{}{rest}", &lead[array.clone()]);
            return DottedWord { lead: &lead[..array.start], base: Some(base.into()), typed };
        }
        match word.rsplit_once('.') {
            Some((base, typed)) => DottedWord { lead, base: Some(base.into()), typed },
            None => DottedWord { lead, base: None, typed: word },
        }
    }

    /// Whether it is a number.
    fn is_number(&self) -> bool {
        self.base.as_deref().unwrap_or(self.typed).starts_with(|c: char| c.is_ascii_digit())
    }

    /// The wish after the sign before the word, in a place with `wish`; `None` after a whole name,
    /// because only a sign can follow a name.
    fn wish(&self, wish: WantedName) -> Option<WantedName> {
        let lead = self.lead.trim_end();
        let Some(last) = lead.chars().next_back() else { return Some(wish) };
        match last {
            '=' | '<' | '>' if wish == WantedName::Condition => Some(WantedName::Value),
            '+' | '*' | '/' | '%' | '-'
                if matches!(wish, WantedName::Contact | WantedName::Condition) =>
            {
                Some(WantedName::Value)
            }
            '=' | '<' | '>' | '+' | '*' | '/' | '%' | '-' | '[' => Some(WantedName::Number),
            '&' | '|' | '(' | '!' | ',' | '.' | '?' | ':' => Some(wish),
            _ => None,
        }
    }
}

/// The name of the array whose index a text ends with.
fn array_before(text: &str) -> Option<Range<usize>> {
    let inner = text.strip_suffix(']')?;
    let mut depth = 1;
    let is_open = |(_, c): &(usize, char)| {
        depth += i32::from(*c == ']') - i32::from(*c == '[');
        depth == 0
    };
    let (open, _) = inner.char_indices().rev().find(is_open)?;
    let is_part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.');
    let start = text[..open].trim_end_matches(is_part).len();
    (start < open).then_some(start..open)
}

/// Names for contacts, or for one operand.
pub(super) fn offer(scene: &CompletionScene, before: &str, wish: WantedName) -> Proposals {
    let word = DottedWord::of(before, true);
    let mut found = Proposals::of(word.typed);
    let computes = matches!(wish, WantedName::Contact | WantedName::Condition);
    let Some(wish) = word.wish(wish).filter(|_| !word.is_number()) else { return found };
    if computes && word.base.is_none() {
        offer_functions(&mut found);
    }
    if matches!(wish, WantedName::Contact | WantedName::Condition) && word.base.is_none() {
        let was = (WAS, "The value at the end of the scan before");
        let called = [
            ("rise", "ON for one execution, when its contacts go from OFF to ON"),
            ("fall", "ON for one execution, when its contacts go from ON to OFF"),
        ];
        let of_tests = (wish == WantedName::Condition).then_some(was);
        for (name, about) in called.into_iter().chain(of_tests) {
            let proposal = CompletionProposal::new(name, CompletionItemKind::FUNCTION, FUNCTION);
            let snippet = Some(format!("{name}($1)"));
            found.add(proposal.detail(about).writes(format!("{name}("), snippet));
        }
    }
    operands::offer(scene, word.base.as_deref(), wish, &mut found);
    found
}

/// Names and functions for an expression of MATH.
pub(super) fn offer_expression(scene: &CompletionScene, before: &str) -> Proposals {
    let word = DottedWord::of(before, false);
    let mut found = Proposals::of(word.typed);
    found.signs = "_";
    if word.wish(WantedName::Value).is_none() || word.is_number() {
        return found;
    }
    if word.base.is_none() {
        offer_functions(&mut found);
    }
    operands::offer(scene, word.base.as_deref(), WantedName::Value, &mut found);
    found
}

/// The functions of MATH and of contacts.
fn offer_functions(found: &mut Proposals) {
    for spec in FUNCTIONS {
        let proposal = CompletionProposal::new(spec.name, CompletionItemKind::FUNCTION, FUNCTION);
        let snippet = Some(format!("{}($1)", spec.name));
        let proposal = proposal.detail(spec.form()).doc(spec.summary);
        found.add(proposal.writes(format!("{}(", spec.name), snippet));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_split_at_their_last_dot() {
        for (before, base, typed) in [
            ("", None, ""),
            ("a & st", None, "st"),
            ("!p1.late.A", Some("p1.late"), "A"),
            ("D0..D", None, "D"),
            ("drain-pump.R", Some("drain-pump"), "R"),
            ("x > -le", None, "le"),
            ("$F", None, "$F"),
            ("recipe[st", None, "st"),
            ("recipe[2].ta", Some("recipe"), "ta"),
            ("!p1.recipe[i + a[1]].", Some("p1.recipe"), ""),
            ("x & lane[i].over.D", Some("lane.over"), "D"),
        ] {
            let word = DottedWord::of(before, true);
            assert_eq!((word.base.as_deref(), word.typed), (base, typed), "{before}");
        }
        assert_eq!(DottedWord::of("a-b", false).typed, "b");
    }
}
