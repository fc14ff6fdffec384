//! The text of a rung, with addresses (for tags with a `type`, with their names): two rungs with
//! the same text do the same.
//!
//! Made while a program is lowered. A reload compares the texts to find the unedited rungs. The
//! text does not contain tags, comments or the written form of constants.

use std::sync::Arc;

use super::identity::{Identity, RungPartText};
use crate::resolve::formula::{Formula, FormulaPart};
use crate::resolve::instruction::OperandValue;
use crate::resolve::layers::Layers;
use crate::resolve::program::{Contact, Edge, Instruction, Rung, Value};
use crate::source::span::Span;
pub use rungd_engine::isa::{Address, LegName};

/// The text of a rung, without its name.
pub(super) fn text(identity: &Identity, rung: &Rung) -> String {
    let mut text = String::new();
    for leg in &rung.legs {
        text += &format!("{:?}:{} ", leg.name, contacts(identity, &leg.contacts, " "));
    }
    text += &body(identity, &rung.body);
    for branch in &rung.branches {
        let (when, body) =
            (contacts(identity, &branch.contacts, " "), body(identity, &branch.body));
        text += &format!(" branch:{when} {body}");
    }
    text
}

/// The places of a rung's text, part by part.
pub(super) fn parts(layers: &Layers, rung: &Rung) -> Arc<[RungPartText]> {
    let part = |key: String, texts: &mut dyn Iterator<Item = Span>| RungPartText {
        key,
        texts: texts.map(|span| layers.in_file(span)).collect(),
    };
    let contacts =
        |key: String, series: &[Contact]| part(key, &mut series.iter().map(Contact::span));
    let body = |key: String, instructions: &[Instruction]| {
        part(key, &mut instructions.iter().map(|one| one.span))
    };
    let mut parts = Vec::new();
    for leg in &rung.legs {
        let key = match leg.name {
            LegName::When => "when".to_owned(),
            keyed @ (LegName::Up
            | LegName::Dn
            | LegName::Rst
            | LegName::En
            | LegName::Data
            | LegName::Clk) => format!("leg.{}", keyed.key()),
        };
        parts.push(contacts(key, &leg.contacts));
    }
    parts.push(body("do".to_owned(), &rung.body));
    for (number, branch) in (1..).zip(&rung.branches) {
        parts.push(contacts(format!("branch {number} when"), &branch.contacts));
        parts.push(body(format!("branch {number} do"), &branch.body));
    }
    parts.into()
}

fn contacts(identity: &Identity, series: &[Contact], between: &str) -> String {
    let said: Vec<_> = series.iter().map(|one| contact(identity, one)).collect();
    format!("({})", said.join(between))
}

fn contact(identity: &Identity, condition: &Contact) -> String {
    match condition {
        Contact::Bit(bit, _) => identity.address(Address::Bit(*bit)),
        Contact::Element(element, _) => identity.element(element),
        Contact::Not(inner, _) => format!("!{}", grouped(identity, inner)),
        Contact::All(all, _) => contacts(identity, all, " & "),
        Contact::Any(any, _) => contacts(identity, any, " | "),
        Contact::Edge(edge, inner, _) => edge_contact(identity, *edge, inner),
        Contact::Compare(a, how, b, _) => {
            format!("{} {} {}", value(identity, *a), how.sign(), value(identity, *b))
        }
        Contact::Computed(computed, _) => {
            format!("({})", formula(identity, &computed.condition()).trim_start())
        }
    }
}

/// The text of a contact behind `!`.
fn grouped(identity: &Identity, inner: &Contact) -> String {
    let text = contact(identity, inner);
    if let Contact::Compare(..) = inner { format!("({text})") } else { text }
}

/// The text of an edge contact, by which a reload finds its history.
pub(super) fn edge_contact(identity: &Identity, edge: Edge, watched: &Contact) -> String {
    let inner = contact(identity, watched);
    match watched {
        Contact::All(..) | Contact::Any(..) => format!("{}{inner}", edge.name()),
        Contact::Bit(..)
        | Contact::Element(..)
        | Contact::Not(..)
        | Contact::Edge(..)
        | Contact::Compare(..)
        | Contact::Computed(..) => format!("{}({inner})", edge.name()),
    }
}

fn body(identity: &Identity, instructions: &[Instruction]) -> String {
    let one = |instruction: &Instruction| {
        let operands = instruction
            .operands
            .each()
            .map(|(name, value)| format!(" {name}={}", operand(identity, value)));
        let formula = instruction.calculation.iter().flat_map(|calculation| {
            let index = calculation.index.iter().map(|index| formula(identity, index) + " =");
            index.chain([formula(identity, &calculation.value)])
        });
        let formula: String = formula.collect();
        let name = instruction.mnemonic.spec().name;
        format!("{name}{}{formula}", operands.collect::<String>())
    };
    instructions.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// The first instruction of a rung with its first operand: `CNT CT0`.
pub(super) fn acts(identity: &Identity, rung: &Rung) -> String {
    let Some((_, instruction)) = rung.instructions().next() else { return String::new() };
    let first = instruction
        .operands
        .each()
        .next()
        .map(|(_, value)| operand(identity, value))
        .unwrap_or_default();
    format!("{} {first}", instruction.mnemonic.spec().name)
}

fn operand(identity: &Identity, operand_value: OperandValue) -> String {
    match operand_value {
        OperandValue::Bit(bit) => identity.address(Address::Bit(bit)),
        OperandValue::Word(word) => identity.address(Address::Word(word)),
        OperandValue::Value(number) => value(identity, number),
        OperandValue::Structure(structure) => identity.address(Address::Structure(structure)),
        OperandValue::Block(block) => identity.names.block(block).name.clone(),
        OperandValue::Stage(stage) => identity.names.stage(stage).to_owned(),
        OperandValue::Element(element) => identity.element(&element),
        OperandValue::Array(array) => identity.array(array),
        OperandValue::Run(run) => identity.run(run),
    }
}

/// A formula in postfix order, so that it needs no parentheses.
fn formula(identity: &Identity, expression: &Formula) -> String {
    let part = |part: &FormulaPart| match part {
        FormulaPart::Integer(n) => format!(" {}", n.number),
        FormulaPart::Real(real) => format!(" {real:?}"),
        FormulaPart::Word(word) => format!(" {}", identity.address(Address::Word(*word))),
        FormulaPart::Bit(bit) => format!(" {}", identity.address(Address::Bit(*bit))),
        FormulaPart::Element(array) => format!(" {}[]", identity.array(*array)),
        FormulaPart::Unary(operator, _) => format!(" {operator:?}"),
        FormulaPart::Binary(operator, _) => format!(" {operator:?}"),
        FormulaPart::Call(function, count, _) => format!(" {}/{count}", function.spec().name),
    };
    expression.parts.iter().map(part).collect()
}

fn value(identity: &Identity, number: Value) -> String {
    match number {
        Value::Const(value, _) => value.to_string(),
        Value::Real(real) => real.to_string(),
        Value::Word(word) => identity.address(Address::Word(word)),
        Value::Element(element) => identity.element(&element),
    }
}
