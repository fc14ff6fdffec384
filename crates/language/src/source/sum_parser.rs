//! The grammar of sums: `+ - * / %` with parentheses, in the compares of a test's conditions.
//!
//! Called by `testing`. `contact_parser` reads the contacts around the sums. A parenthesis is a sum
//! if an operator or a compare follows it; within it `&` is the operator of MATH, outside it joins
//! contacts.

use super::contact::WrittenContact;
use super::contact_lexer::{Parsed, Token};
use super::contact_parser::{Compared, DEPTH_MAX, Parser, parse_as};
use super::contact_signs::SIGNS_ALONE;
use super::contact_sum::{Sum, SumPart, SumSign};
use super::finding::Finding;
use super::span::Span;

/// Parses a condition of a test: contacts, with sums in compares.
///
/// # Errors
/// The first mistake in it, with its exact place.
pub fn parse_condition(text: &str, span: Span) -> Result<WrittenContact<Sum>, Finding> {
    parse_as(text, span).map_err(|finding| {
        // A condition is one string, so this help of `contact_parser` does not fit.
        let help = finding.help_text().filter(|help| help.starts_with("contacts in series are"));
        match help.is_some() {
            true => finding.help("contacts are joined by `&` and `|`: `X0 & X1`"),
            false => finding,
        }
    })
}

/// The least precedence within parentheses, and outside of them.
const WITHIN: u8 = 0;
const OUTSIDE: u8 = 1;

impl Compared for Sum {
    const HAS_SUMS: bool = true;

    fn span(&self) -> Span {
        self.span
    }

    fn read(parser: &mut Parser<'_>, depth: u32) -> Parsed<Sum> {
        let mut parts = Vec::new();
        let span = parser.sum(&mut parts, OUTSIDE, depth)?;
        let (start, end) = (span.start - parser.span.start, span.end - parser.span.start);
        let text = parser.text.get(start as usize..end as usize).unwrap_or_default();
        Ok(Sum { parts, span, text: text.into() })
    }
}

impl Parser<'_> {
    /// Reads a sum of operators whose precedence is at least `least`; returns its place.
    fn sum(&mut self, parts: &mut Vec<SumPart>, least: u8, depth: u32) -> Parsed<Span> {
        let mut span = self.term(parts, depth)?;
        while let Some(sign) = self.sum_sign().filter(|sign| sign.precedence() >= least) {
            self.at += 1;
            let right = self.sum(parts, sign.precedence() + 1, depth)?;
            parts.push(SumPart::Sign(sign));
            span = span.to(right);
        }
        Ok(span)
    }

    /// The next token as a sign of a sum.
    fn sum_sign(&self) -> Option<SumSign> {
        match self.peek()?.0 {
            Token::Sign(sign) => Some(*sign),
            Token::And => Some(SumSign::And),
            Token::Atom(_)
            | Token::Not
            | Token::Or
            | Token::Open
            | Token::Close
            | Token::Compare(_) => None,
        }
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
                self.sum(parts, WITHIN, depth + 1)?;
                Ok(open.to(self.close(open)?))
            }
            found => Err(self.no_value(found)),
        }
    }
}
