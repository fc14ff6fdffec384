//! The bits and words that a ladder reads and writes, with the places of the reads.
//!
//! Called by the rules about operands that nothing writes. A read is a contact, a side of a
//! compare, or an operand that an instruction reads. For a MATH, the place is the whole
//! instruction.

use crate::resolve::formula::{Formula, FormulaPart};
use crate::resolve::program::{Contact, Tag, Value};
use crate::resolve::writes::WrittenOperand;
use crate::source::span::Span;
use rungd_engine::isa::{
    Address, Bit, NumberMap, NumberRanges, NumberSet, OperandRole, Structure, Word,
};

use super::context::{Context, ProgramInstruction, WriteEffect};

/// Every address that the ladder reads, once, with the first place that reads it: for a bit of a
/// word, the word. In order of place.
pub fn reads<'c>(context: &'c Context) -> &'c [(Address, Span)] {
    context.reads.get_or_init(|| listed(context))
}

fn listed(context: &Context) -> Vec<(Address, Span)> {
    let mut all = Vec::new();
    context.contacts().for_each(|contact| of_contact(contact, &mut all));
    context.instructions().for_each(|placed| of_instruction(placed, &mut all));
    // For a whole array in a formula, element 0 is enough.
    let is_first = |tag: &Tag| tag.of_array.is_none_or(|place| place.at == 0);
    all.retain(|(address, _)| context.tag_at(*address).is_none_or(is_first));
    all.iter_mut().for_each(|(address, _)| *address = address.without_bit());
    all.sort_by_key(|(_, span)| (span.file, span.start));
    let mut seen = NumberSet::default();
    all.retain(|(address, _)| seen.insert(*address));
    all
}

fn of_contact(contact: &Contact, reads: &mut Vec<(Address, Span)>) {
    match contact {
        Contact::Bit(bit, span) => reads.push((Address::Bit(*bit), *span)),
        Contact::Compare(left, _, right, span) => {
            reads
                .extend([left, right].into_iter().filter_map(|value| Some((word(*value)?, *span))));
        }
        Contact::Computed(computed, span) => {
            reads.extend(computed.formulas().flat_map(named).map(|address| (address, *span)));
        }
        // The parts of a contact are contacts of the list too. Elements that a word selects are
        // ignored, because something may write any element of the array.
        Contact::Not(..)
        | Contact::Edge(..)
        | Contact::All(..)
        | Contact::Any(..)
        | Contact::Element(..) => {}
    }
}

fn of_instruction(placed: &ProgramInstruction, reads: &mut Vec<(Address, Span)>) {
    // A record is copied as a whole: that nothing writes some of its fields is no mistake.
    if placed.instruction.is_record_copy() {
        return;
    }
    let operands = &placed.instruction.operands;
    let values =
        operands.of::<Value>().filter_map(|(_, value)| Some((word(value.value)?, value.span)));
    reads.extend(values);
    let Some(calculation) = &placed.instruction.calculation else { return };
    let span = placed.instruction.span;
    reads.extend(named(&calculation.value).map(|address| (address, span)));
}

/// The bits and words that an expression names.
fn named(formula: &Formula) -> impl Iterator<Item = Address> {
    formula.parts.iter().filter_map(|part| match part {
        FormulaPart::Word(word) => Some(Address::Word(*word)),
        FormulaPart::Bit(bit) => Some(Address::Bit(*bit)),
        FormulaPart::Integer(_)
        | FormulaPart::Real(_)
        | FormulaPart::Element(_)
        | FormulaPart::Unary(..)
        | FormulaPart::Binary(..)
        | FormulaPart::Call(..) => None,
    })
}

fn word(value: Value) -> Option<Address> {
    match value {
        Value::Word(word) => Some(Address::Word(word)),
        Value::Const(..) | Value::Real(_) | Value::Element(_) => None,
    }
}

/// Every address that an instruction names and writes. Structures that are owned are not listed.
pub fn writes<'c>(context: &'c Context) -> &'c NumberMap<Address, WriteEffect> {
    context.writes.get_or_init(|| effects(context))
}

/// The words that an instruction writes as a whole, or that belong to an owned structure.
pub fn whole_writes(context: &Context) -> NumberSet<Address> {
    let mut words = NumberSet::default();
    for written in context.instructions().flat_map(|placed| placed.instruction.writes()) {
        match written.value {
            WrittenOperand::Word(word) => {
                words.insert(Address::Word(word));
            }
            WrittenOperand::Array(array) => words.extend(array.of_words().addresses()),
            WrittenOperand::Bit(_) => {}
        }
    }
    words.extend(context.owners().map(|(structure, _)| Address::Word(Word::Acc(structure))));
    words
}

fn effects(context: &Context) -> NumberMap<Address, WriteEffect> {
    let mut writes = NumberMap::default();
    let mut arrays = NumberRanges::default();
    for placed in context.instructions() {
        let only_off = placed.instruction.operand_with::<Bit>(OperandRole::TurnsOff).is_some();
        let effect = if only_off { WriteEffect::Off } else { WriteEffect::Any };
        for written in placed.instruction.writes() {
            match written.value {
                WrittenOperand::Bit(bit) => {
                    note(&mut writes, Address::Bit(bit), effect);
                    if let Some(bit) = bit.of_word() {
                        note(&mut writes, Address::Word(bit.word), WriteEffect::Any);
                    }
                }
                WrittenOperand::Word(word) => note(&mut writes, Address::Word(word), effect),
                WrittenOperand::Array(array) => {
                    for (first, last) in arrays.add(array.numbers(), 0) {
                        let addresses = (first..=last).map(|n| array.space.address(n));
                        addresses.for_each(|address| note(&mut writes, address, WriteEffect::Any));
                    }
                }
            }
        }
    }
    writes
}

fn note(writes: &mut NumberMap<Address, WriteEffect>, address: Address, effect: WriteEffect) {
    let known = writes.entry(address).or_insert(effect);
    *known = effect.max(*known);
}

/// The structure of a member.
pub fn structure_of(address: Address) -> Option<Structure> {
    match address {
        Address::Bit(Bit::Flag(structure, _)) | Address::Word(Word::Acc(structure)) => {
            Some(structure)
        }
        Address::Word(Word::Pre(n)) => Some(Structure::Sensaphone(n)),
        Address::Bit(_) | Address::Word(_) | Address::Structure(_) => None,
    }
}
