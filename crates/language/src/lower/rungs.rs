//! The text of a rung, with addresses (for tags with a `type`, with their names): two rungs with
//! the same text do the same.
//!
//! Made while a program is lowered. A reload compares the texts to find the unedited rungs. The
//! text does not contain tags, comments or the written form of constants.

use std::borrow::Cow;
use std::fmt::{self, Write as _};
use std::sync::Arc;

use super::identity::{Identity, RungPartText};
use crate::resolve::formula::{Formula, FormulaPart};
use crate::resolve::instruction::OperandValue;
use crate::resolve::layers::Layers;
use crate::resolve::program::{Contact, Edge, Instruction, Rung, Value};
use crate::source::span::Span;
pub use rungd_engine::isa::{Address, LegName};

/// The usual length of a rung's text.
const TEXT_BYTES_MANY: usize = 128;

/// The text of a rung, without its name.
pub(super) fn text(identity: &Identity, rung: &Rung) -> String {
    let mut writer = RungWriter { identity, text: String::with_capacity(TEXT_BYTES_MANY) };
    for leg in &rung.legs {
        writer.add(format_args!("{:?}:", leg.name));
        writer.contacts(&leg.contacts, " ");
        writer.text.push(' ');
    }
    writer.body(&rung.body);
    for branch in &rung.branches {
        writer.text.push_str(" branch:");
        writer.contacts(&branch.contacts, " ");
        writer.text.push(' ');
        writer.body(&branch.body);
    }
    writer.text
}

/// The first instruction of a rung with its first operand: `CNT CT0`.
pub(super) fn acts(identity: &Identity, rung: &Rung) -> String {
    let Some((_, instruction)) = rung.instructions().next() else { return String::new() };
    let mut writer = RungWriter { identity, text: String::new() };
    writer.text.push_str(instruction.mnemonic.spec().name);
    writer.text.push(' ');
    instruction.operands.each().take(1).for_each(|(_, value)| writer.operand(value));
    writer.text
}

/// The text of an edge contact, by which a reload finds its history.
pub(super) fn edge_contact(identity: &Identity, edge: Edge, watched: &Contact) -> String {
    let mut writer = RungWriter { identity, text: String::new() };
    writer.edge_contact(edge, watched);
    writer.text
}

/// The places of a rung's text, part by part.
pub(super) fn parts(layers: &Layers, rung: &Rung) -> Arc<[RungPartText]> {
    let part = |key: Cow<'static, str>, texts: &mut dyn Iterator<Item = Span>| RungPartText {
        key,
        texts: texts.map(|span| layers.in_file(span)).collect(),
    };
    let contacts = |key: Cow<'static, str>, series: &[Contact]| {
        part(key, &mut series.iter().map(Contact::span))
    };
    let body = |key: Cow<'static, str>, instructions: &[Instruction]| {
        part(key, &mut instructions.iter().map(|one| one.span))
    };
    let mut parts = Vec::new();
    for leg in &rung.legs {
        let key = match leg.name {
            LegName::When => Cow::Borrowed("when"),
            keyed @ (LegName::Up
            | LegName::Dn
            | LegName::Rst
            | LegName::En
            | LegName::Data
            | LegName::Clk) => Cow::Owned(format!("leg.{}", keyed.key())),
        };
        parts.push(contacts(key, &leg.contacts));
    }
    parts.push(body(Cow::Borrowed("do"), &rung.body));
    for (number, branch) in (1..).zip(&rung.branches) {
        parts.push(contacts(format!("branch {number} when").into(), &branch.contacts));
        parts.push(body(format!("branch {number} do").into(), &branch.body));
    }
    parts.into()
}

/// Writes parts of a rung, one behind the other, into one text.
struct RungWriter<'i> {
    identity: &'i Identity,
    text: String,
}

impl RungWriter<'_> {
    fn add(&mut self, part: fmt::Arguments<'_>) {
        // A text never refuses what is written.
        let _ = self.text.write_fmt(part);
    }

    fn address(&mut self, address: Address) {
        self.identity.names.write_address(address, &mut self.text);
    }

    fn contacts(&mut self, series: &[Contact], between: &str) {
        self.text.push('(');
        for (at, one) in series.iter().enumerate() {
            self.text.push_str(if at > 0 { between } else { "" });
            self.contact(one);
        }
        self.text.push(')');
    }

    fn contact(&mut self, condition: &Contact) {
        match condition {
            Contact::Bit(bit, _) => self.address(Address::Bit(*bit)),
            Contact::Element(element, _) => self.text += &self.identity.element(element),
            Contact::Not(inner, _) => self.negated(inner),
            Contact::All(all, _) => self.contacts(all, " & "),
            Contact::Any(any, _) => self.contacts(any, " | "),
            Contact::Edge(edge, inner, _) => self.edge_contact(*edge, inner),
            Contact::Compare(a, how, b, _) => {
                self.value(*a);
                self.add(format_args!(" {} ", how.sign()));
                self.value(*b);
            }
            Contact::Computed(computed, _) => {
                self.text.push('(');
                let begin = self.text.len();
                self.formula(&computed.condition());
                if self.text[begin..].starts_with(' ') {
                    self.text.remove(begin);
                }
                self.text.push(')');
            }
        }
    }

    fn negated(&mut self, inner: &Contact) {
        let [open, close] = if let Contact::Compare(..) = inner { ["!(", ")"] } else { ["!", ""] };
        self.text.push_str(open);
        self.contact(inner);
        self.text.push_str(close);
    }

    fn edge_contact(&mut self, edge: Edge, watched: &Contact) {
        self.text.push_str(edge.name());
        match watched {
            Contact::All(..) | Contact::Any(..) => self.contact(watched),
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Not(..)
            | Contact::Edge(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => {
                self.text.push('(');
                self.contact(watched);
                self.text.push(')');
            }
        }
    }

    fn body(&mut self, instructions: &[Instruction]) {
        for (at, instruction) in instructions.iter().enumerate() {
            self.text.push_str(if at > 0 { ", " } else { "" });
            self.text.push_str(instruction.mnemonic.spec().name);
            for (name, value) in instruction.operands.each() {
                [" ", name, "="].into_iter().for_each(|part| self.text.push_str(part));
                self.operand(value);
            }
            if let Some(calculation) = &instruction.calculation {
                if let Some(index) = &calculation.index {
                    self.formula(index);
                    self.text.push_str(" =");
                }
                self.formula(&calculation.value);
            }
        }
    }

    fn operand(&mut self, operand: OperandValue) {
        match operand {
            OperandValue::Bit(bit) => self.address(Address::Bit(bit)),
            OperandValue::Word(word) => self.address(Address::Word(word)),
            OperandValue::Value(number) => self.value(number),
            OperandValue::Structure(structure) => self.address(Address::Structure(structure)),
            OperandValue::Block(block) => self.text += &self.identity.names.block(block).name,
            OperandValue::Stage(stage) => self.text += self.identity.names.stage(stage),
            OperandValue::Element(element) => self.text += &self.identity.element(&element),
            OperandValue::Array(array) => self.text += &self.identity.array(array),
            OperandValue::Run(run) => self.text += &self.identity.run(run),
        }
    }

    /// A formula in postfix order, so that it needs no parentheses.
    fn formula(&mut self, expression: &Formula) {
        for part in &expression.parts {
            self.text.push(' ');
            match part {
                FormulaPart::Integer(n) => self.add(format_args!("{}", n.number)),
                FormulaPart::Real(real) => self.add(format_args!("{real:?}")),
                FormulaPart::Word(word) => self.address(Address::Word(*word)),
                FormulaPart::Bit(bit) => self.address(Address::Bit(*bit)),
                FormulaPart::Element(array) => {
                    self.text += &self.identity.array(*array);
                    self.text.push_str("[]");
                }
                FormulaPart::Unary(operator, _) => self.add(format_args!("{operator:?}")),
                FormulaPart::Binary(operator, _) => self.add(format_args!("{operator:?}")),
                FormulaPart::Call(function, count, _) => {
                    self.add(format_args!("{}/{count}", function.spec().name));
                }
            }
        }
    }

    fn value(&mut self, number: Value) {
        match number {
            Value::Const(value, _) => self.add(format_args!("{value}")),
            Value::Real(real) => self.add(format_args!("{real}")),
            Value::Word(word) => self.address(Address::Word(word)),
            Value::Element(element) => self.text += &self.identity.element(&element),
        }
    }
}
