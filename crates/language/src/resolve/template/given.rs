//! Reads an argument according to the type of its parameter.

use super::kind::{ParameterKind, WantedOperand};
use crate::source::atom::{Atom, AtomKind};
use crate::source::contact::WrittenContact;
use crate::source::contact_parser;
use crate::source::contact_side::CompareSide;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, advise, possible};
use crate::source::indexed::{IndexedName, first_of};
use crate::source::reader::Text;
use crate::source::span::{FileId, Located, Span};
use rungd_engine::isa::Real;

/// An argument, which takes the place of a parameter.
#[derive(Clone, Debug)]
pub enum Given {
    /// Contacts, and their nesting depth.
    Contacts(WrittenContact, u32),
    /// A name or a constant.
    Atom(Atom),
}

/// Maximum number of bytes of an argument's text.
const BYTES_MAX: usize = 64 * 1024;

/// Reads an argument; `by` is the file, or the layer of the use, that contains its text.
///
/// # Errors
/// The finding for a text that cannot be the argument of a parameter of this type.
pub fn read(kind: ParameterKind, text: &Text, by: FileId) -> Result<Given, Box<Finding>> {
    let span = Span { file: by, ..text.span };
    let error = |message: String| Box::new(Finding::new(Code::TemplateArgument, span, message));
    if text.text.len() > BYTES_MAX {
        return Err(error(format!("an argument of more than {BYTES_MAX} bytes")));
    }
    if !text.exact {
        let finding = error("a string with `\\` or several lines".to_owned());
        return Err(Box::new(finding.help("write it plainly, on one line")));
    }
    if kind == ParameterKind::Contact {
        let contact = contact_parser::parse(&text.text, span).map_err(Box::new)?;
        return Ok(Given::contacts(contact));
    }
    let word = text.text.trim();
    let begin = text.text.len() - text.text.trim_start().len();
    let span = span.part(begin, begin + word.len());
    if let Some(help) = negated(kind, word) {
        return Err(Box::new(error(format!("`{word}` is not {}", kind.words())).help(help)));
    }
    if kind == ParameterKind::Record
        && IndexedName::of(word).is_some_and(|name| name.index.contains(".."))
    {
        let finding = error(format!("`{word}` is a slice, not a record"));
        let help = advise("give one record: `{}`", [possible(first_of(word))]);
        return Err(Box::new(finding.help(help)));
    }
    let legal = |c: char| c.is_ascii_alphanumeric() || "_-.,$:[]".contains(c);
    if word.is_empty() || !word.chars().all(legal) || !is_indexed_once(word) {
        let finding = error(format!("`{word}` is not {}", kind.words()));
        let example = possible(format!("\"{}\"", kind.example()));
        let help = advise("write one name or constant: `{}`", [example]);
        return Err(Box::new(finding.help(match contact_parser::parse(word, span) {
            Ok(_) if matches!(kind, ParameterKind::Bit) => {
                help.and("; a parameter with `type = \"contact\"` takes any contacts")
            }
            Ok(_) | Err(_) => help,
        })));
    }
    let atom = Atom::parse(word, span).map_err(Box::new)?;
    typed(kind, atom).map(Given::Atom)
}

/// The help for a name with a minus, given as a number.
fn negated(kind: ParameterKind, word: &str) -> Option<Help> {
    let name = word
        .strip_prefix('-')
        .filter(|_| matches!(kind.wanted(), WantedOperand::Whole | WantedOperand::Real))?;
    match name.to_ascii_lowercase().as_str() {
        "nan" | "inf" | "infinity" => {
            Some(advise("give a finite number: `{}`", [possible("-2.5e-7")]))
        }
        _ => name.starts_with(|c: char| c.is_ascii_alphabetic()).then(|| {
            format!("compute it in a rung above, `MATH negated = {word}`, and give `negated`")
                .into()
        }),
    }
}

/// Whether a word has no index, or exactly one, at its end or within it.
fn is_indexed_once(word: &str) -> bool {
    let has_brackets = |text: &str| text.contains(['[', ']']);
    if !has_brackets(word) {
        return true;
    }
    IndexedName::of(word).is_some_and(|IndexedName { base, index, behind }| {
        let is_one = !has_brackets(base) && !has_brackets(index) && !has_brackets(behind);
        is_one && !index.is_empty() && (behind.is_empty() || behind.starts_with('.'))
    })
}

/// Converts a constant to the parameter's type; a name stays as it is.
fn typed(kind: ParameterKind, atom: Atom) -> Result<Atom, Box<Finding>> {
    let wanted = kind.wanted();
    let kind_of = match (&atom.kind, wanted) {
        (AtomKind::Name(_), _)
        | (AtomKind::Integer(_) | AtomKind::Duration(_), WantedOperand::Whole)
        | (AtomKind::Real(_), WantedOperand::Real) => return Ok(atom),
        (AtomKind::Integer(n) | AtomKind::Duration(n), WantedOperand::Real) => {
            AtomKind::Real(Real::nearest(*n))
        }
        (AtomKind::Integer(_) | AtomKind::Duration(_) | AtomKind::Real(_), _) => {
            let message = format!("`{atom}` is a constant, not {}", kind.words());
            let finding = Finding::new(Code::TemplateArgument, atom.span, message);
            let finding = finding.label(format!("{} belongs here", kind.words()));
            let example = format!("\"{}\"", kind.example());
            let finding = finding.help(format!("for example `{example}`"));
            return Err(Box::new(finding.fix(possible(example))));
        }
    };
    Ok(Atom { kind: kind_of, span: atom.span })
}

/// The nesting depth of contacts.
fn depth(contact: &WrittenContact) -> u32 {
    match contact {
        WrittenContact::Bit(_) | WrittenContact::Indexed(_) | WrittenContact::Compare(..) => 1,
        WrittenContact::Not(inner, _) | WrittenContact::Edge(_, inner, _) => 1 + depth(inner),
        WrittenContact::All(items, _) | WrittenContact::Any(items, _) => {
            1 + items.iter().map(depth).max().unwrap_or(0)
        }
    }
}

impl Given {
    /// Contacts as an argument.
    pub fn contacts(contact: WrittenContact) -> Given {
        let depth = depth(&contact);
        Given::Contacts(contact, depth)
    }

    /// Its place.
    pub fn span(&self) -> Span {
        match self {
            Given::Contacts(contact, _) => contact.span(),
            Given::Atom(atom) => atom.span,
        }
    }
}

impl std::fmt::Display for Given {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Given::Contacts(contact, _) => contact.fmt(f),
            Given::Atom(atom) => atom.fmt(f),
        }
    }
}

/// The same contacts with different places, which `place` returns.
pub fn moved(contact: &WrittenContact, place: &mut dyn FnMut(Span) -> Span) -> WrittenContact {
    let mut all = |items: &[WrittenContact]| items.iter().map(|item| moved(item, place)).collect();
    match contact {
        WrittenContact::Bit(name) => {
            WrittenContact::Bit(Located { value: name.value.clone(), span: place(name.span) })
        }
        WrittenContact::Indexed(computed) => WrittenContact::Indexed(computed.moved(place)),
        WrittenContact::Not(inner, span) => {
            WrittenContact::Not(Box::new(moved(inner, place)), place(*span))
        }
        WrittenContact::All(items, span) => WrittenContact::All(all(items), place(*span)),
        WrittenContact::Any(items, span) => WrittenContact::Any(all(items), place(*span)),
        WrittenContact::Edge(edge, inner, span) => {
            WrittenContact::Edge(*edge, Box::new(moved(inner, place)), place(*span))
        }
        WrittenContact::Compare(a, comparison, b, span) => {
            let (a, b) = (moved_side(a, place), moved_side(b, place));
            WrittenContact::Compare(a, *comparison, b, place(*span))
        }
    }
}

fn moved_side(side: &CompareSide, place: &mut dyn FnMut(Span) -> Span) -> CompareSide {
    match side {
        CompareSide::Atom(atom) => CompareSide::Atom(moved_atom(atom, place)),
        CompareSide::Computed(computed) => CompareSide::Computed(computed.moved(place)),
    }
}

/// The same name or constant with a different place, which `place` returns.
pub fn moved_atom(atom: &Atom, place: &mut dyn FnMut(Span) -> Span) -> Atom {
    Atom { kind: atom.kind.clone(), span: place(atom.span) }
}
