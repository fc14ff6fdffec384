//! `was(x)`: in a condition of a test, the value of x at the end of the scan before.
//!
//! The lexers of contacts and of their expressions read the whole text as one name, `was(x)`, so a
//! condition has it wherever it has x. `testing` gives each such name a place of its own;
//! `contact_parser` refuses it in a ladder, which has a rung that remembers. Whether x is a place
//! is seen when names are resolved.

use super::contact::WrittenContact;
use super::contact_side::CompareSide;
use super::expression::{Expression, ExpressionPartKind};
use super::finding::{Code, Finding};
use super::fix::{advise, possible};
use super::span::{Located, Span};

/// The word before the parentheses.
pub const WAS: &str = "was";

/// Reads `was(x)` at the start of a text whose place is `span`: its name, and the length of its
/// text. `None`: the text begins with something else.
pub(super) fn read(text: &str, span: Span) -> Result<Option<(String, usize)>, Finding> {
    let Some(behind) = text.strip_prefix(WAS) else { return Ok(None) };
    let Some(inner) = behind.trim_start_matches([' ', '\t']).strip_prefix('(') else {
        return Ok(None);
    };
    let begin = text.len() - inner.len();
    let close = closing(inner);
    let place: String = match close {
        Some(end) => inner[..end].chars().filter(|c| !matches!(c, ' ' | '\t')).collect(),
        None => String::new(),
    };
    let length = close.map_or(text.len(), |end| begin + end + 1);
    if is_place(&place) {
        return Ok(Some((format!("{WAS}({place})"), length)));
    }
    let message = format!("`{WAS}` takes one place");
    let finding = Finding::new(Code::ContactSyntax, span.part(0, length), message);
    let words = "a bit, a word, a member, an element or a bit of a word: `{}`; of a sum, each \
                 place by itself";
    Err(finding.help(advise(words, [possible("was(D0)")])))
}

/// Where the `)` is that closes what is open before a text.
fn closing(text: &str) -> Option<usize> {
    let mut depth = 1;
    text.find(|c| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        depth == 0
    })
}

/// The place of x in the text of a `was(x)` whose place is `span`.
pub fn place_of_x(text: &str, span: Span) -> Span {
    let open = text.find('(').map_or(0, |at| at + 1);
    let inner = text[open..].trim_end_matches(')');
    let begin = open + inner.len() - inner.trim_start().len();
    span.part(begin, begin + inner.trim().len())
}

/// The place of the name of a bit or word: that of x for `was(x)`, else its own.
pub fn place_of_name(text: &str, span: Span) -> Span {
    place_in(text).map_or(span, |_| place_of_x(text, span))
}

/// Whether a text without spaces may be the name of a place.
fn is_place(text: &str) -> bool {
    let is_letter = |c: char| c.is_ascii_alphanumeric() || "_.$-[]".contains(c);
    text.starts_with(|c: char| c.is_ascii_alphabetic() || matches!(c, '$' | '_'))
        && text.chars().all(is_letter)
}

/// The x of a name `was(x)`; `None` for any other name.
pub fn place_in(name: &str) -> Option<&str> {
    name.strip_prefix(WAS)?.strip_prefix('(')?.strip_suffix(')')
}

/// The names `was(x)` in a contact, in order of their places, each with its place.
pub fn names(contact: &WrittenContact) -> Vec<Located<String>> {
    let mut found = Vec::new();
    visit(contact, &mut |name, span| {
        if place_in(name).is_some() {
            found.push(Located { value: name.to_owned(), span });
        }
    });
    found
}

/// All names in a contact, in order of their places, each with its place.
pub fn all_names(contact: &WrittenContact) -> Vec<Located<String>> {
    let mut found = Vec::new();
    visit(contact, &mut |name, span| found.push(Located { value: name.to_owned(), span }));
    found
}

/// Adds the names `was(x)` of a contact to these, each once.
pub fn add_names(contact: &WrittenContact, to: &mut Vec<String>) {
    for Located { value, .. } in names(contact) {
        if !to.contains(&value) {
            to.push(value);
        }
    }
}

fn visit(contact: &WrittenContact, add: &mut dyn FnMut(&str, Span)) {
    match contact {
        WrittenContact::Bit(name) => add(&name.value, name.span),
        WrittenContact::Indexed(computed) => of_expression(&computed.expression, add),
        WrittenContact::Compare(left, _, right, _) => {
            for side in [left, right] {
                match side {
                    CompareSide::Atom(atom) => {
                        atom.name().into_iter().for_each(|name| add(name, atom.span));
                    }
                    CompareSide::Computed(computed) => {
                        of_expression(&computed.expression, add);
                    }
                }
            }
        }
        WrittenContact::Not(inner, _) | WrittenContact::Edge(_, inner, _) => visit(inner, add),
        WrittenContact::All(parts, _) | WrittenContact::Any(parts, _) => {
            parts.iter().for_each(|part| visit(part, add));
        }
    }
}

fn of_expression(expression: &Expression, add: &mut dyn FnMut(&str, Span)) {
    for part in &expression.parts {
        if let ExpressionPartKind::Name(name) = &part.kind {
            add(name, part.span);
        }
    }
}

/// The finding for a `was(x)` in a ladder.
pub(super) fn in_ladder(contact: &WrittenContact) -> Option<Finding> {
    let Located { value, span } = names(contact).into_iter().next()?;
    let message = format!("`{value}` in a rung: `{WAS}` is for conditions of tests");
    let finding = Finding::new(Code::ContactSyntax, span, message);
    let x = place_in(&value).unwrap_or_default();
    Some(finding.help(format!(
        "a rung remembers by a tag of its own: the last rung of the scan copies `{x}` to it"
    )))
}
