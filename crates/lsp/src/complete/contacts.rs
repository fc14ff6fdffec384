//! Proposals of names in contacts, in expressions of MATH and in single operands. They depend on
//! the word before the cursor and on the sign before that word.

use std::borrow::Cow;

use lsp_types::CompletionItemKind;

use super::nature::WantedName;
use super::operands;
use super::proposal::{CompletionProposal, Proposals};
use super::scene::CompletionScene;
use rungd_engine::isa::function::FUNCTIONS;
use rungd_language::source::name_reader::{ExpressionUse, TextWord, TextWordKind, words_in};
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
    /// Whether it is a number.
    is_number: bool,
}

impl<'t> DottedWord<'t> {
    /// The word that a text ends with.
    pub fn of(before: &'t str, used: ExpressionUse) -> DottedWord<'t> {
        // With one more letter, the text ends with a word for certain.
        let word = words_in(&format!("{before}x"), used).pop();
        let Some(TextWord { place, kind, array }) = word else {
            return DottedWord { lead: before, base: None, typed: "", is_number: false };
        };
        let (lead, word) = before.split_at(place.start);
        let (base, typed) = match word.rsplit_once('.') {
            Some((base, typed)) => (Some(base), typed),
            None if array.is_none() && lead.ends_with('.') && !lead.ends_with("..") => {
                (Some(""), word)
            }
            None => (None, word),
        };
        let lead = array.as_ref().map_or(lead, |array| &before[..array.start]);
        let is_number = kind == TextWordKind::Number && array.is_none();
        let base = match (array.map(|array| &before[array]), base) {
            (Some(array), Some(fields)) => Some(format!("{array}.{fields}").into()),
            (Some(field), None) | (None, Some(field)) => Some(field.into()),
            (None, None) => None,
        };
        DottedWord { lead, base, typed, is_number }
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

/// Names for contacts, or for one operand.
pub(super) fn offer(scene: &CompletionScene, before: &str, wish: WantedName) -> Proposals {
    let word = DottedWord::of(before, ExpressionUse::Contact);
    let mut found = Proposals::of(word.typed);
    let computes = matches!(wish, WantedName::Contact | WantedName::Condition);
    let Some(wish) = word.wish(wish).filter(|_| !word.is_number) else { return found };
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
    let word = DottedWord::of(before, ExpressionUse::Math);
    let mut found = Proposals::of(word.typed);
    found.signs = "_";
    if word.wish(WantedName::Value).is_none() || word.is_number {
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
            let word = DottedWord::of(before, ExpressionUse::Contact);
            assert_eq!((word.base.as_deref(), word.typed), (base, typed), "{before}");
        }
        assert_eq!(DottedWord::of("a-b", ExpressionUse::Math).typed, "b");
    }
}
