//! Two programs in one memory: they read the same inputs, and share nothing else.
//!
//! `rungd prove --equal` asks whether they do the same. The second program has the status bits and
//! words and the field devices of the first one, and those of its inputs that its caller pairs;
//! everything else that it names lies behind the memory of the first one. No controller executes
//! the result. Places in the second program are lost.

use std::sync::Arc;

use super::array::{Array, ArrayElement, ShiftBits};
use super::formula::{Formula, FormulaPart};
use super::instruction::{Calculation, Instruction};
use super::name_book::NameBook;
use super::operand_list::OperandValue;
use super::program::{Block, ComputedCompare, ComputedContact, Contact, Program, Rung, TagMeaning};
use super::range::Range;
use super::scope::Scope;
use super::value::Value;
use crate::source::span::Span;
use rungd_engine::isa::{
    Address, Bit, BitSpace, BlockId, MemorySizes, NumberMap, Space, StageId, Structure, Word,
    WordBit, WordSpace,
};

/// Two programs in one memory.
#[derive(Clone, Debug)]
pub struct ProgramsBeside {
    /// Both programs.
    pub program: Program,
    /// The place of the second one.
    pub second: Behind,
}

/// Where a program lies behind another one.
#[derive(Clone, Debug)]
pub struct Behind {
    /// The input of the first program for an input of the second one.
    inputs: NumberMap<Address, Address>,
    sizes: MemorySizes,
    blocks: u32,
    stages: u32,
}

/// Puts a program beside another one. `inputs`: the bit or word of the first program for each one
/// of the second that is the same input; none of them lies in an array of the second program.
pub fn beside(
    first: &Program,
    second: &Program,
    inputs: NumberMap<Address, Address>,
) -> ProgramsBeside {
    let behind = Behind {
        inputs,
        sizes: first.sizes.clone(),
        blocks: first.blocks.len() as u32,
        stages: first.stages.len() as u32,
    };
    let mut program = first.clone();
    program.sizes = both_sizes(&first.sizes, &second.sizes);
    program.blocks.extend(second.blocks.iter().map(|block| behind.block(block)));
    program.order.extend(second.order.iter().map(|id| behind.block_id(*id)));
    let stages = second.stages.iter();
    program.stages.extend(stages.map(|(block, at)| (behind.block_id(*block), *at)));
    for tag in &second.tags {
        let mut tag = tag.clone();
        if let TagMeaning::Address(address) = &mut tag.meaning {
            *address = behind.address(*address);
        }
        tag.of_array = None;
        program.tags.push(tag);
    }
    let named = program.operands.len();
    program.operands.extend(second.operands.iter().cloned());
    for operand in &mut program.operands[named..] {
        operand.address = behind.address(operand.address);
    }
    let places = Scope::of(first).places().clone();
    program.names = Arc::new(NameBook::of(&program, places));
    program.scope = Default::default();
    ProgramsBeside { program, second: behind }
}

/// The sizes of both memories, one behind the other.
fn both_sizes(a: &MemorySizes, b: &MemorySizes) -> MemorySizes {
    MemorySizes {
        x: a.x + b.x,
        y: a.y + b.y,
        c: a.c + b.c,
        mc: a.mc + b.mc,
        mi: a.mi + b.mi,
        v: a.v + b.v,
        d: a.d + b.d,
        r: a.r + b.r,
        mhr: a.mhr + b.mhr,
        mir: a.mir + b.mir,
        ct: a.ct + b.ct,
        t: a.t + b.t,
        devices: a.devices.max(b.devices),
    }
}

impl Behind {
    /// The place of an address of the second program.
    pub fn address(&self, address: Address) -> Address {
        match address {
            Address::Bit(bit) => Address::Bit(self.bit(bit)),
            Address::Word(word) => Address::Word(self.word(word)),
            Address::Structure(structure) => Address::Structure(self.structure(structure)),
        }
    }

    /// The place of a range of the second program.
    pub fn range(&self, range: &Range) -> Range {
        let shift = self.shift(range.space);
        Range { first: range.first + shift, last: range.last + shift, ..*range }
    }

    fn shift(&self, space: Space) -> u32 {
        match space {
            Space::Sensaphone | Space::Bit(BitSpace::St) | Space::Word(WordSpace::Dst) => 0,
            Space::Bit(_) | Space::Word(_) | Space::Counter | Space::Timer => {
                space.count(&self.sizes)
            }
        }
    }

    fn bit(&self, bit: Bit) -> Bit {
        if let Some(Address::Bit(input)) = self.inputs.get(&Address::Bit(bit)) {
            return *input;
        }
        match bit {
            Bit::Space(space, n) => Bit::Space(space, n + self.shift(Space::Bit(space))),
            Bit::Flag(structure, flag) => Bit::Flag(self.structure(structure), flag),
            Bit::Stage(stage) => Bit::Stage(self.stage_id(stage)),
            Bit::Running(block) => Bit::Running(self.block_id(block)),
            Bit::Done(block) => Bit::Done(self.block_id(block)),
            Bit::Device(..) => bit,
            Bit::InWord(WordBit { word, number }) => {
                Bit::InWord(WordBit { word: self.word(word), number })
            }
        }
    }

    fn word(&self, word: Word) -> Word {
        if let Some(Address::Word(input)) = self.inputs.get(&Address::Word(word)) {
            return *input;
        }
        match word {
            Word::Space(space, n) => Word::Space(space, n + self.shift(Space::Word(space))),
            Word::Acc(structure) => Word::Acc(self.structure(structure)),
            Word::Pre(_) => word,
        }
    }

    fn structure(&self, structure: Structure) -> Structure {
        match structure {
            Structure::Counter(n) => Structure::Counter(n + self.shift(Space::Counter)),
            Structure::Timer(n) => Structure::Timer(n + self.shift(Space::Timer)),
            Structure::Sensaphone(_) => structure,
        }
    }

    fn block_id(&self, BlockId(id): BlockId) -> BlockId {
        BlockId(id + self.blocks)
    }

    fn stage_id(&self, StageId(id): StageId) -> StageId {
        StageId(id + self.stages)
    }

    fn array(&self, array: Array) -> Array {
        Array { first: array.first + self.shift(array.space), ..array }
    }

    fn element(&self, ArrayElement { array, index }: ArrayElement) -> ArrayElement {
        ArrayElement { array: self.array(array), index: self.word(index) }
    }

    fn value(&self, value: Value) -> Value {
        match value {
            Value::Const(..) | Value::Real(_) => value,
            Value::Word(word) => Value::Word(self.word(word)),
            Value::Element(element) => Value::Element(self.element(element)),
        }
    }

    fn formula(&self, formula: &Formula) -> Formula {
        let part = |part: &FormulaPart| match *part {
            FormulaPart::Word(word) => FormulaPart::Word(self.word(word)),
            FormulaPart::Bit(bit) => FormulaPart::Bit(self.bit(bit)),
            FormulaPart::Element(array) => FormulaPart::Element(self.array(array)),
            FormulaPart::Integer(_)
            | FormulaPart::Real(_)
            | FormulaPart::Unary(..)
            | FormulaPart::Binary(..)
            | FormulaPart::Call(..) => *part,
        };
        Formula { parts: formula.parts.iter().map(part).collect() }
    }

    fn contact(&self, contact: &Contact) -> Contact {
        let all = |contacts: &[Contact]| contacts.iter().map(|one| self.contact(one)).collect();
        let none = Span::default();
        match contact {
            Contact::Bit(bit, _) => Contact::Bit(self.bit(*bit), none),
            Contact::Element(element, _) => Contact::Element(self.element(*element), none),
            Contact::Not(inner, _) => Contact::Not(Box::new(self.contact(inner)), none),
            Contact::All(contacts, _) => Contact::All(all(contacts), none),
            Contact::Any(contacts, _) => Contact::Any(all(contacts), none),
            Contact::Edge(edge, inner, _) => {
                Contact::Edge(*edge, Box::new(self.contact(inner)), none)
            }
            Contact::Compare(a, comparison, b, _) => {
                Contact::Compare(self.value(*a), *comparison, self.value(*b), none)
            }
            Contact::Computed(computed, _) => {
                let compare = computed.compare.as_ref().map(|compare| ComputedCompare {
                    right: self.formula(&compare.right),
                    ..compare.clone()
                });
                let left = self.formula(&computed.left);
                Contact::Computed(Box::new(ComputedContact { left, compare }), none)
            }
        }
    }

    fn instruction(&self, instruction: &Instruction) -> Instruction {
        let mut moved = instruction.clone();
        moved.span = Span::default();
        for operand in &mut moved.operands.0 {
            operand.span = Span::default();
            operand.value = self.operand(operand.value);
        }
        if let Some(Calculation { index, value }) = moved.calculation.as_deref_mut() {
            *index = index.as_ref().map(|index| self.formula(index));
            *value = self.formula(value);
        }
        moved
    }

    fn operand(&self, value: OperandValue) -> OperandValue {
        match value {
            OperandValue::Bit(bit) => OperandValue::Bit(self.bit(bit)),
            OperandValue::Word(word) => OperandValue::Word(self.word(word)),
            OperandValue::Value(value) => OperandValue::Value(self.value(value)),
            OperandValue::Structure(structure) => {
                OperandValue::Structure(self.structure(structure))
            }
            OperandValue::Block(block) => OperandValue::Block(self.block_id(block)),
            OperandValue::Stage(stage) => OperandValue::Stage(self.stage_id(stage)),
            OperandValue::Element(element) => OperandValue::Element(self.element(element)),
            OperandValue::Array(array) => OperandValue::Array(self.array(array)),
            OperandValue::Run(ShiftBits { array, down }) => {
                OperandValue::Run(ShiftBits { array: self.array(array), down })
            }
        }
    }

    fn rung(&self, rung: &Rung) -> Rung {
        let mut moved = rung.clone();
        moved.extent = Span::default();
        let contacts = |contacts: &mut Vec<Contact>| {
            contacts.iter_mut().for_each(|contact| *contact = self.contact(contact));
        };
        let body = |body: &mut Vec<Instruction>| {
            body.iter_mut().for_each(|one| *one = self.instruction(one));
        };
        moved.legs.iter_mut().for_each(|leg| contacts(&mut leg.contacts));
        body(&mut moved.body);
        for branch in &mut moved.branches {
            contacts(&mut branch.contacts);
            body(&mut branch.body);
        }
        moved
    }

    fn block(&self, block: &Block) -> Block {
        let mut moved = block.clone();
        moved.id = self.block_id(block.id);
        moved.span = Span::default();
        let rungs = |rungs: &mut Vec<Rung>| {
            rungs.iter_mut().for_each(|rung| *rung = self.rung(rung));
        };
        rungs(&mut moved.rungs);
        for stage in &mut moved.stages {
            stage.id = self.stage_id(stage.id);
            stage.span = Span::default();
            rungs(&mut stage.rungs);
        }
        moved
    }
}
