//! Contacts and values as text, with the names of the program: as an author would write them.
//!
//! Called by the helps of `check` and by the labels of drawings. The texts follow the grammar of
//! ladder files; a test in `check/conditions.rs` loads them again. Parentheses always separate `&`
//! from `|`.

use super::formula::{Formula, FormulaPart};
use super::name_book::NameBook;
use super::program::{ConstantForm, Contact, Value};
use crate::source::infix::{InfixPart, infix};
use rungd_engine::isa::{Address, duration};

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
            Contact::Compare(left, comparison, right, _) => {
                format!("{} {} {}", self.value(*left), comparison.sign(), self.value(*right))
            }
            Contact::Computed(computed, _) => self.formula(&computed.condition()),
        }
    }

    /// An expression as text, with the parentheses that it needs.
    pub fn formula(&self, formula: &Formula) -> String {
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
        let own = |part: &FormulaPart| match part {
            FormulaPart::Integer(value) => InfixPart::Operand(value.to_string()),
            FormulaPart::Real(value) => InfixPart::Operand(value.to_string()),
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

    /// A value as text.
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
