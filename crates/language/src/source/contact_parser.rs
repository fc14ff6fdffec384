//! The grammar of contacts: a Pratt parser over the tokens of one string.
//!
//! Called by `rung`, and by `side_parser` for conditions of tests; `side_parser` reads the sides
//! of compares. `!` binds tighter than `&`, and `&` tighter than `|`; the operands of a compare
//! are values, not contacts. Nesting is limited, so that no input can exhaust the stack.

use super::atom::{Atom, AtomKind};
use super::contact::Edge;
use super::contact::WrittenContact::{self, All, Any, Bit, Compare, Not};
use super::contact_dialects::{foreign, foreign_instruction};
use super::contact_habits::{in_series, split_address};
use super::contact_lexer::{Parsed, Token, lex};
use super::contact_side::CompareSide;
use super::contact_signs;
use super::contact_tokens::Parser;
use super::contact_use::ContactUse;
use super::finding::{Code, Finding};
use super::fix::{FixEdit, Help, advise, possible, text};
use super::nearest::did_you_mean;
use super::span::{Located, Span};
use super::was;
use rungd_engine::isa::Function;
use rungd_engine::isa::function::FUNCTIONS;

/// Maximum nesting depth of parentheses and `!`.
pub(super) const DEPTH_MAX: u32 = 32;

/// Parses one string of a leg's array; `span` is its place, without the quotes.
///
/// # Errors
/// The first mistake in it, with its exact place.
pub fn parse(text: &str, span: Span) -> Result<WrittenContact, Finding> {
    parse_as(text, span, ContactUse::Ladder)
}

/// Parses a condition of a test: contacts, with `&` of numbers within the parentheses of a compare.
///
/// # Errors
/// The first mistake in it, with its exact place.
pub fn parse_condition(text: &str, span: Span) -> Result<WrittenContact, Finding> {
    parse_as(text, span, ContactUse::Test).map_err(|finding| {
        // A condition is one string, so this help of `contact_parser` does not fit.
        let help = finding.help_text().filter(|help| help.starts_with("contacts in series are"));
        match help.is_some() {
            true => finding.help("contacts are joined by `&` and `|`: `X0 & X1`"),
            false => finding,
        }
    })
}

/// As [`parse`], for contacts at any place.
fn parse_as(text: &str, span: Span, used: ContactUse) -> Result<WrittenContact, Finding> {
    let tokens = lex(text, span)?;
    let mut parser = Parser { text, span, tokens, at: 0, used };
    if parser.tokens.is_empty() {
        let finding = Finding::new(Code::ContactSyntax, span, "an empty contact");
        return Err(match used {
            ContactUse::Test => {
                finding.help("a contact is a bit, a compare or an edge: `X0`, `D0 > 3`, `rise(X0)`")
            }
            ContactUse::Ladder => finding
                .help("take it away; a leg that is always ON is [\"$On\"]")
                .fix(FixEdit::Delete),
        });
    }
    let contact = parser.expression(BindingPower::Or, 0)?;
    let refused = if used == ContactUse::Ladder { was::in_ladder(&contact) } else { None };
    match parser.peek() {
        None => refused.map_or(Ok(contact), Err),
        Some((token, place)) => Err(parser.left_over(&token.clone(), place)),
    }
}

/// A contact, or the first mistake in it.
type ParsedContact = Parsed<WrittenContact>;

/// The binding power of an operator.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum BindingPower {
    Or,
    And,
    Not,
}

impl Parser<'_> {
    fn expression(&mut self, least: BindingPower, depth: u32) -> ParsedContact {
        let mut left = self.operand(depth)?;
        let mut open = None;
        while let Some(power) = self.infix().filter(|power| *power >= least) {
            self.at += 1;
            let above =
                if power == BindingPower::Or { BindingPower::And } else { BindingPower::Not };
            let right = self.expression(above, depth)?;
            left = join(left, power, right, open == Some(power));
            open = Some(power);
        }
        Ok(left)
    }

    fn infix(&self) -> Option<BindingPower> {
        match self.peek()?.0 {
            Token::And => Some(BindingPower::And),
            Token::Or => Some(BindingPower::Or),
            Token::Atom(_)
            | Token::Not
            | Token::Open
            | Token::Close
            | Token::Element
            | Token::Comma
            | Token::Compare(_)
            | Token::Sign(_) => None,
        }
    }

    /// Reads the element `one` of the grammar: `!` with an operand, parentheses, an edge, a compare
    /// or a bit.
    fn operand(&mut self, depth: u32) -> ParsedContact {
        let Some((token, span)) = self.next() else {
            let finding = self.error(self.end(), "a contact is missing here");
            let sign = self.tokens.last().map(|(_, place)| possible("").at(*place));
            return Err(finding.fixes(sign));
        };
        if depth >= DEPTH_MAX {
            let message = format!("more than {DEPTH_MAX} levels of parentheses and `!`");
            let finding = Finding::new(Code::ContactSyntax, span, message);
            return Err(finding.help("give parts of it bits of their own, with OUT"));
        }
        if self.begins_expression() {
            self.at -= 1;
            let left = self.side()?;
            return self.compared(left);
        }
        match token {
            Token::Not => self.negation(span, depth),
            Token::Open => self.group(span, depth),
            Token::Atom(atom) => self.atom(atom, depth),
            Token::Compare(comparison) => {
                let message = format!("a value is missing before `{}`", comparison.sign());
                Err(self.error(span, message))
            }
            Token::Close => {
                Err(self.error(span, "`)` closes nothing, or is too early").fix(possible("")))
            }
            Token::Element => self.element(span),
            Token::Sign(_) | Token::Comma => {
                Err(self.no_value(Some(Located { value: token, span })))
            }
            Token::And | Token::Or => Err(self
                .error(span, "a contact is missing before this")
                .help("a contact stands on each side of it: `X0 & X1`")
                .fix(possible(""))),
        }
    }

    fn negation(&mut self, span: Span, depth: u32) -> ParsedContact {
        // `!D0 == 3` would read as "not D0, equals 3".
        if let [(Token::Atom(a), _), (Token::Compare(sign), _), (Token::Atom(b), end), ..] =
            &self.tokens[self.at..]
        {
            let whole = span.to(*end);
            let finding = Finding::new(
                Code::ContactSyntax,
                whole,
                format!("`!` binds tighter than `{}`", sign.sign()),
            );
            let (written, negated) = (sign.sign(), sign.negated().sign());
            return Err(finding.label(format!("this would compare `!{a}`")).help(advise(
                "write `{}`, or `{}`",
                [format!("!({a} {written} {b})"), format!("{a} {negated} {b}")],
            )));
        }
        let begin = self.at;
        let inner = self.operand(depth + 1)?;
        let whole = span.to(inner.span());
        // `!D0 + 1 == 3` would read in the same way. A compare in parentheses is right; its place
        // begins behind the `(`.
        if let Compare(..) = inner
            && self.tokens.get(begin).is_some_and(|(_, first)| first.start == inner.span().start)
        {
            let finding = self.error(whole, "`!` binds tighter than a compare");
            return Err(finding.write(format!("!({inner})")));
        }
        Ok(Not(Box::new(inner), whole))
    }

    fn group(&mut self, open: Span, depth: u32) -> ParsedContact {
        let (mut inner, close) = self.closed(open, depth)?;
        if let Not(_, span) | All(_, span) | Any(_, span) = &mut inner {
            *span = open.to(close);
        }
        Ok(inner)
    }

    /// Reads contacts and the `)` that closes them; also returns the place of the `)`.
    fn closed(&mut self, open: Span, depth: u32) -> Parsed<(WrittenContact, Span)> {
        let inner = self.expression(BindingPower::Or, depth + 1)?;
        Ok((inner, self.close(open)?))
    }

    /// Reads the `)` that closes the `(` at `open`; returns its place.
    pub(super) fn close(&mut self, open: Span) -> Parsed<Span> {
        if let Some(close) = self.take(&Token::Close) {
            return Ok(close);
        }
        let finding = match self.peek() {
            Some((token, place)) => self.left_over(&token.clone(), place),
            None => self.error(self.end(), "`)` is missing").fix(possible(")").at(self.end())),
        };
        Err(finding.related(open, "opened here"))
    }

    fn atom(&mut self, atom: Atom, depth: u32) -> ParsedContact {
        if let Some((Token::Open, _)) = self.peek()
            && let Some(name) = atom.name()
        {
            let name = name.to_owned();
            return self.edge(&name, atom.span, depth);
        }
        if let Some((Token::Compare(_), _)) = self.peek() {
            return self.compared(atom.into());
        }
        match atom.kind {
            AtomKind::Name(value) => Ok(Bit(Located { value, span: atom.span })),
            AtomKind::Integer(_) | AtomKind::Duration(_) | AtomKind::Real(_) => {
                if let Some(finding) = self.around().mask(&atom, self.used) {
                    return Err(finding);
                }
                let message = format!("`{atom}` is a number, not a contact");
                let finding = Finding::new(Code::ContactSyntax, atom.span, message);
                let compare = format!("D0 == {atom}");
                let finding = finding.help(format!("compare it with something: `{compare}`"));
                Err(finding.fix(possible(compare)))
            }
        }
    }

    fn edge(&mut self, word: &str, span: Span, depth: u32) -> ParsedContact {
        let edge = match word {
            "rise" => Edge::Rise,
            "fall" => Edge::Fall,
            _ => {
                let message = format!("`{word}` cannot have parentheses after it");
                let finding = Finding::new(Code::ContactSyntax, span, message);
                let foreign = foreign(self.text, self.span)
                    .or_else(|| foreign_instruction(self.text, self.span));
                if let Some(finding) = foreign {
                    return Err(finding);
                }
                let small = word.to_ascii_lowercase();
                if Function::from_name(&small).is_some() {
                    return Err(finding.write(small));
                }
                return Err(finding.help(match word.to_ascii_lowercase().as_str() {
                    "rise" => Help::from("write `rise(…)`").with("rise"),
                    "fall" => Help::from("write `fall(…)`").with("fall"),
                    "not" => Help::from("write `!(…)`").with("!"),
                    word => {
                        let functions = FUNCTIONS.iter().map(|spec| spec.name);
                        did_you_mean(word, ["rise", "fall"].into_iter().chain(functions))
                            .unwrap_or_else(|| "only edges and functions have".into())
                    }
                }));
            }
        };
        let open = self.peek().map_or(self.end(), |(_, place)| place);
        self.at += 1;
        if let Some((Token::Close, place)) = self.peek() {
            let message = format!("`{word}()` has no contact");
            let finding = self.error(place, message).help(format!("write `{word}(X0)`"));
            return Err(finding.fix(possible("X0").at(Span { end: place.start, ..place })));
        }
        let (inner, close) = self.closed(open, depth)?;
        Ok(WrittenContact::Edge(edge, Box::new(inner), span.to(close)))
    }

    /// Reads the rest of a compare: the sign and the right value. The left value was already read.
    fn compared(&mut self, left: CompareSide) -> ParsedContact {
        let Some((Token::Compare(comparison), sign)) = self.peek() else {
            let message = format!("`{left}` is a number, not a contact");
            let finding = Finding::new(Code::ContactSyntax, left.span(), message);
            let right = possible(format!("{left} > 0"));
            return Err(finding.help(advise("compare it with something: `{}`", [right])));
        };
        let comparison = *comparison;
        self.at += 1;
        if !self.begins_value() {
            let place = self.peek().map_or(sign, |(_, place)| place);
            let message = format!("a value is missing after `{}`", comparison.sign());
            return Err(self.error(place, message));
        }
        let right = self.side()?;
        if let Some((Token::Compare(second), place)) = self.peek() {
            let finding = Finding::new(Code::ContactSyntax, place, "two compares in a row");
            let (third, end) = match self.tokens.get(self.at + 1) {
                Some((Token::Atom(third), end)) => (third.to_string(), *end),
                _ => ("…".to_owned(), place),
            };
            let (first, second) = (comparison.sign(), second.sign());
            let joined = format!("{left} {first} {right} & {right} {second} {third}");
            let joined = text(joined).at(left.span().to(end));
            return Err(finding.help(advise("join them: `{}`", [joined])));
        }
        let span = left.span().to(right.span());
        Ok(Compare(left, comparison, right, span))
    }

    /// The finding for a token that follows a complete contact.
    pub(super) fn left_over(&self, token: &Token, place: Span) -> Finding {
        let at = (place.start - self.span.start) as usize;
        let (before, behind) = self.text.split_at(at);
        match token {
            Token::Atom(Atom { kind: AtomKind::Integer(_) | AtomKind::Real(_), .. })
                if behind.starts_with('-') =>
            {
                contact_signs::no_spaces(self.text, at, self.span)
            }
            Token::Atom(_) | Token::Element | Token::Not | Token::Open => {
                let (before, behind) = (before.trim(), behind.trim());
                if let Some(finding) = foreign(self.text, self.span) {
                    return finding;
                }
                if let Some((place, help)) = self.around().habit(place) {
                    return self.error(place, "a word where a sign is needed").help(help);
                }
                if let Some(help) = split_address(self.text, at, self.span) {
                    return self.error(place, "a number does not stand alone").help(help);
                }
                if let Some(finding) = foreign_instruction(self.text, self.span) {
                    return finding;
                }
                let help = in_series(before, behind);
                self.error(place, "`&` or `|` is missing before this").help(help)
            }
            Token::Close => self.error(place, "`)` closes nothing").fix(possible("")),
            Token::Sign(_) | Token::Comma => self
                .error(place, "a sum stands in a compare")
                .help("compare it with something: `D0 + 1 > 3`"),
            Token::Compare(_) => self
                .error(place, "a compare stands between two values")
                .help("values are words and constants, not contacts: `D0 == 3`"),
            Token::And | Token::Or => self
                .error(place, "a contact is missing here")
                .help("a contact stands on each side of it: `X0 & X1`"),
        }
    }
}

/// `left op right`. With `grow`, `left` is a series of the same operator, and `right` is appended
/// to it.
fn join(
    left: WrittenContact,
    power: BindingPower,
    right: WrittenContact,
    grow: bool,
) -> WrittenContact {
    let span = left.span().to(right.span());
    let items = match left {
        All(mut items, _) | Any(mut items, _) if grow => {
            items.push(right);
            items
        }
        Bit(_)
        | WrittenContact::Indexed(_)
        | Not(..)
        | All(..)
        | Any(..)
        | WrittenContact::Edge(..)
        | Compare(..) => {
            vec![left, right]
        }
    };
    if power == BindingPower::And { All(items, span) } else { Any(items, span) }
}
