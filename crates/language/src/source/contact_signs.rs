//! The signs of expressions in a text of contacts, and the findings about misplaced signs.
//!
//! Called by `contact_lexer`. `expression_parser` reads the expressions; these signs only show
//! where one begins and ends.

use super::expression::Binary;
use super::finding::{Code, Finding};
use super::fix::text as written;
use super::foreign_signs;
use super::span::Span;
use rungd_engine::isa::Function;

/// The signs of MATH that are no signs of contacts, a longer one before a shorter one.
const SIGNS: [Binary; 9] = [
    Binary::ShiftLeft,
    Binary::ShiftRightZeros,
    Binary::ShiftRight,
    Binary::Power,
    Binary::Multiply,
    Binary::Divide,
    Binary::Remainder,
    Binary::Add,
    Binary::Subtract,
];

/// The sign of an expression at a place of a text, with its length; `None` if none begins there.
pub(super) fn sign(text: &str, at: usize, span: Span) -> Option<Result<(Binary, usize), Finding>> {
    let (before, rest) = (&text[..at], &text[at..]);
    if rest.starts_with(|first: char| first.is_ascii_alphanumeric()) {
        return None;
    }
    if foreign_signs::at_start(rest).is_some() {
        return None;
    }
    let sign = SIGNS.into_iter().find(|sign| rest.starts_with(sign.sign()))?;
    let length = sign.sign().len();
    let behind = &rest[length..];
    let begins_number = behind.starts_with(|c: char| c.is_ascii_digit());
    let follows_value = ends_value(before.trim_end());
    if sign == Binary::Subtract {
        if follows_value && !is_spaced_minus(text, at) {
            return Some(Err(no_spaces(text, at, span)));
        }
        if !follows_value && begins_number {
            // Part of a number.
            return None;
        }
    }
    let is_foreign = match follows_value {
        // `X0 / X1` without a compare negates `X1` elsewhere.
        true => sign == Binary::Divide && !text.contains(['<', '>', '=']),
        // `+5`, `%X0`, `/X0`.
        false => {
            (sign == Binary::Add && begins_number)
                || matches!(sign, Binary::Divide | Binary::Remainder)
        }
    };
    (!is_foreign).then_some(Ok((sign, length)))
}

/// Whether there are spaces on both sides of the minus at a place of a text.
pub(super) fn is_spaced_minus(text: &str, at: usize) -> bool {
    let behind = &text[at + 1..];
    text[..at].ends_with([' ', '\t']) && (behind.is_empty() || behind.starts_with([' ', '\t']))
}

/// Whether a text ends with a value, so that an operator may follow.
pub(super) fn ends_value(text: &str) -> bool {
    text.ends_with(|c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | ')' | ']'))
}

/// Whether a text ends with the name of a function, in any case, or with a small word that might be
/// meant as one.
pub(super) fn ends_with_function(text: &str) -> bool {
    let text = text.trim_end();
    let begin = text.rfind(|c: char| !c.is_ascii_alphanumeric()).map_or(0, |at| at + 1);
    let word = text.get(begin..).unwrap_or_default();
    let is_small = word.starts_with(|c: char| c.is_ascii_lowercase());
    (is_small && !matches!(word, "rise" | "fall"))
        || Function::from_name(&word.to_ascii_lowercase()).is_some()
}

/// The finding for a minus at a place of a text that lacks a space on one of its sides.
pub(super) fn no_spaces(text: &str, at: usize, span: Span) -> Finding {
    let start = text[..at].rfind(['&', '|', '!']).map_or(0, |sign| sign + 1);
    let end = text[at..].find(['&', '|']).map_or(text.len(), |sign| at + sign);
    let (left, right) = (text[start..at].trim(), text[at + 1..end].trim());
    let whole = &text[start..end];
    let start = start + whole.len() - whole.trim_start().len();
    let whole = span.part(start, start + whole.trim().len());
    Finding::new(Code::ContactSyntax, span.part(at, at + 1), "a minus without spaces around it")
        .write(written(format!("{left} - {right}")).at(whole))
}
