//! The signs of sums in a text, and the findings about misplaced signs.
//!
//! Called by `contact_lexer` and the parsers for conditions of tests; contacts of a ladder have no
//! sums.

use super::contact_sum::SumSign;
use super::finding::{Code, Finding};
use super::fix::text as written;
use super::span::Span;

/// The help for an operator or a function that only MATH has.
pub(super) const SIGNS_ALONE: &str = "a condition computes with `+ - * / %` and, in \
                                      parentheses, `&` alone: let a MATH of the ladder compute \
                                      this, and compare its result";

/// All signs of sums that are no sign of contacts.
const SIGNS: [SumSign; 5] =
    [SumSign::Add, SumSign::Subtract, SumSign::Multiply, SumSign::Divide, SumSign::Remainder];

/// The sign of a sum at a place of a text, with its length; `None` if no such sign begins there.
pub(super) fn sign(text: &str, at: usize, span: Span) -> Option<Result<(SumSign, usize), Finding>> {
    let (before, rest) = (&text[..at], &text[at..]);
    let first = rest.chars().next()?;
    let behind = &rest[first.len_utf8()..];
    let follows_value =
        before.trim_end().ends_with(|c: char| c.is_ascii_alphanumeric() || "_)]".contains(c));
    let alone = |length: usize| {
        let place = span.part(at, at + length);
        let message = format!("`{}` in a condition", &rest[..length]);
        Some(Err(Finding::new(Code::ContactSyntax, place, message).help(SIGNS_ALONE)))
    };
    if rest.starts_with("**") {
        return alone(2);
    }
    if first == '^' && follows_value {
        return alone(1);
    }
    let sign = SIGNS.into_iter().find(|sign| sign.sign() == first)?;
    let is_spaced = |c: Option<char>| matches!(c, Some(' ' | '\t'));
    match sign {
        SumSign::Subtract if behind.starts_with(|c: char| c.is_ascii_digit()) => None,
        SumSign::Subtract if !follows_value => Some(Ok((sign, 1))),
        SumSign::Subtract
            if !is_spaced(before.chars().last()) || !is_spaced(behind.chars().next()) =>
        {
            Some(Err(no_spaces(text, at, span)))
        }
        SumSign::Add
        | SumSign::Subtract
        | SumSign::Multiply
        | SumSign::Divide
        | SumSign::Remainder
        | SumSign::And => Some(Ok((sign, 1))),
    }
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
