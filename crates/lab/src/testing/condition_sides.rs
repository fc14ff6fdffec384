//! The sides of a condition: what may not be all at once. `!(up & down)` has the sides `up` and
//! `down`, and `level <= 95 | !inlet` has `level > 95`, written `!(level <= 95)`, and `inlet`.
//!
//! `rungd-prove` shows that each side can be: a line that is never near being broken says nothing.

use super::condition::Condition;
use rungd_engine::Layout;
use rungd_language::resolve::condition::ResolvedCondition;
use rungd_language::resolve::program::Contact;
use rungd_language::source::span::SourceFile;

impl Condition {
    /// Its sides, if it has several: if all of them are true, the condition is false. `file`: the
    /// test file; `layout`: the cells of its conditions.
    pub fn sides(&self, file: &SourceFile, layout: &Layout) -> Vec<Condition> {
        let mut sides = Vec::new();
        none_of(&self.contact, true, &mut sides);
        if sides.len() < 2 {
            return Vec::new();
        }
        let side = |(contact, text): (Contact, String)| Condition::of(contact, &text, layout);
        sides.iter().map(|written| side(written.in_file(file))).collect()
    }

    /// A condition without names of operands, for a step of a run that a proof has found.
    pub fn of(contact: Contact, text: &str, layout: &Layout) -> Condition {
        let (reads, elements) = (Vec::new(), Vec::new());
        Condition::new(text, ResolvedCondition { contact, reads, elements }, layout)
    }
}

/// A part of a condition that is true or false.
struct Side<'c> {
    contact: &'c Contact,
    is_true: bool,
}

impl Side<'_> {
    /// The contact that is ON if the side is so, and its text.
    fn in_file(&self, file: &SourceFile) -> (Contact, String) {
        let span = self.contact.span();
        let text = file.text.get(span.start as usize..span.end as usize).unwrap_or_default();
        if self.is_true {
            return (self.contact.clone(), text.to_owned());
        }
        let is_plain = matches!(self.contact, Contact::Bit(..) | Contact::Element(..));
        let text = if is_plain || text.starts_with('(') {
            format!("!{text}")
        } else {
            format!("!({text})")
        };
        (Contact::Not(Box::new(self.contact.clone()), span), text)
    }
}

/// Adds the parts that are all so exactly if the contact is not `is_true`.
fn none_of<'c>(contact: &'c Contact, is_true: bool, sides: &mut Vec<Side<'c>>) {
    match (contact, is_true) {
        (Contact::Not(inner, _), _) => none_of(inner, !is_true, sides),
        (Contact::Any(parts, _), true) | (Contact::All(parts, _), false) => {
            parts.iter().for_each(|part| none_of(part, is_true, sides));
        }
        (Contact::All(..), true)
        | (Contact::Any(..), false)
        | (
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Edge(..)
            | Contact::Compare(..)
            | Contact::Computed(..),
            _,
        ) => sides.push(Side { contact, is_true: !is_true }),
    }
}
