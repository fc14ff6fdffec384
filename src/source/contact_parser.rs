//! The grammar of contacts: a lexer and a Pratt parser over one string.
//!
//! `!` binds tighter than `&`, and `&` than `|`; a compare stands between two values and inside
//! none of them. Nesting is limited, so that no input can exhaust the stack.

use super::atom::{Atom, AtomKind};
use super::contact::{Comparison, Contact, Edge};
use super::finding::{Code, Finding};
use super::span::{Located, Span};

/// Deepest nesting of parentheses and `!`.
const DEPTH_MAX: u32 = 32;

/// What a string of contacts is made of.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Token {
    Atom(Atom),
    Not,
    And,
    Or,
    Open,
    Close,
    Compare(Comparison),
}

type Parsed<T> = Result<T, Finding>;

/// Parses a whole string.
pub(super) fn parse(text: &str, span: Span) -> Parsed<Contact> {
    let tokens = lex(text, span)?;
    let mut parser = Parser { text, span, tokens, at: 0 };
    if parser.tokens.is_empty() {
        let finding = Finding::new(Code::ContactSyntax, span, "an empty contact");
        return Err(finding.help("take it away; a leg that is always ON is [\"$On\"]"));
    }
    let contact = parser.expression(Power::Or, 0)?;
    match parser.peek() {
        None => Ok(contact),
        Some((token, place)) => Err(parser.left_over(&token.clone(), place)),
    }
}

/// How tightly an operator binds what stands at its sides.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Power {
    Or,
    And,
    Not,
}

struct Parser<'a> {
    text: &'a str,
    span: Span,
    tokens: Vec<(Token, Span)>,
    at: usize,
}

impl Parser<'_> {
    fn peek(&self) -> Option<(&Token, Span)> {
        self.tokens.get(self.at).map(|(token, span)| (token, *span))
    }

    fn next(&mut self) -> Option<(Token, Span)> {
        let token = self.tokens.get(self.at).cloned();
        self.at += usize::from(token.is_some());
        token
    }

    fn take(&mut self, wanted: &Token) -> Option<Span> {
        let (token, span) = self.peek()?;
        if token != wanted {
            return None;
        }
        self.at += 1;
        Some(span)
    }

    /// The place behind the last byte.
    fn end(&self) -> Span {
        Span { start: self.span.end, ..self.span }
    }

    fn expression(&mut self, least: Power, depth: u32) -> Parsed<Contact> {
        let mut left = self.operand(depth)?;
        let mut open = None;
        while let Some(power) = self.infix().filter(|power| *power >= least) {
            self.at += 1;
            let above = if power == Power::Or { Power::And } else { Power::Not };
            let right = self.expression(above, depth)?;
            left = join(left, power, right, open == Some(power));
            open = Some(power);
        }
        Ok(left)
    }

    fn infix(&self) -> Option<Power> {
        match self.peek()?.0 {
            Token::And => Some(Power::And),
            Token::Or => Some(Power::Or),
            _ => None,
        }
    }

    /// `one` of the grammar: `!` one, parentheses, an edge, a compare or a bit.
    fn operand(&mut self, depth: u32) -> Parsed<Contact> {
        let Some((token, span)) = self.next() else {
            return Err(self.error(self.end(), "a contact is missing here"));
        };
        if depth >= DEPTH_MAX {
            let message = format!("more than {DEPTH_MAX} levels of parentheses and `!`");
            let finding = Finding::new(Code::ContactSyntax, span, message);
            return Err(finding.help("give parts of it bits of their own, with OUT"));
        }
        match token {
            Token::Not => self.negation(span, depth),
            Token::Open => self.group(span, depth),
            Token::Atom(atom) => self.atom(atom),
            Token::Compare(comparison) => {
                let message = format!("a value is missing before `{}`", comparison.sign());
                Err(self.error(span, message))
            }
            Token::Close => Err(self.error(span, "`)` closes nothing, or closes it too early")),
            Token::And | Token::Or => Err(self.error(span, "a contact is missing before this")),
        }
    }

    fn negation(&mut self, span: Span, depth: u32) -> Parsed<Contact> {
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
            return Err(finding
                .label(format!("this would compare `!{a}`"))
                .help(format!("write `!({a} {written} {b})`, or `{a} {negated} {b}`")));
        }
        let inner = self.operand(depth + 1)?;
        let whole = span.to(inner.span());
        Ok(Contact::Not(Box::new(inner), whole))
    }

    fn group(&mut self, open: Span, depth: u32) -> Parsed<Contact> {
        let mut inner = self.expression(Power::Or, depth + 1)?;
        let Some(close) = self.take(&Token::Close) else {
            let finding = match self.peek() {
                Some((token, place)) => self.left_over(&token.clone(), place),
                None => self.error(self.end(), "`)` is missing"),
            };
            return Err(finding.related(open, "opened here"));
        };
        if let Contact::Not(_, span) | Contact::All(_, span) | Contact::Any(_, span) = &mut inner {
            *span = open.to(close);
        }
        Ok(inner)
    }

    fn atom(&mut self, atom: Atom) -> Parsed<Contact> {
        if let Some((Token::Open, _)) = self.peek()
            && let Some(name) = atom.name()
        {
            let name = name.to_owned();
            return self.edge(&name, atom.span);
        }
        if let Some((Token::Compare(comparison), sign)) = self.peek() {
            let comparison = *comparison;
            self.at += 1;
            return self.compare(atom, comparison, sign);
        }
        match atom.kind {
            AtomKind::Name(value) => Ok(Contact::Bit(Located { value, span: atom.span })),
            _ => {
                let message = format!("`{atom}` is a number, not a contact");
                let finding = Finding::new(Code::ContactSyntax, atom.span, message);
                Err(finding.help(format!("compare it with something: `D0 == {atom}`")))
            }
        }
    }

    fn edge(&mut self, word: &str, span: Span) -> Parsed<Contact> {
        let edge = match word {
            "rise" => Edge::Rise,
            "fall" => Edge::Fall,
            _ => {
                let message = format!("`{word}` cannot have parentheses behind it");
                let finding = Finding::new(Code::ContactSyntax, span, message);
                return Err(finding.help("only `rise(bit)` and `fall(bit)` have"));
            }
        };
        self.at += 1;
        let name = match self.next() {
            Some((Token::Atom(Atom { kind: AtomKind::Name(value), span }), _)) => {
                Located { value, span }
            }
            found => {
                let place = found.map_or(self.end(), |(_, place)| place);
                let finding = Finding::new(
                    Code::ContactSyntax,
                    place,
                    format!("`{word}()` takes the name of one bit"),
                );
                return Err(finding.help(format!(
                    "to see the edge of more, give it a bit of its own with OUT, or use PD: \
                     `{word}(C0)`"
                )));
            }
        };
        match self.take(&Token::Close) {
            Some(close) => Ok(Contact::Edge(edge, name, span.to(close))),
            None => {
                let place = self.peek().map_or(self.end(), |(_, place)| place);
                let message = format!("`{word}()` takes the name of one bit, then `)`");
                Err(Finding::new(Code::ContactSyntax, place, message))
            }
        }
    }

    fn compare(&mut self, left: Atom, comparison: Comparison, sign: Span) -> Parsed<Contact> {
        let right = match self.next() {
            Some((Token::Atom(atom), _)) => atom,
            found => {
                let place = found.map_or(sign, |(_, place)| place);
                let message = format!("a value is missing behind `{}`", comparison.sign());
                return Err(self.error(place, message));
            }
        };
        if let Some((Token::Compare(_), place)) = self.peek() {
            let finding = Finding::new(Code::ContactSyntax, place, "two compares in a row");
            return Err(finding.help("join them: `0 <= D0 & D0 < 5`"));
        }
        let span = left.span.to(right.span);
        Ok(Contact::Compare(left, comparison, right, span))
    }

    fn error(&self, place: Span, message: impl Into<String>) -> Finding {
        Finding::new(Code::ContactSyntax, place, message)
    }

    /// The finding of a token behind a contact that is complete.
    fn left_over(&self, token: &Token, place: Span) -> Finding {
        let before = &self.text[..(place.start - self.span.start) as usize];
        let behind = &self.text[(place.start - self.span.start) as usize..];
        match token {
            Token::Atom(_) | Token::Not | Token::Open => {
                let (before, behind) = (before.trim(), behind.trim());
                self.error(place, "`&` or `|` is missing before this").help(format!(
                    "contacts in series are strings of their own: `\"{before}\", \"{behind}\"`"
                ))
            }
            Token::Close => self.error(place, "`)` closes nothing"),
            Token::Compare(_) => self
                .error(place, "a compare stands between two values")
                .help("values are words and constants, not contacts: `D0 == 3`"),
            Token::And | Token::Or => self.error(place, "a contact is missing here"),
        }
    }
}

/// `left op right`; `grow` when `left` is a series of the same operator that is still growing.
fn join(left: Contact, power: Power, right: Contact, grow: bool) -> Contact {
    let span = left.span().to(right.span());
    let mut items = match left {
        Contact::All(items, _) | Contact::Any(items, _) if grow => items,
        other => vec![other],
    };
    items.push(right);
    if power == Power::And { Contact::All(items, span) } else { Contact::Any(items, span) }
}

fn lex(text: &str, span: Span) -> Parsed<Vec<(Token, Span)>> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        if c == ' ' || c == '\t' {
            at += 1;
            continue;
        }
        let rest = &text[at..];
        let (token, length) = match sign(rest) {
            Some(found) => found,
            None => atom(rest, c, at, span)?,
        };
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
    let doubled = rest.starts_with("&&") || rest.starts_with("||") || rest.starts_with("<>");
    let found = SIGNS.iter().find(|(sign, _)| rest.starts_with(sign)).filter(|_| !doubled);
    found.map(|(sign, token)| (token.clone(), sign.len()))
}

fn atom(rest: &str, first: char, at: usize, span: Span) -> Parsed<(Token, usize)> {
    let number = first.is_ascii_digit()
        || (first == '-' && rest[1..].starts_with(|c: char| c.is_ascii_digit()));
    let length = if number {
        let tail = |c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == ':' || c == '.');
        1 + rest[1..].find(tail).unwrap_or(rest.len() - 1)
    } else if first.is_ascii_alphabetic() || first == '$' || first == '_' {
        let length = name_length(rest);
        length + element_length(&rest[..length], &rest[length..])
    } else {
        return Err(stray(rest, first, at, span));
    };
    let place = span.part(at, at + length);
    let mut atom = Atom::parse(&rest[..length], place);
    if let Err(finding) = &mut atom
        && finding.code == Code::InstructionSyntax
    {
        finding.code = Code::ContactSyntax;
    }
    atom.map(|atom| (Token::Atom(atom), length))
}

fn name_length(rest: &str) -> usize {
    let tail = |c: char| !(c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '-'));
    1 + rest[1..].find(tail).unwrap_or(rest.len() - 1)
}

/// The length of `,19,6` behind an `N`: the Sensaphone way to name an element. Else 0.
fn element_length(name: &str, behind: &str) -> usize {
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
    let first = number(behind);
    let both = first.and_then(|first| Some(first + number(&behind[first..])?));
    both.unwrap_or(0)
}

/// The finding of a character that no contact begins with.
fn stray(rest: &str, first: char, at: usize, span: Span) -> Finding {
    let place = span.part(at, at + first.len_utf8());
    let two = span.part(at, (at + 2).min((span.end - span.start) as usize));
    let finding = |message: String, place| Finding::new(Code::ContactSyntax, place, message);
    match first {
        '&' => finding("`&&` is written `&`".into(), two).help("write `&`"),
        '|' => finding("`||` is written `|`".into(), two).help("write `|`"),
        '<' => finding("`<>` is written `!=`".into(), two).help("write `!=`"),
        '=' => finding("`=` is written `==`".into(), place).help("write `==`"),
        '/' | '~' | '^' => finding(format!("`{first}` does not negate a contact"), place)
            .help(format!("write `!{}`", rest[1..].trim_start())),
        ',' => finding("a comma in a contact".into(), place)
            .help("contacts in series are strings of their own: `[\"X0\", \"X1\"]`"),
        _ => finding(format!("`{}` belongs to no contact", first.escape_debug()), place),
    }
}
