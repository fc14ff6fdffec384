//! Contacts and instructions as text with the names of the program. In a use of a template, the
//! names are those of the use, as in the helps of `check`.
//!
//! The labels of the pictures are made here.

use rungd_engine::isa::Address;
use rungd_language::resolve::array::ShiftBits;
use rungd_language::resolve::operand_list::OperandValue;
use rungd_language::resolve::program::{Contact, Instruction, Program, TagMeaning};
use rungd_language::source::span::Span;

/// The names of a program.
pub(super) struct Wording<'p> {
    program: &'p Program,
}

/// A bit or word as a label.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OperandLabel {
    /// The name of its tag, or else its address, nickname, Stage or block.
    pub name: String,
    /// Its address, if it has a tag.
    pub address: Option<String>,
    /// The tag's `doc`.
    pub doc: Option<String>,
}

/// An instruction of an error-free program as it is written: `ADD level 1 to=level`.
pub fn instruction_text(program: &Program, instruction: &Instruction) -> String {
    let (name, operands) = Wording::of(program).instruction(instruction);
    [&[name.to_owned()], operands.as_slice()].concat().join(" ")
}

impl<'p> Wording<'p> {
    /// The names of an error-free program.
    pub fn of(program: &'p Program) -> Wording<'p> {
        Wording { program }
    }

    /// A bit or word as a label.
    pub fn label(&self, address: Address) -> OperandLabel {
        let names = &self.program.names;
        let tag = names.tag_index(address).map(|index| &self.program.tags[index]);
        OperandLabel {
            name: names.name(address),
            address: names.second_name(address).map(|_| address.to_string()),
            doc: tag.and_then(|tag| tag.doc.clone()),
        }
    }

    /// The constants that are named within a place, with their values: `settle = 2s`.
    pub fn constants(&self, place: Span) -> Option<String> {
        let mut texts: Vec<String> = Vec::new();
        for named in self.program.names.constants.within(place) {
            let tag = &self.program.tags[named.tag];
            let value = match tag.meaning {
                TagMeaning::Constant(number, form) => form.text(number),
                TagMeaning::Real(real) => real.to_string(),
                TagMeaning::Address(_) | TagMeaning::Array(_) => continue,
            };
            let text = format!("{} = {value}", tag.name);
            if !texts.contains(&text) {
                texts.push(text);
            }
        }
        (!texts.is_empty()).then(|| texts.join(", "))
    }

    /// The text of a contact.
    pub fn contact(&self, contact: &Contact) -> String {
        self.program.names.contact(contact)
    }

    /// An instruction: its mnemonic, and its operands as they are written.
    pub fn instruction(&self, instruction: &Instruction) -> (&'static str, Vec<String>) {
        let spec = instruction.mnemonic.spec();
        if instruction.is_record_copy() {
            return (spec.name, self.copied_records(instruction));
        }
        let texts = instruction.operands.0.iter().map(|operand| {
            let text = self.operand(operand.value, operand.span);
            match (operand.row.key, &instruction.calculation) {
                (Some(key), _) => format!("{key}={text}"),
                (None, Some(calculation)) => {
                    let formulas = calculation.index.iter().chain([&calculation.value]);
                    let formulas = formulas.collect::<Vec<_>>();
                    match &self.program.names.formulas(&formulas, instruction.span)[..] {
                        [index, value] => format!("{text}[{index}] = {value}"),
                        values => format!("{text} = {}", values.join(", ")),
                    }
                }
                (None, None) => text,
            }
        });
        (spec.name, texts.collect())
    }

    /// The two records of a COPY: the name of a field, without the field.
    fn copied_records(&self, instruction: &Instruction) -> Vec<String> {
        let both = instruction.operands.0.iter().take(2).map(|operand| {
            let field = self.operand(operand.value, operand.span);
            let record = field.rsplit_once('.').map_or(field.as_str(), |(record, _)| record);
            operand.row.key.map_or(record.to_owned(), |key| format!("{key}={record}"))
        });
        both.collect()
    }

    fn operand(&self, operand: OperandValue, place: Span) -> String {
        match operand {
            OperandValue::Bit(bit) => self.program.names.name(Address::Bit(bit)),
            OperandValue::Word(word) => self.program.names.name(Address::Word(word)),
            OperandValue::Value(value) => self.program.names.value_at(value, place),
            OperandValue::Structure(of) => self.program.names.name(Address::Structure(of)),
            OperandValue::Block(id) => self.program.block(id).name.clone(),
            OperandValue::Stage(id) => self.program.stage(id).name.clone(),
            OperandValue::Element(element) => self.program.names.selected(&element),
            OperandValue::Array(array) => self.program.names.array(array),
            OperandValue::Run(bits) => self.shifted(bits),
        }
    }

    fn shifted(&self, bits: ShiftBits) -> String {
        match bits.down {
            true => bits.to_string(),
            false => self.program.names.array(bits.array),
        }
    }
}
