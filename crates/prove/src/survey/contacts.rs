//! The parts of a rung's contacts that a survey asks about: does a part ever matter?
//!
//! Called by `probes`. A part of a series matters where it alone keeps the leg OFF, a branch of a
//! parallel where it alone turns the leg ON. So each part has one condition that shows it: the leg
//! with that part as a constant, beside the leg as it is. A part for which this never comes could
//! be left out. What stands within an edge is one part with its edge.

use rungd_engine::isa::status::st;
use rungd_engine::isa::{Bit, BitSpace};
use rungd_language::resolve::program::Contact;
use rungd_language::source::span::Span;

/// A part of a leg.
pub(super) struct ContactPart {
    /// The part.
    pub part: Contact,
    /// The contacts of a leg that is ON where the part matters.
    pub matters: Vec<Contact>,
}

/// Always ON, or always OFF.
fn constant(is_on: bool) -> Contact {
    let number = if is_on { st::ON } else { st::OFF };
    Contact::Bit(Bit::Space(BitSpace::St, number), Span::default())
}

/// Whether a contact is `$On` or `$Off`, which their author has written on purpose.
fn is_constant(contact: &Contact) -> bool {
    if let Contact::Not(inner, _) = contact {
        return is_constant(inner);
    }
    let Contact::Bit(Bit::Space(BitSpace::St, number), _) = contact else { return false };
    matches!(*number, st::ON | st::OFF)
}

/// The opposite of a contact.
pub(crate) fn not(contact: Contact) -> Contact {
    Contact::Not(Box::new(contact), Span::default())
}

/// The parts of a leg. A leg of one contact is a series of one.
pub(super) fn parts(contacts: &[Contact]) -> Vec<ContactPart> {
    let leg = Contact::All(contacts.to_vec(), Span::default());
    let mut search = PartSearch { leg: &leg, path: Vec::new(), found: Vec::new() };
    search.visit(&leg, false);
    search.found
}

struct PartSearch<'c> {
    leg: &'c Contact,
    /// The number of the part in each contact around it.
    path: Vec<usize>,
    found: Vec<ContactPart>,
}

impl PartSearch<'_> {
    /// Visits the parts of a contact. `is_inverted`: an odd number of `!` stands around it.
    fn visit(&mut self, contact: &Contact, is_inverted: bool) {
        let (parts, is_series) = match contact {
            Contact::All(parts, _) => (parts.as_slice(), true),
            Contact::Any(parts, _) => (parts.as_slice(), false),
            Contact::Not(inner, _) => {
                self.path.push(0);
                self.visit(inner, !is_inverted);
                self.path.pop();
                return;
            }
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Edge(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => return,
        };
        for (at, part) in parts.iter().enumerate() {
            self.path.push(at);
            if !is_constant(part) {
                let other = replaced(self.leg, &self.path, is_series);
                // With the part as a constant, is the leg ON where it is OFF, or the reverse?
                let turns_on = is_series != is_inverted;
                let matters = match turns_on {
                    true => vec![other, not(self.leg.clone())],
                    false => vec![self.leg.clone(), not(other)],
                };
                self.found.push(ContactPart { part: part.clone(), matters });
            }
            self.visit(part, is_inverted);
            self.path.pop();
        }
    }
}

/// A contact with a part as a constant.
fn replaced(contact: &Contact, path: &[usize], is_on: bool) -> Contact {
    let [at, path @ ..] = path else { return constant(is_on) };
    let with = |parts: &[Contact]| {
        let mut parts = parts.to_vec();
        parts[*at] = replaced(&parts[*at], path, is_on);
        parts
    };
    match contact {
        Contact::All(parts, span) => Contact::All(with(parts), *span),
        Contact::Any(parts, span) => Contact::Any(with(parts), *span),
        Contact::Not(inner, span) => Contact::Not(Box::new(replaced(inner, path, is_on)), *span),
        Contact::Bit(..)
        | Contact::Element(..)
        | Contact::Edge(..)
        | Contact::Compare(..)
        | Contact::Computed(..) => contact.clone(),
    }
}
