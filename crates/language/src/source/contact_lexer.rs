//! Splits a string of contacts into tokens. Called by `contact_parser`. `contact_habits` makes the
//! finding for a character that begins no token.

use std::cell::RefCell;

use super::atom::{Atom, AtomKind, Placed, foreign_place_at, typed_literal};
use super::contact::Comparison;
use super::contact_habits::stray;
use super::contact_signs;
use super::expression::Binary;
use super::finding::{Code, Finding};
use super::foreign_signs;
use super::indexed::rest_length;
use super::span::Span;
use super::was;

/// A token.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Token {
    Atom(Atom),
    Not,
    And,
    Or,
    Open,
    Close,
    Compare(Comparison),
    /// The element of an array whose index computes: `gate[i + 1]`.
    Element,
    /// Between the arguments of a function.
    Comma,
    /// An operator of an expression, or the `-` before one.
    Sign(Binary),
}

/// The result of reading, or the first mistake.
pub(super) type Parsed<T> = Result<T, Finding>;

/// All tokens of a text, each with its place; `span` is the place of the whole text.
pub(super) fn lex(text: &str, span: Span) -> Parsed<Vec<(Token, Span)>> {
    // For each open parenthesis, whether it is within the arguments of a function.
    let open = RefCell::new(Vec::new());
    split(text, span, |rest, first, at| {
        let mut open = open.borrow_mut();
        let is_in_call = open.last() == Some(&true);
        if first == ',' && is_in_call {
            return Ok((Token::Comma, 1));
        }
        if let Some(found) = contact_signs::sign(text, at, span) {
            return found.map(|(sign, length)| (Token::Sign(sign), length));
        }
        let Some((token, length)) = sign(rest) else { return atom(text, first, at, span) };
        if token == Token::Open {
            open.push(is_in_call || contact_signs::ends_with_function(&text[..at]));
        } else if token == Token::Close {
            open.pop();
        }
        Ok((token, length))
    })
}

/// The tokens of a text; spaces may separate them. `next` reads the first token of the rest and
/// returns it with its length. Its arguments are the rest, the rest's first character, and the
/// rest's place in the text.
pub(super) fn split<T>(
    text: &str,
    span: Span,
    next: impl Fn(&str, char, usize) -> Parsed<(T, usize)>,
) -> Parsed<Vec<(T, Span)>> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        if c == ' ' || c == '\t' {
            at += 1;
            continue;
        }
        let (token, length) = next(&text[at..], c, at)?;
        tokens.push((token, span.part(at, at + length)));
        at += length;
    }
    Ok(tokens)
}

fn sign(rest: &str) -> Option<(Token, usize)> {
    const SIGNS: [(&str, Token); 11] = [
        ("==", Token::Compare(Comparison::Eq)),
        ("!=", Token::Compare(Comparison::Ne)),
        ("<=", Token::Compare(Comparison::Le)),
        (">=", Token::Compare(Comparison::Ge)),
        ("<", Token::Compare(Comparison::Lt)),
        (">", Token::Compare(Comparison::Gt)),
        ("!", Token::Not),
        ("&", Token::And),
        ("|", Token::Or),
        ("(", Token::Open),
        (")", Token::Close),
    ];
    if rest.starts_with(|first: char| first.is_ascii_alphanumeric()) {
        return None;
    }
    let is_foreign = foreign_signs::at_start(rest).is_some();
    let found = SIGNS.iter().find(|(sign, _)| rest.starts_with(sign)).filter(|_| !is_foreign);
    found.map(|(sign, token)| (token.clone(), sign.len()))
}

fn atom(text: &str, first: char, at: usize, span: Span) -> Parsed<(Token, usize)> {
    let rest = &text[at..];
    let behind = span.part(at, text.len());
    if let Some(finding) = typed_literal(rest, behind, Code::ContactSyntax) {
        return Err(finding);
    }
    let number = first.is_ascii_digit()
        || (first == '-' && rest[1..].starts_with(|c: char| c.is_ascii_digit()));
    if let Some((name, length)) = was::read(rest, behind)? {
        let atom = Atom { kind: AtomKind::Name(name), span: span.part(at, at + length) };
        return Ok((Token::Atom(atom), length));
    }
    let mut computes = false;
    let length = if number {
        let tail = |c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == ':' || c == '.');
        number_length(1 + rest[1..].find(tail).unwrap_or(rest.len() - 1), rest)
    } else if first.is_ascii_alphabetic() || first == '$' || first == '_' {
        let length = name_length(rest);
        let element = element_length(&rest[..length], &rest[length..]);
        let length = length + element;
        let length = length + if element > 0 { bit_length(&rest[length..]) } else { 0 };
        let index = index_length(&rest[length..], span.part(at + length, at + rest.len()))?;
        computes = is_computed(&rest[length..length + index]);
        let length = length + index;
        let length = length + if index > 0 { rest_length(&rest[length..]) } else { 0 };
        let length = length + if index > 0 { bit_length(&rest[length..]) } else { 0 };
        let takes_slash = rest[length..].starts_with('/') && !text.contains(['<', '>', '=']);
        let place = Placed { rest: behind, code: Code::ContactSyntax, takes_slash };
        if let Some(finding) = foreign_place_at(rest, length, place) {
            return Err(finding);
        }
        length
    } else {
        return Err(stray(text, at, span));
    };
    if computes {
        return Ok((Token::Element, length));
    }
    let place = span.part(at, at + length);
    let mut atom = Atom::parse(&without_spaces_in_index(&rest[..length]), place);
    if let Err(finding) = &mut atom
        && finding.code == Code::InstructionSyntax
    {
        finding.code = Code::ContactSyntax;
    }
    atom.map(|atom| (Token::Atom(atom), length))
}

/// The length of a number. In `2e-3`, the number continues with `-3` after `2e`.
fn number_length(length: usize, rest: &str) -> usize {
    let mantissa = rest[..length].strip_suffix('e').unwrap_or_default();
    let is_real = !mantissa.is_empty()
        && mantissa.bytes().all(|b| b.is_ascii_digit() || b == b'.' || b == b'-');
    let exponent = rest[length..].strip_prefix('-').unwrap_or_default();
    let digits = exponent.find(|c: char| !c.is_ascii_digit()).unwrap_or(exponent.len());
    if is_real && digits > 0 { length + 1 + digits } else { length }
}

fn name_length(rest: &str) -> usize {
    let tail = |c: char| !(c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '-'));
    let length = 1 + rest[1..].find(tail).unwrap_or(rest.len() - 1);
    // A minus behind a name is no part of it.
    1 + rest[1..length].trim_end_matches('-').len()
}

/// The length of `,19` or `,19,6` after an `N` (the Sensaphone manual's names of a counter and its
/// element); else 0.
pub(super) fn element_length(name: &str, behind: &str) -> usize {
    if !name.eq_ignore_ascii_case("N") {
        return 0;
    }
    let number = |text: &str| {
        let digits = text.strip_prefix(',')?;
        let digits_at = digits.len() - digits.trim_start_matches(' ').len();
        let digits = &digits[digits_at..];
        let count = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
        (count > 0).then_some(1 + digits_at + count)
    };
    let counter = number(behind).unwrap_or(0);
    let element = if counter > 0 { number(&behind[counter..]) } else { None };
    counter + element.unwrap_or(0)
}

/// The length of the index behind a name: `[3]`, `[step]`, `[step + 1]`; else 0.
fn index_length(behind: &str, span: Span) -> Parsed<usize> {
    if !behind.starts_with('[') {
        return Ok(0);
    }
    let mut depth = 0;
    for (at, c) in behind.char_indices() {
        match c {
            '[' => depth += 1,
            ']' if depth == 1 => return Ok(at + 1),
            ']' => depth -= 1,
            _ => {}
        }
    }
    Err(Finding::new(Code::ContactSyntax, span, "`]` is missing"))
}

/// The length of the number of a bit behind an index: `.3`; else 0.
pub(super) fn bit_length(behind: &str) -> usize {
    let Some(digits) = behind.strip_prefix('.') else { return 0 };
    let count = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
    let is_name = digits[count..].starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    if count == 0 || is_name { 0 } else { 1 + count }
}

/// Whether an index in its brackets is an expression, and no single name or constant.
fn is_computed(index: &str) -> bool {
    let inner = index.trim_matches(['[', ' ', '\t']);
    let inner = inner.strip_prefix('-').unwrap_or(inner);
    // `a mod 8` has words of another notation, which the reader of expressions knows.
    inner.contains(['+', '-', '*', '/', '%', '(', '['])
        || inner.trim_end_matches(']').split_whitespace().count() > 1
}

fn without_spaces_in_index(word: &str) -> String {
    match word.split_once('[') {
        Some((name, index)) => format!("{name}[{}", index.replace([' ', '\t'], "")),
        None => word.to_owned(),
    }
}
