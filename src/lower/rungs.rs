//! A rung as one text, in addresses: two rungs of the same text do the same thing.
//!
//! Called while a program is lowered; a reload tells by it which rungs nobody edited. Tags,
//! comments and the way a constant is written are not in it.

use super::identity::Identity;
use crate::resolve::program::{ArgValue, Contact, Instruction, Rung, Value};

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

fn contacts(identity: &Identity, of: &[Contact], between: &str) -> String {
    let said: Vec<_> = of.iter().map(|one| contact(identity, one)).collect();
    format!("({})", said.join(between))
}

fn contact(identity: &Identity, of: &Contact) -> String {
    match of {
        Contact::Bit(bit, _) => identity.bit(*bit),
        Contact::Not(inner, _) => format!("!{}", contact(identity, inner)),
        Contact::All(all, _) => contacts(identity, all, " "),
        Contact::Any(any, _) => contacts(identity, any, "|"),
        Contact::Edge(edge, bit, _) => identity.edge(*edge, *bit),
        Contact::Compare(a, how, b, _) => format!("{} {how:?} {}", value(*a), value(*b)),
    }
}

fn body(identity: &Identity, of: &[Instruction]) -> String {
    let one = |instruction: &Instruction| {
        let args = instruction.args.iter().map(|arg| {
            let said = match arg.value {
                ArgValue::Bit(bit) => identity.bit(bit),
                ArgValue::Word(word) => word.to_string(),
                ArgValue::Value(of) => value(of),
                ArgValue::Structure(structure) => structure.to_string(),
                ArgValue::Block(block) => identity.block(block).name.clone(),
                ArgValue::Stage(stage) => identity.stage(stage),
            };
            format!(" {}={said}", arg.name)
        });
        format!("{}{}", instruction.mnemonic.spec().name, args.collect::<String>())
    };
    of.iter().map(one).collect::<Vec<_>>().join(", ")
}

fn value(of: Value) -> String {
    match of {
        Value::Const(value, _) => value.to_string(),
        Value::Word(word) => word.to_string(),
    }
}
