//! `{name}` and `{patience}` in the texts of a template's tags.

use crate::source::finding::{Code, Finding};
use crate::source::nearest::did_you_mean;
use crate::source::span::Span;

/// The pieces of a text: each a plain text, then a word in braces, if one follows.
fn pieces(text: &str) -> impl Iterator<Item = (&str, Option<&str>)> {
    let mut rest = text;
    let is_word = |word: &str| {
        let letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
        word.starts_with(|c: char| c.is_ascii_alphabetic()) && word.chars().all(letter)
    };
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        for (open, _) in rest.match_indices('{') {
            let Some(close) = rest[open..].find('}') else { break };
            let word = &rest[open + 1..open + close];
            if is_word(word) {
                let plain = &rest[..open];
                rest = &rest[open + close + 1..];
                return Some((plain, Some(word)));
            }
        }
        Some((std::mem::take(&mut rest), None))
    })
}

/// The findings about words in braces that nothing stands for.
pub(super) fn check(text: &str, span: Span, known: &[&str]) -> Vec<Finding> {
    let words = pieces(text).filter_map(|(_, word)| word);
    let finding = |word: &str| {
        let message = format!("`{{{word}}}` stands for nothing");
        let help = did_you_mean(word, known.iter().copied()).unwrap_or_else(|| {
            "a text may hold `{name}`, the use's name, and parameters in braces".to_owned()
        });
        Finding::new(Code::TemplateRule, span, message).help(help)
    };
    words.filter(|word| !known.contains(word)).map(finding).collect()
}

/// The text with what the words in braces stand for.
pub(super) fn filled(text: &str, of: impl Fn(&str) -> Option<String>) -> String {
    let mut filled = String::new();
    for (plain, word) in pieces(text) {
        filled.push_str(plain);
        let Some(word) = word else { continue };
        match of(word) {
            Some(stands) => filled.push_str(&stands),
            None => filled.push_str(&format!("{{{word}}}")),
        }
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_in_braces_are_filled_and_the_rest_stays() {
        let check = |text: &str, expected: &str| {
            let of = |word: &str| (word == "name").then(|| "p1".to_owned());
            assert_eq!(filled(text, of), expected, "{text}");
        };
        check("{name}: late", "p1: late");
        check("{name}{name}", "p1p1");
        check("{a {name} } {", "{a p1 } {");
        check("{} { name } {1} {x}", "{} { name } {1} {x}");
        check("", "");
    }
}
