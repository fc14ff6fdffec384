//! Words in braces in the texts of a template's tags: `{name}`, `{patience}`.

use std::ops::Range;

use crate::source::atom::{is_name, is_name_letter};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Fix, Help, possible, write};
use crate::source::nearest::{KnownNames, UnknownName};
use crate::source::span::Span;

/// The pieces of a text. Each is a plain text, and the word in braces behind it, if there is one.
fn pieces(text: &str) -> impl Iterator<Item = (&str, Option<&str>)> {
    let mut rest = text;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        // Thousands of `{` may stand before one `}`, which is then looked for once.
        let mut next = None;
        for (open, _) in rest.match_indices('{') {
            let close = match next.filter(|close| *close > open) {
                Some(close) => close,
                None => match rest[open..].find('}') {
                    Some(behind) => open + behind,
                    None => break,
                },
            };
            let word = &rest[open + 1..close];
            if is_name(word) {
                let plain = &rest[..open];
                rest = &rest[close + 1..];
                return Some((plain, Some(word)));
            }
            next = Some(close);
        }
        Some((std::mem::take(&mut rest), None))
    })
}

/// The places of the words in braces, without their braces.
pub fn placeholders(text: &str) -> impl Iterator<Item = Range<usize>> {
    let mut end = 0;
    pieces(text).filter_map(move |(plain, word)| {
        let start = end + plain.len() + 1;
        end = start + word?.len() + 1;
        Some(start..end - 1)
    })
}

/// The findings about braces: an unknown word, and a brace that is not closed.
pub(super) fn check(text: &str, span: Span, known: &KnownNames) -> Vec<Finding> {
    let holds = "a text may hold `{name}`, the use's name, and parameters in braces";
    let find = |message: String| Finding::new(Code::TemplateRule, span, message);
    // The text of a `doc` is not at the place of its findings.
    let is_there = (span.end - span.start) as usize == text.len();
    let place = |start: usize, length: usize| is_there.then(|| span.part(start, start + length));
    let mut findings = Vec::new();
    let mut end = 0;
    for (plain, word) in pieces(text) {
        let start = end;
        end += plain.len() + word.map_or(0, |word| word.len() + 2);
        if let Some(open) = unclosed(plain) {
            let begin: String = plain[open..].chars().take(SHOWN_MAX).collect();
            let word = begin[1..].trim_start().split(|c: char| !is_name_letter(c)).next();
            let help = match word.filter(|word| known.has(word)) {
                Some(word) => {
                    let length = plain[open..].find(word).unwrap_or(0) + word.len();
                    let right = Fix::from(format!("{{{word}}}"));
                    write(match place(start + open, length) {
                        Some(place) => right.at(place),
                        None => right,
                    })
                }
                None => Help::from(format!("{holds}; braces in pairs, as `{{}}`, are plain text"))
                    .with(possible("{}")),
            };
            findings.push(find(format!("the brace of `{begin}` is not closed")).help(help));
        }
        if let Some(word) = word.filter(|word| !known.has(word)) {
            let finding =
                find(format!("`{{{word}}}` is neither `{{name}}` nor a parameter")).help(holds);
            let near = UnknownName::new(word, known).at(place(end - word.len() - 1, word.len()));
            findings.push(finding.near_any(Some(Box::new(near))));
        }
    }
    findings
}

/// Maximum number of characters of a text that a finding quotes.
const SHOWN_MAX: usize = 20;

/// The first opening brace without its closing one.
fn unclosed(plain: &str) -> Option<usize> {
    let is_closed = |at: &usize| {
        plain[at + 1..].find(['{', '}']).is_some_and(|end| plain[at + 1 + end..].starts_with('}'))
    };
    plain.match_indices('{').map(|(at, _)| at).find(|at| !is_closed(at))
}

/// The text with the words in braces replaced by their values.
pub(super) fn filled(text: &str, value: impl Fn(&str) -> Option<String>) -> String {
    let mut filled = String::new();
    for (plain, word) in pieces(text) {
        filled.push_str(plain);
        let Some(word) = word else { continue };
        match value(word) {
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
    fn unknown_words_and_unpaired_braces_are_reported() {
        let said = |text: &str| {
            let known = KnownNames::new(["name", "patience"]);
            let findings = check(text, Span::default(), &known);
            let help = |of: &Finding| of.help_text().unwrap_or_default().into_owned();
            let said = findings.iter().map(|of| format!("{} ({})", of.message, help(of)));
            said.collect::<Vec<_>>().join("; ")
        };
        for text in ["", "{name}", "} name}", "{}, { } and {1}: {patience}", "{ name }"] {
            assert_eq!(said(text), "", "{text}");
        }
        assert_eq!(said("{name"), "the brace of `{name` is not closed (write `{name}`)");
        assert_eq!(
            said("{ name: late"),
            "the brace of `{ name: late` is not closed (write `{name}`)"
        );
        assert_eq!(
            said("{nam}"),
            "`{nam}` is neither `{name}` nor a parameter (did you mean `name`?)"
        );
        let lone = said("{name}: {");
        assert!(
            lone.starts_with("the brace of `{` is not closed (a text may hold `{name}`"),
            "{lone}"
        );
        let two = said("{a {name} {b");
        assert_eq!(two.matches("is not closed").count(), 2, "{two}");
    }

    #[test]
    fn a_text_of_many_braces_is_read_in_one_pass() {
        let braces = format!("{}}} {{name}}", "{".repeat(2_000_000));
        let pieces: Vec<_> = pieces(&braces).collect();
        assert_eq!(pieces.len(), 1);
        assert_eq!(pieces[0].1, Some("name"));
    }

    #[test]
    fn known_words_in_braces_are_replaced_and_other_text_is_kept() {
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
