//! Atoms: the names and constants that contacts, operands and tags are made of.
//!
//! [`Atom::parse`] distinguishes numbers, durations and names. Called by the parsers of contacts,
//! instructions and tags. It does not look names up; the resolver does.

use std::fmt;

use super::finding::{Code, Finding};
use super::fix::{Fix, Help, advise, possible, proposed, write};
use super::span::Span;
use rungd_engine::isa::duration::{self, DurationError};
use rungd_engine::isa::foreign_place::{self, ForeignPlace};
pub use rungd_engine::isa::real::RealError;
use rungd_engine::isa::{Real, decimal_comma, notation};

/// Whether a text has the form of a tag's name: a letter, then letters, digits and `_`.
pub fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(is_name_letter)
}

/// Whether a text has the form of a point of a simulated plant: two names with a dot between them;
/// the second name begins with a small letter.
pub fn is_plant_point(text: &str) -> bool {
    text.split_once('.').is_some_and(|(part, point)| {
        is_name(part) && is_name(point) && point.starts_with(char::is_lowercase)
    })
}

/// Whether a name may have this character after its first letter.
pub(crate) fn is_name_letter(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// A name or constant, and its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Atom {
    /// The name or constant.
    pub kind: AtomKind,
    /// Its place.
    pub span: Span,
}

/// The kind of an atom, with its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AtomKind {
    /// A name: of a tag, an address, a member, a stage or a nickname. Every word that is not a
    /// constant is a name.
    Name(String),
    /// An integer.
    Integer(i32),
    /// A duration in ms.
    Duration(i32),
    /// A real.
    Real(Real),
}

/// How a constant was written. The checks warn about bare integers as timer values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum ConstantForm {
    Integer,
    Duration,
}

impl ConstantForm {
    /// A constant as it would be written: `12`, `1m30s`.
    pub fn text(self, value: i32) -> String {
        match self {
            ConstantForm::Integer => value.to_string(),
            ConstantForm::Duration => duration::print(value),
        }
    }
}

impl Atom {
    /// Parses one word without spaces.
    ///
    /// # Errors
    /// A finding if the word begins like a constant but is not a valid one, or if it lies outside
    /// `i32`.
    pub fn parse(word: &str, span: Span) -> Result<Atom, Finding> {
        let digits = word.strip_prefix('-').unwrap_or(word);
        let kind = if digits.starts_with(|c: char| c.is_ascii_digit()) {
            constant(word, span)?
        } else if let Some(finding) = foreign_place(word, span, Code::InstructionSyntax) {
            return Err(finding);
        } else {
            AtomKind::Name(word.to_owned())
        };
        Ok(Atom { kind, span })
    }

    /// The name; `None` for a constant.
    pub fn name(&self) -> Option<&str> {
        match &self.kind {
            AtomKind::Name(name) => Some(name),
            AtomKind::Integer(_) | AtomKind::Duration(_) | AtomKind::Real(_) => None,
        }
    }
}

impl fmt::Display for Atom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.kind {
            AtomKind::Name(name) => f.write_str(name),
            AtomKind::Integer(n) => write!(f, "{n}"),
            AtomKind::Duration(ms) => f.write_str(&duration::print(*ms)),
            AtomKind::Real(real) => write!(f, "{real}"),
        }
    }
}

fn constant(word: &str, span: Span) -> Result<AtomKind, Finding> {
    let (sign, digits) = match word.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, word),
    };
    let hexadecimal = digits.strip_prefix("0x");
    match word.parse() {
        Ok(real) => return Ok(AtomKind::Real(real)),
        Err(RealError::Beyond) => {
            let message = format!("`{word}` lies beyond the largest real");
            let finding = Finding::new(Code::OutOfRange, span, message);
            return Err(finding.help("reals lie between -3.4028235e38 and 3.4028235e38"));
        }
        Err(RealError::Form) => {}
    }
    if hexadecimal.is_none() && !digits.bytes().all(|b| b.is_ascii_digit()) {
        if sign < 0 && duration::parse(digits).is_ok() {
            let finding = Finding::new(Code::BadDuration, span, "a duration is never negative");
            return Err(finding.help(advise("write `{}`, or a number of ms", [proposed(digits)])));
        }
        if !duration::looks_like(digits) && duration::of_fraction(digits).is_none() {
            return Err(no_number(word, span));
        }
        let ms = duration::parse(digits).map_err(|error| bad_duration(word, span, error))?;
        return Ok(AtomKind::Duration(ms));
    }
    let (digits, radix) = hexadecimal.map_or((digits, 10), |digits| (digits, 16));
    if digits.is_empty() || !digits.bytes().all(|b| char::from(b).is_digit(radix)) {
        return Err(no_number(word, span));
    }
    // Parsing fails here only for too many digits: the number is too large.
    let number = i64::from_str_radix(digits, radix).unwrap_or(i64::MAX).saturating_mul(sign);
    i32::try_from(number).map(AtomKind::Integer).map_err(|_| {
        let message = format!("`{word}` lies outside -2147483648..2147483647");
        let finding = Finding::new(Code::OutOfRange, span, message);
        match u32::try_from(number) {
            Ok(bits) if hexadecimal.is_some() => finding.help(advise(
                "numbers are signed 32-bit: the same bits are `{}`",
                [bits.cast_signed().to_string()],
            )),
            _ => {
                let nearest = if sign < 0 { i32::MIN } else { i32::MAX };
                finding.help("numbers are signed, of 32 bits").fix(possible(nearest.to_string()))
            }
        }
    })
}

/// The finding for a constant in the notation of another system: `16#FF`, `T#5s`.
pub(super) fn other_notation(word: &str, span: Span, code: Code) -> Option<Finding> {
    let right = notation::corrected(word)?;
    let message = format!("`{word}` is in the notation of other systems");
    Some(Finding::new(code, span, message).write(right))
}

/// The finding for a place of a word in the notation of another controller: `V0:3`, `N7:0/3`.
pub(super) fn foreign_place(word: &str, span: Span, code: Code) -> Option<Finding> {
    let help = match foreign_place::instead_of(word)? {
        ForeignPlace::Name(name) => write(name),
        ForeignPlace::Words(words) => words.into(),
    };
    let message = format!("`{word}` is in the notation of other controllers");
    Some(Finding::new(code, span, message).help(help))
}

/// As [`foreign_place()`], for the name at the beginning of a text; `length` bytes of it were read.
pub(super) fn foreign_place_at(rest: &str, length: usize, place: Placed) -> Option<Finding> {
    let tail = |c: char| !(c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | ':' | '/'));
    let end = rest[length..].find(tail).map_or(rest.len(), |end| length + end);
    let is_read = rest[length..].starts_with(':') || place.takes_slash;
    foreign_place(&rest[..end], place.rest.part(0, end), place.code).filter(|_| is_read)
}

/// The place of a name that [`foreign_place_at`] reads.
#[derive(Clone, Copy)]
pub(super) struct Placed {
    /// The place of the text from the name on.
    pub rest: Span,
    /// The code of the finding.
    pub code: Code,
    /// Whether a `/` behind a name is no sign of division.
    pub takes_slash: bool,
}

/// As [`other_notation`], for the constant with a `#` at the beginning of a text.
pub(super) fn typed_literal(rest: &str, span: Span, code: Code) -> Option<Finding> {
    let tail = |c: char| !(c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '#'));
    let sign = usize::from(rest.starts_with('-'));
    let length = rest[sign..].find(tail).map_or(rest.len(), |at| sign + at);
    let word = &rest[..length];
    let place = || span.part(0, length);
    word.contains('#').then(|| other_notation(word, place(), code)).flatten()
}

fn no_number(word: &str, span: Span) -> Finding {
    if let Some(right) = decimal_comma::corrected(word) {
        let finding = Finding::new(Code::InstructionSyntax, span, "a decimal comma in a number");
        return finding.write(right);
    }
    if let Some(finding) = other_notation(word, span, Code::InstructionSyntax) {
        return finding;
    }
    let message = format!("`{word}` is neither a number nor a duration");
    Finding::new(Code::InstructionSyntax, span, message).help(advise(
        "write `123`, `-5`, `0x1F`, a real: `12.5`, `2e-3`, or a duration: `{}`, `{}`; names begin \
         with a letter",
        ["250ms", "1m30s"].map(possible),
    ))
}

/// The duration in the form of a clock: `1m30s` for `1:30`.
fn minutes_and_seconds(text: &str) -> Option<Fix> {
    let (minutes, seconds) = text.split_once(':')?;
    let (minutes, seconds) = (minutes.parse::<u16>().ok()?, seconds.parse::<u16>().ok()?);
    Some(possible(format!("{minutes}m{seconds}s")))
}

/// The finding for a text that is not a duration.
pub fn bad_duration(text: &str, span: Span, error: DurationError) -> Finding {
    let (message, help) = match error {
        DurationError::Form if ["us", "µs", "ns"].iter().any(|unit| text.ends_with(unit)) => (
            format!("`{text}` is not a duration"),
            "the smallest unit is the millisecond: the least is `1ms`".into(),
        ),
        DurationError::Form if let Some(right) = duration::of_fraction(text) => {
            let message = format!("`{text}` is not a duration: its numbers are whole");
            let finding = Finding::new(Code::BadDuration, span, message);
            return finding.write(right);
        }
        DurationError::Form if let Some([first, second]) = duration::without_unit(text) => {
            let message = format!("`{text}` is not a duration: it lacks its unit");
            let finding = Finding::new(Code::BadDuration, span, message);
            return finding.help(advise("write `{}` or `{}`", [first, second].map(possible)));
        }
        DurationError::Form => (
            format!("`{text}` is not a duration"),
            Help::from("write `250ms`, `2s`, `1m30s`, `1h2m3s4ms`, or `HH:MM:SS:mmm`")
                .with_all(minutes_and_seconds(text))
                .with_all(["250ms", "2s", "1m30s"].map(possible)),
        ),
        DurationError::Order => {
            let message = format!("the units of `{text}` do not descend");
            let help = match duration::in_order(text) {
                Some(right) => write(right),
                None => advise("units descend, each once: `{}`", [possible("1h2m3s4ms")]),
            };
            return Finding::new(Code::BadDuration, span, message).help(help);
        }
        DurationError::TooLong => (
            format!("`{text}` is too long a duration"),
            advise("the longest is 2147483647 ms: `{}`", [possible("596h31m23s647ms")]),
        ),
    };
    Finding::new(Code::BadDuration, span, message).help(help)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(word: &str, expected: &str) {
        let found = match Atom::parse(word, Span::default()) {
            Ok(atom) => format!("{:?}", atom.kind),
            Err(finding) => finding.message,
        };
        assert_eq!(found, expected, "{word}");
    }

    #[test]
    fn constants_and_names_are_read_or_refused_with_a_reason() {
        check("12", "Integer(12)");
        check("-2147483648", "Integer(-2147483648)");
        check("0x1F", "Integer(31)");
        check("1m30s", "Duration(90000)");
        check("12.0", "Real(Real(1094713344))");
        check("-1e1", "Real(Real(-1092616193))");
        check("1e39", "`1e39` lies beyond the largest real");
        check("1.", "`1.` is neither a number nor a duration");
        check("00:00:02:500", "Duration(2500)");
        check("bottles.Acc", "Name(\"bottles.Acc\")");
        check("$100ms", "Name(\"$100ms\")");
        check("2147483648", "`2147483648` lies outside -2147483648..2147483647");
        check(
            "0xFFFFFFFFFFFFFFFFFFFF",
            "`0xFFFFFFFFFFFFFFFFFFFF` lies outside -2147483648..2147483647",
        );
        check("12a", "`12a` is neither a number nor a duration");
        check("0x", "`0x` is neither a number nor a duration");
        check("-5s", "a duration is never negative");
        check("5s1m", "the units of `5s1m` do not descend");
    }
}
