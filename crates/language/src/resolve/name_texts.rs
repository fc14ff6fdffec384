//! Contacts and values as text, with the names of the program: as an author would write them.
//!
//! Called by the helps of `check` and by the labels of drawings. The texts follow the grammar of
//! ladder files; a test in `check/conditions.rs` loads them again. Parentheses always separate `&`
//! from `|`.

use super::formula::{Formula, FormulaPart};
use super::name_book::NameBook;
use super::named_constants::{numbers_of_formula, numbers_of_values};
use super::program::{ConstantForm, Contact, Value};
use crate::source::infix::{InfixPart, infix};
use crate::source::span::Span;
use rungd_engine::isa::{Address, duration};

/// The names of the constants of a text, one after the other.
struct ConstantNames<'b> {
    book: &'b NameBook,
    tags: std::vec::IntoIter<Option<usize>>,
}

impl ConstantNames<'_> {
    /// The next constant: its name, or else its text.
    fn next(&mut self, text: impl FnOnce() -> String) -> String {
        self.tags.next().flatten().map_or_else(text, |tag| self.book.tag_name(tag).to_owned())
    }
}

impl NameBook {
    /// A contact as text that can be placed beside `&` and `|`.
    pub fn grouped(&self, contact: &Contact) -> String {
        let text = self.contact(contact);
        match contact {
            Contact::All(..) | Contact::Any(..) => format!("({text})"),
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Not(..)
            | Contact::Edge(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => text,
        }
    }

    /// A contact as text.
    pub fn contact(&self, contact: &Contact) -> String {
        let join = |parts: &[Contact], operator: &str| {
            parts.iter().map(|part| self.grouped(part)).collect::<Vec<_>>().join(operator)
        };
        match contact {
            Contact::Bit(bit, _) => self.name(Address::Bit(*bit)),
            Contact::Element(element, _) => self.selected(element),
            Contact::Not(inner, _) => match &**inner {
                Contact::Bit(..) | Contact::Element(..) | Contact::Edge(..) => {
                    format!("!{}", self.contact(inner))
                }
                Contact::Computed(computed, _) if computed.compare.is_none() => {
                    format!("!{}", self.contact(inner))
                }
                Contact::Not(..)
                | Contact::All(..)
                | Contact::Any(..)
                | Contact::Compare(..)
                | Contact::Computed(..) => {
                    format!("!({})", self.contact(inner))
                }
            },
            Contact::All(parts, _) => join(parts, " & "),
            Contact::Any(parts, _) => join(parts, " | "),
            Contact::Edge(edge, inner, _) => format!("{}({})", edge.name(), self.contact(inner)),
            Contact::Compare(left, comparison, right, span) => {
                let mut named = self.constant_names(*span, &numbers_of_values(&[*left, *right]));
                let [left, right] =
                    [*left, *right].map(|value| self.named_value(value, &mut named));
                format!("{left} {} {right}", comparison.sign())
            }
            Contact::Computed(computed, span) => {
                let condition = computed.condition();
                let mut named = self.constant_names(*span, &numbers_of_formula(&condition));
                self.named_formula(&condition, &mut named)
            }
        }
    }

    /// The expressions of an instruction at a place as texts.
    pub fn formulas(&self, formulas: &[&Formula], place: Span) -> Vec<String> {
        let numbers: Vec<f64> = formulas.iter().flat_map(|one| numbers_of_formula(one)).collect();
        let mut named = self.constant_names(place, &numbers);
        formulas.iter().map(|formula| self.named_formula(formula, &mut named)).collect()
    }

    /// An expression as text, with the parentheses that it needs.
    fn named_formula(&self, formula: &Formula, named: &mut ConstantNames<'_>) -> String {
        let bit = |part: &FormulaPart| match part {
            FormulaPart::Element(array) => array.bit.map(|bit| InfixPart::WordBit(bit.to_string())),
            FormulaPart::Integer(_)
            | FormulaPart::Real(_)
            | FormulaPart::Word(_)
            | FormulaPart::Bit(_)
            | FormulaPart::Unary(..)
            | FormulaPart::Binary(..)
            | FormulaPart::Call(..) => None,
        };
        let mut own = |part: &FormulaPart| match part {
            FormulaPart::Integer(value) => InfixPart::Operand(named.next(|| value.to_string())),
            FormulaPart::Real(value) => InfixPart::Operand(named.next(|| value.to_string())),
            FormulaPart::Word(word) => InfixPart::Operand(self.name(Address::Word(*word))),
            FormulaPart::Bit(bit) => InfixPart::Operand(self.name(Address::Bit(*bit))),
            FormulaPart::Element(array) => InfixPart::Element(self.column(*array)),
            FormulaPart::Unary(operator, _) => InfixPart::Unary(*operator),
            FormulaPart::Binary(operator, _) => InfixPart::Binary(*operator),
            FormulaPart::Call(function, count, _) => InfixPart::Call(function.spec().name, *count),
        };
        let parts = formula.parts.iter();
        infix(parts.flat_map(|part| std::iter::once(own(part)).chain(bit(part))))
    }

    /// An operand's value at a place as text.
    pub fn value_at(&self, value: Value, place: Span) -> String {
        let mut named = self.constant_names(place, &numbers_of_values(&[value]));
        self.named_value(value, &mut named)
    }

    fn named_value(&self, value: Value, named: &mut ConstantNames<'_>) -> String {
        match value {
            Value::Const(..) | Value::Real(_) => named.next(|| self.value(value)),
            Value::Word(_) | Value::Element(_) => self.value(value),
        }
    }

    /// For each constant of a contact, an operand or an expression at this place, in the order of
    /// its text, the name that it has there.
    fn constant_names(&self, place: Span, numbers: &[f64]) -> ConstantNames<'_> {
        let tags = self.constants.tags(place, numbers);
        ConstantNames { book: self, tags: tags.into_iter() }
    }

    /// A value as text; a constant as its number.
    pub fn value(&self, value: Value) -> String {
        match value {
            Value::Const(ms, ConstantForm::Duration) => duration::print(ms),
            Value::Const(number, ConstantForm::Integer) => number.to_string(),
            Value::Real(real) => real.to_string(),
            Value::Word(word) => self.name(Address::Word(word)),
            Value::Element(element) => self.selected(&element),
        }
    }
}
