//! The places where the ladder names a constant, so that its contacts and instructions are shown
//! with the name and not with the number.
//!
//! A resolved contact or expression has only the number, and its place. A name is shown only where
//! it is certain: where a contact has the same number twice and one of them by name, both are
//! shown as numbers. So are the constants of a template's arguments within a compare, whose places
//! are outside the contact.

use super::formula::{Formula, FormulaPart};
use super::tag::{Tag, TagMeaning};
use super::value::Value;
use crate::source::span::Span;

/// A place where the ladder names a constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamedConstant {
    /// The place of the name.
    pub span: Span,
    /// The index of the tag in the program.
    pub tag: usize,
    /// The number; of a duration, ms.
    number: f64,
}

/// All places where the ladder names a constant, in order of place.
#[derive(Clone, Debug, Default)]
pub struct NamedConstants(Vec<NamedConstant>);

impl NamedConstants {
    /// `places`: each with the index of its tag.
    pub(super) fn of(places: Vec<(Span, usize)>, tags: &[Tag]) -> NamedConstants {
        let named = places.into_iter().filter_map(|(span, tag)| {
            let number = match tags.get(tag)?.meaning {
                TagMeaning::Constant(number, _) => number.into(),
                TagMeaning::Real(real) => real.into(),
                TagMeaning::Address(_) | TagMeaning::Array(_) => return None,
            };
            Some(NamedConstant { span, tag, number })
        });
        let mut all: Vec<NamedConstant> = named.collect();
        all.sort_unstable_by_key(|named| (named.span, named.tag));
        all.dedup();
        NamedConstants(all)
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &NamedConstant> {
        self.0.iter()
    }

    /// Those within a place.
    pub fn within(&self, place: Span) -> &[NamedConstant] {
        let begins = |named: &NamedConstant| (named.span.file, named.span.start);
        let first = self.0.partition_point(|named| begins(named) < (place.file, place.start));
        let rest = &self.0[first..];
        &rest[..rest.partition_point(|named| begins(named) < (place.file, place.end))]
    }

    /// For each constant of a contact, an operand or an expression at this place, in the order of
    /// its text, the tag that names it there.
    pub(super) fn tags(&self, place: Span, numbers: &[f64]) -> Vec<Option<usize>> {
        let named = self.within(place);
        let nothing = vec![None; numbers.len()];
        if named.is_empty() {
            return nothing;
        }
        let mut first = nothing.clone();
        let mut last = nothing.clone();
        let mut waiting = named.iter().peekable();
        for (at, number) in numbers.iter().enumerate() {
            first[at] = waiting.next_if(|named| named.number == *number).map(|named| named.tag);
        }
        let is_whole = waiting.peek().is_none();
        let mut waiting = named.iter().rev().peekable();
        for (at, number) in numbers.iter().enumerate().rev() {
            last[at] = waiting.next_if(|named| named.number == *number).map(|named| named.tag);
        }
        if is_whole && first == last { first } else { nothing }
    }
}

/// The constants of values, as numbers in their order.
pub(super) fn numbers_of_values(values: &[Value]) -> Vec<f64> {
    values.iter().filter_map(|value| value.constant()).collect()
}

/// The constants of an expression, as numbers in the order of its text.
pub(super) fn numbers_of_formula(formula: &Formula) -> Vec<f64> {
    let numbers = formula.parts.iter().filter_map(|part| match part {
        FormulaPart::Integer(constant) => Some(constant.number as f64),
        FormulaPart::Real(real) => Some(f64::from(*real)),
        FormulaPart::Word(_)
        | FormulaPart::Bit(_)
        | FormulaPart::Element(_)
        | FormulaPart::Unary(..)
        | FormulaPart::Binary(..)
        | FormulaPart::Call(..) => None,
    });
    numbers.collect()
}
