//! Helps for text that has no meaning in a contact: sums, functions, and the signs of other
//! notations.
//!
//! Called by `contact_lexer` and `contact_parser` when a text cannot be read. Each help shows text
//! that can be pasted as it is, with the author's own names and numbers.

use super::contact_dialects::{foreign, foreign_instruction};
use super::contact_signs::ends_value;
use super::contact_use::ContactUse;
use super::finding::{Code, Finding};
use super::fix::{Fix, FixEdit, Help, advise, possible, proposed, text as fix, write};
use super::foreign_signs::{self, ForeignSign};
use super::span::Span;
use rungd_engine::isa::address_text::{self, AddressError};
pub use rungd_engine::isa::function::ResultType;
pub use rungd_engine::isa::{Function, MemorySizes, decimal_comma};

/// The signs of compares, the longer ones first.
const COMPARES: [&str; 6] = ["==", "!=", "<=", ">=", "<", ">"];

/// The finding for the character at `at`, with which no contact can begin.
pub(super) fn stray(text: &str, at: usize, span: Span) -> Finding {
    let (before, rest) = (text[..at].trim(), &text[at..]);
    let first = rest.chars().next().unwrap_or(' ');
    let behind = rest[first.len_utf8()..].trim();
    let place = span.part(at, at + first.len_utf8());
    let word = &rest[first.len_utf8()..];
    let word = word.split(|c: char| !c.is_ascii_alphanumeric()).next().unwrap_or_default();
    let finding = |message: String, place| Finding::new(Code::ContactSyntax, place, message);
    if let Some(ForeignSign { wrong, contact, .. }) = foreign_signs::at_start(rest) {
        let signs = span.part(at, at + wrong.len());
        return finding(format!("`{wrong}` is written `{contact}`"), signs).write(contact);
    }
    let is_sum = ends_value(before) && !behind.is_empty();
    let is_compared = COMPARES.iter().any(|sign| text.contains(sign));
    match first {
        '=' => finding("`=` is written `==`".into(), place).write("=="),
        '+' if !is_sum && behind.starts_with(|c: char| c.is_ascii_digit()) => {
            finding("a number has no `+`".into(), place).help("take the `+` away").fix("")
        }
        '+' if rest[1..].starts_with(|c: char| c.is_ascii_digit()) && is_after_compare(before) => {
            finding("a number has no `+`".into(), place).help("take the `+` away").fix("")
        }
        '%' if !is_sum => finding("`%` belongs to no contact".into(), place)
            .help("addresses go without `%`: `X0`, `Y0`, `C0`, `D0`")
            .fix(fix(word).at(span.part(at, at + 1 + word.len()))),
        '+' | '-' | '*' | '%' => {
            finding(format!("`{first}` in a contact"), place).help(computed(text, at, span))
        }
        '/' | '^' if is_sum && is_compared => {
            finding(format!("`{first}` in a contact"), place).help(computed(text, at, span))
        }
        '/' | '~' | '^' => finding(format!("`{first}` does not negate a contact"), place)
            .help(negated(before, behind, span.part(at, text.len()))),
        ',' => foreign(text, span)
            .or_else(|| foreign_instruction(text, span))
            .unwrap_or_else(|| comma(text, at, span)),
        c if c.is_alphabetic() => finding(format!("`{c}` belongs to no name"), place)
            .help("names are of the letters A to Z and a to z, digits and `_`: `groesse`"),
        '"' | '\'' => finding(format!("`{first}` belongs to no contact"), place)
            .help("a name has no quotes of its own: `X0`")
            .fix(fix(word).at(span.part(at, at + word.len() + 2))),
        _ => finding(format!("`{}` belongs to no contact", first.escape_debug()), place)
            .help(notation(first))
            .fixes(without_sign(text, first, span)),
    }
}

fn is_after_compare(before: &str) -> bool {
    before.ends_with(['=', '<', '>'])
}

/// The help for a text that is no contact.
const CONTACT_FORMS: &str =
    "a contact is a bit, a compare or an edge: `X0`, `!X0`, `D0 > 3`, `rise(X0)`";

/// The help for a character that contacts never contain.
fn notation(first: char) -> Help {
    match first {
        '[' | ']' => "contacts go without brackets; an index follows its name: `recipe[3]`".into(),
        ';' => "contacts in series are strings of their own: `[\"X0\", \"X1\"]`".into(),
        '.' => advise(
            "a member follows its name without a space: `{}`; a real begins with a digit",
            [possible("T0.Done")],
        ),
        ':' => Help::from("take it away; a duration reads `1m30s`").with(possible(FixEdit::Delete)),
        _ => CONTACT_FORMS.into(),
    }
}

/// The help for contacts with no sign between them.
pub(super) fn in_series(before: &str, behind: &str) -> Help {
    let is_name = |word: &str| word.chars().all(|c| c.is_ascii_alphanumeric() || "_.$".contains(c));
    let begins = behind.trim_start_matches(['!', '(', '$']);
    let is_contact = begins.starts_with(|c: char| c.is_ascii_alphanumeric());
    if !is_contact || !is_balanced(before) || !is_balanced(behind) {
        return CONTACT_FORMS.into();
    }
    let parts: Vec<&str> = match behind.split_whitespace().all(is_name) {
        true => std::iter::once(before).chain(behind.split_whitespace()).collect(),
        false => vec![before, behind],
    };
    strings(&parts)
}

/// The help to write contacts as elements of their own.
fn strings(contacts: &[&str]) -> Help {
    let elements = format!("\"{}\"", contacts.join("\", \""));
    advise("contacts in series are strings of their own: `{}`", [proposed(elements)])
}

/// The text of contacts without the separators or brackets of another notation.
fn without_sign(text: &str, sign: char, span: Span) -> Option<Fix> {
    match sign {
        ',' | ';' => {
            let parts: Vec<&str> = text.split(sign).map(str::trim).collect();
            let are_whole = parts.iter().all(|part| !part.is_empty() && is_balanced(part));
            are_whole.then(|| possible(format!("\"{}\"", parts.join("\", \""))))
        }
        '[' | ']' => Some(possible(text.replace(['[', ']'], "")).at(span)),
        _ => None,
    }
}

fn is_balanced(text: &str) -> bool {
    text.matches('(').count() == text.matches(')').count()
}

/// The help for a foreign sign of negation between two texts; `rest`: the place from the sign on.
fn negated(before: &str, behind: &str, rest: Span) -> Help {
    let right = format!("!{behind}");
    match before.is_empty() || before.ends_with(['&', '|', '(', '!']) {
        true => write(fix(right).at(rest)),
        false => strings(&[before, &right]),
    }
}

/// The finding for a comma: a decimal comma in a number, or a comma between contacts.
fn comma(text: &str, at: usize, span: Span) -> Finding {
    let place = span.part(at, at + 1);
    let digits = |c: char| c.is_ascii_digit();
    let whole = text[..at].trim_end_matches(digits);
    let fraction = text[at + 1..].starts_with(digits);
    let number = whole.len() < at && whole.ends_with([' ', '=', '<', '>', '-']);
    let behind = &text[at + 1..];
    let unit = behind.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(behind.len());
    let written = &text[whole.len()..at + 1 + unit];
    if let Some(right) = decimal_comma::corrected(written).filter(|_| number && fraction) {
        let right = format!("{whole}{right}{}", &behind[unit..]);
        let finding = Finding::new(Code::ContactSyntax, place, "a decimal comma in a number");
        return finding.write(fix(right.trim()).at(span));
    }
    Finding::new(Code::ContactSyntax, place, "a comma in a contact")
        .help("contacts in series are strings of their own: `[\"X0\", \"X1\"]`")
        .fixes(without_sign(text, ',', span))
}

/// The help for a sum or a function at a place of a contact: MATH computes it in an earlier rung.
pub(super) fn computed(text: &str, at: usize, span: Span) -> Help {
    let start = text[..at].rfind(['&', '|']).map_or(0, |sign| sign + 1);
    let end = text[at..].find(['&', '|']).map_or(text.len(), |sign| at + sign);
    let (piece, at) = (&text[start..end], at - start);
    let skipped = piece.len() - piece.trim_start_matches([' ', '!']).len();
    let (piece, at) = (&piece[skipped..], at.saturating_sub(skipped));
    let place = span.part(start + skipped, start + skipped + piece.trim_end().len());
    let sign = COMPARES.iter().find_map(|sign| Some((*sign, piece.find(sign)?)));
    let (formula, compare) = match sign {
        _ if !is_balanced(piece) => ("…".to_owned(), "result > …".to_owned()),
        // A compare within parentheses, as of `rise(…)`.
        Some((_, middle)) if !is_balanced(&piece[..middle]) => {
            ("…".to_owned(), "result > …".to_owned())
        }
        None => (piece.trim().to_owned(), "result != 0".to_owned()),
        Some((sign, middle)) => {
            let (left, right) = (piece[..middle].trim(), piece[middle + sign.len()..].trim());
            match at < middle {
                true => (left.to_owned(), format!("result {sign} {right}")),
                false => (right.to_owned(), format!("{left} {sign} result")),
            }
        }
    };
    computed_as(&formula, &compare, place)
}

/// The help for a word with a mask: MATH computes it, and in conditions of tests a `&` in
/// parentheses.
pub(super) fn masked(formula: &str, compare: &str, used: ContactUse, place: Span) -> Help {
    match used {
        ContactUse::Test if formula.contains('&') && !formula.contains('|') => {
            write(fix(format!("({formula}) {compare}")).at(place))
        }
        ContactUse::Test => {
            "a condition has of the signs for bits only `&`, in parentheses: let a \
                             MATH of the ladder compute this, and compare its result"
                .into()
        }
        ContactUse::Ladder => computed_as(formula, &format!("result {compare}"), place),
    }
}

/// As [`computed`], for a known formula and the compare of its result.
fn computed_as(formula: &str, compare: &str, place: Span) -> Help {
    let kind = if is_real(formula) { "real" } else { "int" };
    let tag = format!("result = {{ type = \"{kind}\" }}");
    let math = format!("MATH result = {formula}");
    let help = Help::from(format!(
        "MATH computes it: declare `{tag}` under [tags], write `{math}` in a rung before, and \
         `{compare}` here"
    ));
    match formula {
        "…" => help,
        _ => help.with(
            proposed(compare).at(place).after(FixEdit::Before(math)).after(FixEdit::Declare(tag)),
        ),
    }
}

/// Whether the text of a formula shows a real: `1.5`, `sqrt(…)`.
fn is_real(formula: &str) -> bool {
    let bytes = formula.as_bytes();
    let digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
    let point = formula.match_indices('.').any(|(at, _)| at > 0 && digit(at - 1) && digit(at + 1));
    let function = formula.split('(').next().and_then(|name| Function::from_name(name.trim()));
    point || function.is_some_and(|function| function.spec().result == ResultType::Real)
}

/// The help for an address in two words: `X 0`.
pub(super) fn split_address(text: &str, at: usize, span: Span) -> Option<Help> {
    let before = text[..at].trim_end();
    let letters = before.rsplit([' ', '(', '!', '&', '|']).next()?;
    let number = text[at..].split(|c: char| !c.is_ascii_digit()).next()?;
    let place = span.part(before.len() - letters.len(), at + number.len());
    if letters.is_empty() || number.is_empty() {
        return None;
    }
    let address = format!("{letters}{number}");
    let right = match address_text::parse(&address, &MemorySizes::default()) {
        Ok(_) => address,
        Err(AddressError::Case(right) | AddressError::LeadingZero(right)) => right,
        Err(
            AddressError::NotAnAddress
            | AddressError::BeyondMemory { .. }
            | AddressError::UnknownMember(_)
            | AddressError::UnknownNickname
            | AddressError::SensaphoneElement
            | AddressError::NoBits(_)
            | AddressError::UnknownBit(_),
        ) => return None,
    };
    Some(advise("an address is one word: `{}`", [fix(right).at(place)]))
}
