//! Splits the text of an expression into tokens. Called by `expression_parser`.
//!
//! In MATH a name has no `-`: a `-` is always the operator. In a contact, a `-` directly between
//! letters, digits or `_` belongs to a name. A character that begins no token becomes a finding.
//! Its help is for the notation from which the character most probably comes.

use super::atom::{Atom, AtomKind, Placed, foreign_place_at, other_notation, typed_literal};
use super::contact_lexer::{bit_length, split};
use super::contact_signs::{ends_value, is_spaced_minus, no_spaces};
use super::expression::{Binary, ExpressionPartKind, Unary};
use super::finding::{Code, Finding};
use super::fix::{advise, possible, write};
use super::foreign_signs::{self, ForeignSign};
use super::indexed::rest_length;
use super::span::Span;
use super::was;
use rungd_engine::isa::Real;
pub use rungd_engine::isa::real::RealError;

/// A token.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum ExpressionToken {
    /// A constant or a name.
    Operand(ExpressionPartKind),
    /// An operator with two operands, or the `-` with one operand.
    Sign(Binary),
    /// `~` or `!`.
    Prefix(Unary),
    Open,
    Close,
    Comma,
    /// `[`.
    Index,
    /// `]`, and the rest of the name behind it: `].target`.
    IndexEnd(String),
    /// The number of a bit behind an index, as written: `.3`.
    WordBit(String),
}

/// The place of an expression, which decides how its names and numbers are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExpressionUse {
    /// Behind the `=` of a MATH, or the index of its target.
    Math,
    /// A side of a compare, or an index in a contact: literals are read as contacts read them.
    Contact,
}

/// All tokens of a text, each with its place; `span` is the place of the whole text.
///
/// # Errors
/// The first mistake.
pub(super) fn lex(
    text: &str,
    span: Span,
    used: ExpressionUse,
) -> Result<Vec<(ExpressionToken, Span)>, Finding> {
    split(text, span, |rest, first, at| {
        if used == ExpressionUse::Contact
            && first == '-'
            && ends_value(text[..at].trim_end())
            && !is_spaced_minus(text, at)
        {
            return Err(no_spaces(text, at, span));
        }
        let bit =
            if text[..at].ends_with(|c: char| c == ']' || c.is_ascii_alphanumeric() || c == '_') {
                bit_length(rest)
            } else {
                0
            };
        if bit > 0 {
            return Ok((ExpressionToken::WordBit(rest[1..bit].to_owned()), bit));
        }
        match sign(rest) {
            Some(found) => Ok(found),
            None => operand(rest, first, span.part(at, at + rest.len()), used),
        }
    })
}

/// Whether the sign at a place of a text is directly between letters, digits or `_`.
fn is_within_word(text: &str, at: usize) -> bool {
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text[..at].ends_with(is_letter) && text[at + 1..].starts_with(is_letter)
}

fn sign(rest: &str) -> Option<(ExpressionToken, usize)> {
    if is_foreign(rest) {
        return None;
    }
    let binary = Binary::ALL.iter().find(|operator| rest.starts_with(operator.sign()));
    if let Some(operator) = binary {
        return Some((ExpressionToken::Sign(*operator), operator.sign().len()));
    }
    let unary = Unary::ALL.iter().find(|operator| rest.starts_with(operator.sign()));
    if let Some(operator) = unary {
        return Some((ExpressionToken::Prefix(*operator), operator.sign().len()));
    }
    let token = match rest.as_bytes()[0] {
        b'(' => ExpressionToken::Open,
        b')' => ExpressionToken::Close,
        b',' => ExpressionToken::Comma,
        b'[' => ExpressionToken::Index,
        b']' => {
            let length = 1 + rest_length(&rest[1..]);
            return Some((ExpressionToken::IndexEnd(rest[1..length].to_owned()), length));
        }
        _ => return None,
    };
    Some((token, 1))
}

/// Whether a text begins with a sign of another notation: `&&` and `||` are signs of expressions.
fn is_foreign(rest: &str) -> bool {
    foreign_signs::at_start(rest).is_some_and(|sign| sign.math != sign.wrong)
}

fn operand(
    rest: &str,
    first: char,
    span: Span,
    used: ExpressionUse,
) -> Result<(ExpressionToken, usize), Finding> {
    if let Some(finding) = typed_literal(rest, span, Code::ExpressionSyntax) {
        return Err(finding);
    }
    if first.is_ascii_digit() {
        let length = number_length(rest);
        let (word, place) = (&rest[..length], span.part(0, length));
        let kind = match used {
            ExpressionUse::Math => number(word, place)?,
            ExpressionUse::Contact => number_of_contact(word, place)?,
        };
        return Ok((ExpressionToken::Operand(kind), length));
    }
    if used == ExpressionUse::Contact
        && let Some((name, length)) = was::read(rest, span)?
    {
        return Ok((ExpressionToken::Operand(ExpressionPartKind::Name(name)), length));
    }
    if first.is_ascii_alphabetic() || first == '$' || first == '_' {
        let length = name_length(rest, used);
        let slice = slice_length(&rest[length..]);
        let length = length + slice;
        let length = length + if slice > 0 { rest_length(&rest[length..]) } else { 0 };
        let place = Placed { rest: span, code: Code::ExpressionSyntax, takes_slash: false };
        if let Some(finding) = foreign_place_at(rest, length, place) {
            return Err(finding);
        }
        let name = rest[..length].replace([' ', '\t'], "");
        return Ok((ExpressionToken::Operand(ExpressionPartKind::Name(name)), length));
    }
    Err(stray(rest, first, span))
}

/// The length of a name. In a contact it also has each `-` that is directly between its letters.
pub(super) fn name_length(rest: &str, used: ExpressionUse) -> usize {
    let is_tail = |(at, c): (usize, char)| match c {
        '-' => used == ExpressionUse::Contact && is_within_word(rest, at),
        c => c.is_ascii_alphanumeric() || matches!(c, '_' | '.'),
    };
    let end = rest.char_indices().skip(1).find(|letter| !is_tail(*letter));
    end.map_or(rest.len(), |(at, _)| at)
}

/// The length of the slice behind a name (`[0..6]`), which is part of the name; 0 if there is none.
fn slice_length(behind: &str) -> usize {
    let Some(inner) = behind.strip_prefix('[') else { return 0 };
    let end = inner.find(['[', ']']).filter(|end| inner[..*end].contains(".."));
    end.filter(|end| inner[*end..].starts_with(']')).map_or(0, |end| end + 2)
}

/// The length of a number or duration, with the exponent of a real.
pub(super) fn number_length(rest: &str) -> usize {
    let tail = |c: char| !(c.is_ascii_alphanumeric() || matches!(c, '_' | ':' | '.'));
    let length = rest.find(tail).unwrap_or(rest.len());
    let mantissa = rest[..length].strip_suffix(['e', 'E']).unwrap_or("");
    let is_mantissa = mantissa.ends_with(|c: char| c.is_ascii_digit())
        && mantissa.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    let exponent = rest[length..].strip_prefix(['-', '+']).unwrap_or("");
    let digits = exponent.find(|c: char| !c.is_ascii_digit()).unwrap_or(exponent.len());
    if is_mantissa && digits > 0 { length + 1 + digits } else { length }
}

fn number(word: &str, span: Span) -> Result<ExpressionPartKind, Finding> {
    let error = |code, message: String| Finding::new(code, span, message);
    if let Some(digits) = word.strip_prefix("0x")
        && !digits.is_empty()
        && digits.bytes().all(|b| b.is_ascii_hexdigit())
    {
        let bits = u32::from_str_radix(digits, 16).map_err(|_| {
            let message = format!("`{word}` has more than 32 bits");
            error(Code::OutOfRange, message)
                .help(advise("the greatest is `{}`, which is -1", [possible("0xFFFFFFFF")]))
        })?;
        return Ok(ExpressionPartKind::Integer(i64::from(bits.cast_signed())));
    }
    if word.bytes().all(|b| b.is_ascii_digit()) {
        // A number with too many digits is too large, which the parser reports.
        return Ok(ExpressionPartKind::Integer(word.parse().unwrap_or(i64::MAX)));
    }
    if let Some(finding) = other_notation(word, span, Code::ExpressionSyntax) {
        return Err(finding);
    }
    if word.contains(['.', 'e', 'E']) && !word.contains(':') {
        return real(word, span);
    }
    match Atom::parse(word, span).map(|atom| atom.kind) {
        Ok(AtomKind::Duration(ms)) => Ok(ExpressionPartKind::Duration(ms)),
        Ok(_) => Err(error(Code::ExpressionSyntax, format!("`{word}` is no number"))),
        Err(mut finding) => {
            if finding.code == Code::InstructionSyntax {
                finding.code = Code::ExpressionSyntax;
            }
            Err(finding)
        }
    }
}

/// A number as contacts read it: an integer of 32 bits, a real or a duration.
fn number_of_contact(word: &str, span: Span) -> Result<ExpressionPartKind, Finding> {
    let is_decimal = word.bytes().all(|b| b.is_ascii_digit());
    if is_decimal {
        // The parser reports a number that is too large: -2147483648 is not.
        return Ok(ExpressionPartKind::Integer(word.parse().unwrap_or(i64::MAX)));
    }
    if word.eq_ignore_ascii_case("0x80000000") {
        // As -2147483648.
        return Ok(ExpressionPartKind::Integer(0x8000_0000));
    }
    match Atom::parse(word, span) {
        Ok(atom) => Ok(match atom.kind {
            AtomKind::Integer(n) => ExpressionPartKind::Integer(n.into()),
            AtomKind::Duration(ms) => ExpressionPartKind::Duration(ms),
            AtomKind::Real(real) => ExpressionPartKind::Real(real),
            AtomKind::Name(name) => ExpressionPartKind::Name(name),
        }),
        Err(mut finding) => {
            if finding.code == Code::InstructionSyntax {
                finding.code = Code::ExpressionSyntax;
            }
            Err(finding)
        }
    }
}

fn real(word: &str, span: Span) -> Result<ExpressionPartKind, Finding> {
    match word.parse() {
        Ok(real) => Ok(ExpressionPartKind::Real(real)),
        Err(RealError::Beyond) => {
            let message = format!("`{word}` lies beyond the largest real");
            let help = "a real is a binary32, up to `3.4028235e38`";
            let largest = possible("3.4028235e38");
            Err(Finding::new(Code::OutOfRange, span, message).help(help).fix(largest))
        }
        Err(RealError::Form) => {
            let right = word.to_ascii_lowercase().replace("e+", "e");
            let right = if right.ends_with('.') { format!("{right}0") } else { right };
            let help = match right != word && right.parse::<Real>().is_ok() {
                true => write(right),
                false => "a real has digits on both sides of its point, or an exponent: `12.5`, \
                          `1e3`, `2.5e-7`"
                    .into(),
            };
            let message = format!("`{word}` is no number");
            Err(Finding::new(Code::ExpressionSyntax, span, message).help(help))
        }
    }
}

/// The finding for a character that begins no token.
fn stray(rest: &str, first: char, span: Span) -> Finding {
    let finding = |message: String, length: usize| {
        Finding::new(Code::ExpressionSyntax, span.part(0, length.min(rest.len())), message)
    };
    if let Some(ForeignSign { wrong, math, .. }) = foreign_signs::at_start(rest) {
        return finding(format!("`{wrong}` is written `{math}`"), wrong.len()).write(math);
    }
    match first {
        '=' => finding("`=` in an expression".into(), 1)
            .help(advise("a compare is `{}`; one MATH stores in one target", [possible("==")])),
        '.' => finding("a point without digits before it".into(), 1)
            .help("a real has digits on both sides of its point: `0.5`"),
        '?' => finding("`?` is no operator".into(), 1).help("a choice is `if(c, x, y)`"),
        '"' | '\'' => finding("an expression has no quotes".into(), 1),
        c if c.is_alphabetic() => finding(format!("`{c}` belongs to no name"), c.len_utf8())
            .help("names are of the letters A to Z and a to z, digits and `_`: `groesse`"),
        c => {
            let message = format!("`{}` belongs to no expression", c.escape_debug());
            finding(message, c.len_utf8())
        }
    }
}
