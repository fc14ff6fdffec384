//! A condition as written, with its warnings.
//!
//! Called by `testing` for the conditions of a test file, and by `controller` for those of
//! `[[watch]]`.

use super::contact::WrittenContact;
use super::contact_parser::parse_condition;
use super::finding::{Code, Finding};
use super::fix::{advise, text as fix};
use super::span::Span;

/// A condition as written.
#[derive(Clone, Debug)]
pub struct WrittenCondition {
    /// The text.
    pub text: String,
    /// The place of the text.
    pub span: Span,
    /// The text as contacts.
    pub contact: WrittenContact,
}

impl WrittenCondition {
    /// The text of a place in it.
    pub fn text_of(&self, place: Span) -> &str {
        let [start, end] = [place.start, place.end].map(|at| (at - self.span.start) as usize);
        self.text.get(start..end).unwrap_or_default()
    }

    /// The warnings about it: `&` and `|` next to each other without parentheses.
    pub fn doubts(&self) -> Vec<Finding> {
        let mut found = Vec::new();
        doubts(&self.contact, &mut found);
        found
    }
}

fn doubts(contact: &WrittenContact, found: &mut Vec<Finding>) {
    let is_bare = |part: &WrittenContact| {
        if let WrittenContact::All(parts, span) = part {
            return parts.first().is_some_and(|first| first.span().start == span.start);
        }
        false
    };
    match contact {
        WrittenContact::Any(parts, span) => {
            if parts.iter().any(is_bare) {
                let message = "`&` and `|` are mixed without parentheses";
                let finding = Finding::new(Code::MixedAndOr, *span, message);
                let help = advise("as it is read now: `{}`", [fix(contact.to_string()).same()]);
                found.push(finding.label("`&` binds tighter").help(help));
            }
            parts.iter().for_each(|part| doubts(part, found));
        }
        WrittenContact::All(parts, _) => parts.iter().for_each(|part| doubts(part, found)),
        WrittenContact::Not(inner, _) | WrittenContact::Edge(_, inner, _) => doubts(inner, found),
        WrittenContact::Bit(_) | WrittenContact::Indexed(_) | WrittenContact::Compare(..) => {}
    }
}

/// Parses a condition; `span` is the place of its text.
///
/// # Errors
/// Its mistake.
pub fn condition(text: &str, span: Span) -> Result<WrittenCondition, Finding> {
    let contact = parse_condition(text, span)?;
    Ok(WrittenCondition { text: text.to_owned(), span, contact })
}
