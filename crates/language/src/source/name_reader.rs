//! The names and numbers of a text that may be incomplete: contacts, an operand, an expression.
//!
//! Editors read a text with it at every key press. The lexers of contacts and expressions say how
//! long a name or number is; unlike them, this reader passes over everything else, so it makes no
//! finding and cannot fail. It looks up no name.

use std::ops::Range;

use super::contact::Edge;
use super::contact_lexer::element_length;
pub use super::expression_lexer::ExpressionUse;
use super::expression_lexer::{name_length, number_length};
use super::was::WAS;
use rungd_engine::isa::Function;

/// A name or number in a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextWord {
    /// Its place.
    pub place: Range<usize>,
    /// Its kind.
    pub kind: TextWordKind,
    /// The name before it, if an index and a dot are between them: `recipe` of `recipe[3].target`.
    pub array: Option<Range<usize>>,
}

/// The kind of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextWordKind {
    /// A name of the program, or an incomplete one: `D0`, `late.`.
    Name,
    /// A number or duration.
    Number,
    /// A function, with a parenthesis after it.
    Function(Function),
    /// `rise`, `fall` or `was`, with a parenthesis after it.
    Called,
}

/// The names and numbers of a text, in order. A name in an index comes after the name of its array.
pub fn words_in(text: &str, used: ExpressionUse) -> Vec<TextWord> {
    let mut found: Vec<TextWord> = Vec::new();
    // The names before the open brackets, and the name whose index ends at a byte.
    let (mut open, mut closed) = (Vec::new(), None);
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let length = word_length(&text[at..], first, used);
        let place = at..at + length.max(first.len_utf8());
        at = place.end;
        if first == '[' {
            let array = found.last().filter(|word| word.place.end == place.start);
            open.push(array.map(|word| word.place.clone()));
        } else if first == ']' {
            closed = open.pop().flatten().map(|array| (array, at));
        } else if length > 0 {
            let is_behind = |end: usize| text[end..place.start] == *".";
            let array = closed.take().filter(|(_, end)| is_behind(*end)).map(|(array, _)| array);
            let kind = kind(&text[place.clone()], &text[at..], used);
            found.push(TextWord { place, kind, array });
        }
    }
    found
}

/// The length of the name or number at the start of a text; 0 if none begins there.
fn word_length(rest: &str, first: char, used: ExpressionUse) -> usize {
    let length = match first {
        '0'..='9' => number_length(rest),
        'A'..='Z' | 'a'..='z' | '_' | '$' => name_length(rest, used),
        _ => return 0,
    };
    // `D0..D9` is two names.
    let length = rest[..length].find("..").unwrap_or(length);
    let is_counter = &rest[..length] == "N" && used == ExpressionUse::Contact;
    length + if is_counter { element_length("N", &rest[length..]) } else { 0 }
}

fn kind(word: &str, behind: &str, used: ExpressionUse) -> TextWordKind {
    if word.starts_with(|first: char| first.is_ascii_digit()) {
        return TextWordKind::Number;
    }
    if !behind.trim_start_matches([' ', '\t']).starts_with('(') {
        return TextWordKind::Name;
    }
    let is_edge = || [Edge::Rise.name(), Edge::Fall.name(), WAS].contains(&word);
    match Function::from_name(word) {
        Some(function) => TextWordKind::Function(function),
        None if used == ExpressionUse::Contact && is_edge() => TextWordKind::Called,
        None => TextWordKind::Name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, used: ExpressionUse, wanted: &[&str]) {
        let names = |word: &TextWord| match word.kind {
            TextWordKind::Name => Some(text[word.place.clone()].to_owned()),
            TextWordKind::Number => None,
            kind @ (TextWordKind::Function(_) | TextWordKind::Called) => Some(format!("{kind:?}")),
        };
        let found: Vec<String> = words_in(text, used).iter().filter_map(names).collect();
        assert_eq!(found, wanted, "{text}");
    }

    #[test]
    fn an_incomplete_text_has_its_names() {
        let contacts = |text, wanted: &[&str]| check(text, ExpressionUse::Contact, wanted);
        contacts("rise(a & !b.Done", &["Called", "a", "b.Done"]);
        contacts("r[i + a[", &["r", "i", "a"]);
        contacts("D0..D9 | Z.", &["D0", "D9", "Z."]);
        contacts("drain-pump.Running & a -", &["drain-pump.Running", "a"]);
        contacts("D0 >= -3s & abs ( x - 0x1F", &["D0", "Function(Abs)", "x"]);
        contacts("N,19,6 > ä & $On", &["N,19,6", "$On"]);
        check("a-b * rise(2e-3", ExpressionUse::Math, &["a", "b", "rise"]);
    }

    #[test]
    fn a_field_behind_an_index_has_its_array() {
        let array = |text: &str| words_in(text, ExpressionUse::Contact).pop()?.array;
        assert_eq!(array("r[i + a[1]].kind"), Some(0..1));
        assert_eq!(array("r[2] & kind"), None);
    }
}
