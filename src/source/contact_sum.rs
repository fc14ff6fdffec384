//! Sums in the compares of a test's conditions: `+ - * / %` with parentheses.
//!
//! `contact_parser` reads what a compare compares through [`Compared`]: in a ladder one name or
//! constant ([`Atom`]), in a test a [`Sum`]. The parts of a sum stand in postfix order, so a long
//! one is walked in a loop. Names are not looked up here.

use std::fmt;

use super::atom::Atom;
use super::contact_lexer::{Parsed, Token};
use super::contact_parser::{DEPTH_MAX, Parser};
use super::finding::{Code, Finding};
use super::span::Span;

/// The help for an operator or a function that only MATH has.
pub(super) const SIGNS_ALONE: &str = "a condition computes with `+ - * / %` alone: let a MATH of \
                                      the ladder compute this, and compare its result";

/// All of them.
const SIGNS: [SumSign; 5] =
    [SumSign::Add, SumSign::Subtract, SumSign::Multiply, SumSign::Divide, SumSign::Remainder];

/// A sign of a sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SumSign {
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
}

impl SumSign {
    /// As written.
    fn sign(self) -> char {
        match self {
            SumSign::Add => '+',
            SumSign::Subtract => '-',
            SumSign::Multiply => '*',
            SumSign::Divide => '/',
            SumSign::Remainder => '%',
        }
    }

    /// How tightly it binds: `*` tighter than `+`.
    fn precedence(self) -> u8 {
        match self {
            SumSign::Add | SumSign::Subtract => 0,
            SumSign::Multiply | SumSign::Divide | SumSign::Remainder => 1,
        }
    }
}

/// What a compare compares.
pub(super) trait Compared: From<Atom> + fmt::Display {
    /// Whether it may be a sum.
    const HAS_SUMS: bool;

    /// Its place.
    fn span(&self) -> Span;

    /// Reads one, from the next token on.
    fn read(parser: &mut Parser<'_>, depth: u32) -> Parsed<Self>;
}

/// A sum of names and constants, or one of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sum {
    /// Its parts in postfix order; the last one is the whole.
    pub parts: Vec<SumPart>,
    /// Its place, with the parentheses around it.
    pub span: Span,
    /// As it is written.
    text: Box<str>,
}

/// A part of a sum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SumPart {
    /// A name or constant.
    Value(Atom),
    /// An operator behind its two operands.
    Sign(SumSign),
}

impl Compared for Atom {
    const HAS_SUMS: bool = false;

    fn span(&self) -> Span {
        self.span
    }

    fn read(parser: &mut Parser<'_>, _: u32) -> Parsed<Atom> {
        match parser.next() {
            Some((Token::Atom(atom), _)) => Ok(atom),
            found => Err(parser.no_value(found)),
        }
    }
}

impl Compared for Sum {
    const HAS_SUMS: bool = true;

    fn span(&self) -> Span {
        self.span
    }

    fn read(parser: &mut Parser<'_>, depth: u32) -> Parsed<Sum> {
        let mut parts = Vec::new();
        let span = parser.sum(&mut parts, 0, depth)?;
        let (start, end) = (span.start - parser.span.start, span.end - parser.span.start);
        let text = parser.text.get(start as usize..end as usize).unwrap_or_default();
        Ok(Sum { parts, span, text: text.into() })
    }
}

impl From<Atom> for Sum {
    fn from(atom: Atom) -> Sum {
        let (span, text) = (atom.span, atom.to_string().into());
        Sum { parts: vec![SumPart::Value(atom)], span, text }
    }
}

impl fmt::Display for Sum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Parser<'_> {
    /// Whether a sum begins with the token that was read last.
    pub(super) fn begins_sum(&self) -> bool {
        let last = self.at.saturating_sub(1);
        let behind = match self.tokens.get(last) {
            Some((Token::Atom(_), _)) => self.at,
            Some((Token::Open, _)) => self.behind_close(last),
            Some(_) | None => return false,
        };
        match self.tokens.get(behind) {
            Some((Token::Sign(_), _)) => true,
            Some((Token::Compare(_), _)) => behind > self.at,
            Some(_) | None => false,
        }
    }

    /// The number of the token behind the parenthesis that closes the one at `open`.
    fn behind_close(&self, open: usize) -> usize {
        let mut depth = 0;
        for (at, (token, _)) in self.tokens.iter().enumerate().skip(open) {
            depth += i32::from(*token == Token::Open) - i32::from(*token == Token::Close);
            if depth == 0 {
                return at + 1;
            }
        }
        self.tokens.len()
    }

    /// Reads a sum of operators that bind at least so tightly; returns its place.
    fn sum(&mut self, parts: &mut Vec<SumPart>, least: u8, depth: u32) -> Parsed<Span> {
        let mut span = self.term(parts, depth)?;
        while let Some((Token::Sign(sign), _)) = self.peek()
            && sign.precedence() >= least
        {
            let sign = *sign;
            self.at += 1;
            let right = self.sum(parts, sign.precedence() + 1, depth)?;
            parts.push(SumPart::Sign(sign));
            span = span.to(right);
        }
        Ok(span)
    }

    fn term(&mut self, parts: &mut Vec<SumPart>, depth: u32) -> Parsed<Span> {
        match self.next() {
            Some((Token::Atom(atom), place)) => {
                if let Some((Token::Open, _)) = self.peek() {
                    let message = format!("`{atom}` cannot have parentheses after it");
                    return Err(self.error(place, message).help(SIGNS_ALONE));
                }
                parts.push(SumPart::Value(atom));
                Ok(place)
            }
            Some((Token::Open, open)) => {
                if depth >= DEPTH_MAX {
                    let message = format!("more than {DEPTH_MAX} levels of parentheses and `!`");
                    return Err(self.error(open, message).help(SIGNS_ALONE));
                }
                self.sum(parts, 0, depth + 1)?;
                Ok(open.to(self.close(open)?))
            }
            found => Err(self.no_value(found)),
        }
    }

    /// The finding for a token where a value belongs, or for the end of the text.
    pub(super) fn no_value(&self, found: Option<(Token, Span)>) -> Finding {
        let Some((Token::Sign(sign), place)) = found else {
            let place = found.map_or(self.end(), |(_, place)| place);
            return self.error(place, "a value is missing here");
        };
        let behind = self.text.get((place.end - self.span.start) as usize..).unwrap_or_default();
        let behind = behind.trim_start();
        let is_number = behind.starts_with(|c: char| c.is_ascii_digit());
        let name = behind.split([' ', '\t', '(', ')', '&', '|']).next().unwrap_or_default();
        let help = match sign {
            SumSign::Subtract if is_number => format!("write `-{name}`"),
            SumSign::Subtract if !name.is_empty() => format!("write `0 - {name}`"),
            SumSign::Add => "take the `+` away".to_owned(),
            SumSign::Subtract | SumSign::Multiply | SumSign::Divide | SumSign::Remainder => {
                "addresses go without `%`, and a sign stands between two values: `D0 * 2`"
                    .to_owned()
            }
        };
        let message = format!("a value is missing before `{}`", sign.sign());
        self.error(place, message).help(help)
    }
}

/// The sign of a sum at a place of a text, with its length; `None`: something else begins there.
pub(super) fn sign(text: &str, at: usize, span: Span) -> Option<Parsed<(SumSign, usize)>> {
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
        | SumSign::Remainder => Some(Ok((sign, 1))),
    }
}

/// The finding for a minus at a place of a text that lacks a space on one of its sides.
pub(super) fn no_spaces(text: &str, at: usize, span: Span) -> Finding {
    let (before, behind) = (text[..at].trim(), text[at + 1..].trim());
    let left = before.rsplit(['&', '|', '!']).next().unwrap_or(before).trim();
    let right = behind.split(['&', '|']).next().unwrap_or(behind).trim();
    let place = span.part(at, at + 1);
    Finding::new(Code::ContactSyntax, place, "a minus without spaces around it")
        .help(format!("write `{left} - {right}`"))
}
