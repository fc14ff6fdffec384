//! The sides of compares in contacts: where an expression begins and ends, and what it may
//! contain.
//!
//! Part of the parser of contacts. `expression_parser` reads the text of an expression. A
//! parenthesis is arithmetic if an operator or a compare follows it; otherwise it holds contacts.
//! Behaviour: `docs/semantics.md`, section 12.

use super::contact::WrittenContact;
use super::contact_habits::masked;
use super::contact_lexer::{Parsed, Token};
use super::contact_side::{CompareSide, ContactExpression};
use super::contact_tokens::Parser;
use super::contact_use::ContactUse;
use super::expression::{Binary, ExpressionPartKind, Unary};
use super::expression_lexer::ExpressionUse;
use super::expression_parser;
use super::finding::Finding;
use super::fix::{Help, text, write};
use super::span::{Located, Span};
use rungd_engine::isa::Function;

impl Parser<'_> {
    /// Whether an expression begins with the token that was read last.
    pub(super) fn begins_expression(&self) -> bool {
        let last = self.at.saturating_sub(1);
        let behind = match &self.tokens[last].0 {
            Token::Atom(atom) if atom.name().is_some_and(is_function) => {
                match self.tokens.get(self.at) {
                    Some((Token::Open, _)) => return true,
                    Some(_) | None => self.at,
                }
            }
            Token::Atom(_) | Token::Element => self.at,
            Token::Open => self.behind_close(last),
            Token::Sign(Binary::Subtract) => return true,
            Token::Not
            | Token::And
            | Token::Or
            | Token::Close
            | Token::Comma
            | Token::Compare(_)
            | Token::Sign(_) => return false,
        };
        match self.tokens.get(behind) {
            Some((Token::Sign(_), _)) => true,
            Some((Token::Compare(_), _)) => {
                behind > self.at || self.tokens[last].0 == Token::Element
            }
            Some(_) | None => false,
        }
    }

    /// The index of the token behind the `)` that closes the `(` at `open`.
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

    /// Whether a value may begin with the next token.
    pub(super) fn begins_value(&self) -> bool {
        match self.peek() {
            Some((Token::Atom(_) | Token::Element | Token::Open | Token::Sign(_), _)) => true,
            Some((
                Token::Not
                | Token::And
                | Token::Or
                | Token::Close
                | Token::Comma
                | Token::Compare(_),
                _,
            ))
            | None => false,
        }
    }

    /// The finding for a token, or the end of the text, in the place of a value.
    pub(super) fn no_value(&self, found: Option<Located<Token>>) -> Finding {
        let Some(Located { value: Token::Sign(sign), span: place }) = found else {
            let place = found.map_or(self.end(), |found| found.span);
            return self.error(place, "a value is missing here");
        };
        let behind = self.text.get((place.end - self.span.start) as usize..).unwrap_or_default();
        let behind = behind.trim_start();
        let is_number = behind.starts_with(|c: char| c.is_ascii_digit());
        let name = behind.split([' ', '\t', '(', ')', '&', '|']).next().unwrap_or_default();
        let end = self.text.len() - behind.len() + name.len();
        let whole = place.to(self.span.part(0, end));
        let help = if sign == Binary::Subtract && is_number {
            write(text(format!("-{name}")).at(whole))
        } else if sign == Binary::Add {
            Help::from("take the `+` away").with("")
        } else {
            "addresses go without `%`, and a sign stands between two values: `D0 * 2`".into()
        };
        let message = format!("a value is missing before `{}`", sign.sign());
        self.error(place, message).help(help)
    }

    /// Reads a side of a compare, from the next token on.
    pub(super) fn side(&mut self) -> Parsed<CompareSide> {
        let (begin, end) = (self.at, self.side_end());
        match &self.tokens[begin..end] {
            [] => {
                let found = self.next();
                Err(self.no_value(found.map(|(value, span)| Located { value, span })))
            }
            [(Token::Atom(atom), _)] => {
                let side = CompareSide::Atom(atom.clone());
                self.at = end;
                Ok(side)
            }
            [(Token::Sign(sign), place), ..] if *sign != Binary::Subtract => {
                let token = Token::Sign(*sign);
                Err(self.no_value(Some(Located { value: token, span: *place })))
            }
            [(_, first), ..] => {
                let span = first.to(self.tokens[end - 1].1);
                self.at = end;
                self.expression_at(span).map(CompareSide::Computed)
            }
        }
    }

    /// Reads the expression that is an element with a computed index; its token was read last.
    pub(super) fn element(&mut self, span: Span) -> Parsed<WrittenContact> {
        self.expression_at(span).map(WrittenContact::Indexed)
    }

    /// The index of the token behind the side that begins with the next token.
    fn side_end(&self) -> usize {
        let (mut depth, mut wants_value) = (0, true);
        for (at, (token, _)) in self.tokens.iter().enumerate().skip(self.at) {
            let is_call = || matches!(self.tokens[at - 1].0, Token::Atom(_));
            let ends = match token {
                Token::And | Token::Or | Token::Compare(_) | Token::Close | Token::Comma => true,
                Token::Atom(_) | Token::Element | Token::Not => !wants_value,
                Token::Open => !wants_value && !is_call(),
                Token::Sign(_) => false,
            };
            if depth == 0 && ends {
                return at;
            }
            depth += i32::from(*token == Token::Open) - i32::from(*token == Token::Close);
            wants_value = !matches!(token, Token::Atom(_) | Token::Element | Token::Close);
        }
        self.tokens.len()
    }

    /// Reads the expression at a place, and checks that it has only what contacts compute.
    fn expression_at(&self, span: Span) -> Parsed<ContactExpression> {
        let (start, end) = (span.start - self.span.start, span.end - self.span.start);
        let text = &self.text[start as usize..end as usize];
        // All warnings are about operators that are refused below.
        let mut warnings = Vec::new();
        let expression =
            expression_parser::parse(text, span, ExpressionUse::Contact, &mut warnings)?;
        match expression.parts.iter().find_map(|part| self.refused(&part.kind, part.span)) {
            Some((sign, place)) => Err(self.no_contact_sign(sign, place, span)),
            None => Ok(ContactExpression { expression, span }),
        }
    }

    /// The sign of a part that contacts do not have, and its place.
    fn refused(&self, kind: &ExpressionPartKind, place: Span) -> Option<(&'static str, Span)> {
        match kind {
            ExpressionPartKind::Binary(Binary::And, _) if self.used == ContactUse::Test => None,
            ExpressionPartKind::Binary(operator, sign) => match operator {
                Binary::Power
                | Binary::Multiply
                | Binary::Divide
                | Binary::Remainder
                | Binary::Add
                | Binary::Subtract => None,
                Binary::ShiftLeft
                | Binary::ShiftRightZeros
                | Binary::ShiftRight
                | Binary::AtMost
                | Binary::Less
                | Binary::AtLeast
                | Binary::Greater
                | Binary::Equal
                | Binary::NotEqual
                | Binary::AndAlso
                | Binary::And
                | Binary::Xor
                | Binary::OrElse
                | Binary::Or => Some((operator.sign(), *sign)),
            },
            ExpressionPartKind::Unary(Unary::Minus) => None,
            ExpressionPartKind::Unary(operator @ (Unary::Not | Unary::Complement)) => {
                Some((operator.sign(), place))
            }
            ExpressionPartKind::Integer(_)
            | ExpressionPartKind::Duration(_)
            | ExpressionPartKind::Real(_)
            | ExpressionPartKind::Name(_)
            | ExpressionPartKind::Element(_)
            | ExpressionPartKind::WordBit(_)
            | ExpressionPartKind::Call(..) => None,
        }
    }

    /// The finding for a sign of MATH in the expression at `side`.
    fn no_contact_sign(&self, sign: &str, place: Span, side: Span) -> Finding {
        let message = format!("`{sign}` in the arithmetic of a contact");
        let finding = self.error(place, message);
        let (start, end) = (side.start - self.span.start, side.end - self.span.start);
        let text = self.text[start as usize..end as usize].trim();
        let inner = text.strip_prefix('(').and_then(|text| text.strip_suffix(')'));
        let formula = inner.filter(|inner| !inner.contains(['(', ')'])).unwrap_or(text);
        let compare = match &self.tokens[self.at.min(self.tokens.len())..] {
            // What `&` or `|` joins may be bits, which are compared with no number.
            [(Token::Compare(how), _), (Token::Atom(atom), right), ..]
                if atom.name().is_none() || !matches!(sign, "&" | "|") =>
            {
                Some((format!("{} {atom}", how.sign()), side.to(*right)))
            }
            _ => None,
        };
        match compare {
            Some((compare, whole)) => finding.help(masked(formula, &compare, self.used, whole)),
            None => finding.help(
                "contacts compute with `+ - * / % **` and functions: let a MATH compute this in a \
                 rung before, and compare its result",
            ),
        }
    }
}

/// Whether a name is that of a function.
fn is_function(name: &str) -> bool {
    Function::from_name(name).is_some()
}
