//! Resolves contacts: every name becomes a bit, or a value in a compare. Called by `rung`.

use super::Resolver;
use super::program::{ConstantForm, Contact, Value};
use super::resolver::of_array;
use super::scope::{MisplacedName, NamedThing};
use crate::source::atom::{Atom, AtomKind};
use crate::source::contact::{self as written, Comparison};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{advise, possible, proposed};
use crate::source::span::Span;
use rungd_engine::isa::Address;

impl Resolver<'_> {
    /// Resolves a series of contacts; contacts with mistakes are left out and reported.
    pub(super) fn contacts(&mut self, contacts: &[written::WrittenContact]) -> Vec<Contact> {
        contacts.iter().filter_map(|contact| self.contact(contact)).collect()
    }

    pub(super) fn contact(&mut self, contact: &written::WrittenContact) -> Option<Contact> {
        match contact {
            written::WrittenContact::Bit(name) if self.is_difference(&name.value, name.span) => {
                None
            }
            written::WrittenContact::Bit(name) => self.bit(&name.value, name.span),
            written::WrittenContact::Indexed(computed) => self.computed_bit(computed),
            written::WrittenContact::Not(inner, span) => {
                Some(Contact::Not(Box::new(self.contact(inner)?), *span))
            }
            written::WrittenContact::All(items, span) => {
                Some(Contact::All(self.all_of(items)?, *span))
            }
            written::WrittenContact::Any(items, span) => {
                Some(Contact::Any(self.all_of(items)?, *span))
            }
            written::WrittenContact::Edge(edge, inner, span) => {
                Some(Contact::Edge(*edge, Box::new(self.contact(inner)?), *span))
            }
            written::WrittenContact::Compare(a, comparison, b, span) => {
                if self.is_bit_compared(contact) {
                    return None;
                }
                self.compare(a, b, *comparison, *span)
            }
        }
    }

    /// Whether a contact compares a bit with ON or OFF, in the words of any system: `b == TRUE`.
    /// Then its finding has been added.
    fn is_bit_compared(&mut self, contact: &written::WrittenContact) -> bool {
        let written::WrittenContact::Compare(a, how, b, span) = contact else { return false };
        let is_same = match how {
            Comparison::Eq => true,
            Comparison::Ne => false,
            Comparison::Lt | Comparison::Le | Comparison::Gt | Comparison::Ge => return false,
        };
        let (Some(name), Some(state)) = (a.atom().and_then(Atom::name), b.atom().and_then(state))
        else {
            return false;
        };
        let thing = self.scope.look_up(name).map(|found| found.thing);
        // Two bits may be compared.
        let is_bit = matches!(thing, Ok(NamedThing::Address(Address::Bit(_))));
        if !is_bit || self.is_bit_side(b) {
            return false;
        }
        self.mark_used(name);
        let right = if state == is_same { name.to_owned() } else { format!("!{name}") };
        let message = format!("`{name}` is a bit, not a number");
        let finding = Finding::new(Code::OperandType, *span, message);
        self.find(finding.help(advise("a bit stands alone: write `{}`", [right])));
        true
    }

    fn all_of(&mut self, items: &[written::WrittenContact]) -> Option<Vec<Contact>> {
        let contacts = self.contacts(items);
        (contacts.len() == items.len()).then_some(contacts)
    }

    /// Resolves a bit.
    pub(super) fn bit(&mut self, name: &str, span: Span) -> Option<Contact> {
        let thing = self.look_up(name, span)?;
        let help = match thing {
            NamedThing::Address(address @ Address::Bit(bit)) => {
                self.note(name, span, address);
                return Some(Contact::Bit(bit, span));
            }
            NamedThing::Element(element) if element.array.is_bits() => {
                return Some(Contact::Element(element, span));
            }
            NamedThing::Address(Address::Word(_)) | NamedThing::Element(_) => {
                advise("compare it: `{}`", [proposed(format!("{name} != 0"))])
            }
            NamedThing::Array(array) => of_array(name, array),
            NamedThing::Record(place) => self.scope.name_a_field(name, place),
            NamedThing::Address(Address::Structure(structure)) => {
                let flag = if structure.members().contains(&"Done") { "Done" } else { "DN" };
                advise("name one of its flags: `{}`", [possible(format!("{name}.{flag}"))])
            }
            NamedThing::Constant(..) | NamedThing::Real(_) => {
                let compare = possible(format!("D0 == {name}"));
                advise("compare something with it: `{}`", [compare])
            }
            NamedThing::Device(_) => {
                advise("`{}` is ON while it exchanges", [proposed(format!("{name}.Ok"))])
            }
            NamedThing::Block(_) if self.kind_words(thing) == "a subroutine" => {
                "it only executes: let its rungs set a bit of a tag".into()
            }
            NamedThing::Block(_) => {
                advise("`{}` is ON while it runs", [proposed(format!("{name}.Running"))])
            }
        };
        self.wrong_kind(MisplacedName { name, span, thing }, "a bit", help);
        None
    }

    /// Resolves a value: a constant or a word.
    pub(super) fn value(&mut self, atom: &Atom) -> Option<Value> {
        let name = match &atom.kind {
            AtomKind::Integer(n) => return Some(Value::Const(*n, ConstantForm::Integer)),
            AtomKind::Duration(ms) => return Some(Value::Const(*ms, ConstantForm::Duration)),
            AtomKind::Real(real) => return Some(Value::Real(*real)),
            AtomKind::Name(name) => name,
        };
        let thing = self.look_up_as(name, atom.span, &["int", "real", "word"])?;
        let help = match thing {
            NamedThing::Constant(value, written) => {
                self.note_constant(name, atom.span);
                return Some(Value::Const(value, written));
            }
            NamedThing::Real(real) => {
                self.note_constant(name, atom.span);
                return Some(Value::Real(real));
            }
            NamedThing::Address(address @ Address::Word(word)) => {
                self.note(name, atom.span, address);
                return Some(Value::Word(word));
            }
            NamedThing::Element(element) if !element.array.is_bits() => {
                return Some(Value::Element(element));
            }
            NamedThing::Array(array) => of_array(name, array),
            NamedThing::Record(place) => self.scope.name_a_field(name, place),
            NamedThing::Address(Address::Structure(structure)) => {
                let acc = if structure.members().contains(&"Acc") { "Acc" } else { "ACC" };
                advise("its value is `{}`", [proposed(format!("{name}.{acc}"))])
            }
            NamedThing::Address(Address::Bit(_)) | NamedThing::Element(_) => advise(
                "a bit stands alone in contacts: `{}`, or `{}`; a number is a constant or a word, \
                 as `{}`",
                [name.to_owned(), format!("!{name}"), "D0".to_owned()].map(possible),
            ),
            NamedThing::Block(_) | NamedThing::Device(_) => {
                advise("a number, a duration, or a word as `{}` belongs here", [possible("D0")])
            }
        };
        self.wrong_kind(MisplacedName { name, span: atom.span, thing }, "a number", help);
        None
    }
}

/// The state that a value means beside a bit.
fn state(value: &Atom) -> Option<bool> {
    match &value.kind {
        AtomKind::Integer(n @ (0 | 1)) => Some(*n == 1),
        AtomKind::Integer(_) | AtomKind::Duration(_) | AtomKind::Real(_) => None,
        AtomKind::Name(name) => match name.to_ascii_uppercase().as_str() {
            "TRUE" | "ON" | "$ON" => Some(true),
            "FALSE" | "OFF" | "$OFF" => Some(false),
            _ => None,
        },
    }
}
