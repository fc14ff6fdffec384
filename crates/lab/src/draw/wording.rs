//! Contacts and instructions as text with the names of the program. In a use of a template, the
//! names are those of the use, as in the helps of `check`.
//!
//! The labels of the pictures are made here.

use rungd_engine::isa::Address;
use rungd_language::resolve::array::ShiftBits;
use rungd_language::resolve::formula::{Binary, Formula, FormulaPart};
use rungd_language::resolve::operand_list::OperandValue;
use rungd_language::resolve::program::{Contact, Instruction, Program};

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

    /// The text of a contact.
    pub fn contact(&self, contact: &Contact) -> String {
        self.program.names.contact(contact)
    }

    /// An instruction: its mnemonic, and its operands as they are written.
    pub fn instruction(&self, instruction: &Instruction) -> (&'static str, Vec<String>) {
        let spec = instruction.mnemonic.spec();
        let texts = instruction.operands.0.iter().map(|operand| {
            let text = self.operand(operand.value);
            match (operand.row.key, &instruction.calculation) {
                (Some(key), _) => format!("{key}={text}"),
                (None, Some(template_use)) => {
                    let index = template_use
                        .index
                        .as_ref()
                        .map(|index| format!("[{}]", self.formula(index)));
                    format!(
                        "{text}{} = {}",
                        index.unwrap_or_default(),
                        self.formula(&template_use.value)
                    )
                }
                (None, None) => text,
            }
        });
        (spec.name, texts.collect())
    }

    fn operand(&self, operand: OperandValue) -> String {
        match operand {
            OperandValue::Bit(bit) => self.program.names.name(Address::Bit(bit)),
            OperandValue::Word(word) => self.program.names.name(Address::Word(word)),
            OperandValue::Value(value) => self.program.names.value(value),
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

    /// An expression, with the parentheses that it needs.
    fn formula(&self, formula: &Formula) -> String {
        let mut stack: Vec<(String, u8)> = Vec::new();
        for part in &formula.parts {
            let item = self.part(part, &mut stack);
            stack.push(item);
        }
        stack.pop().map(|(text, _)| text).unwrap_or_default()
    }

    /// A part of an expression with its operands, which are taken from the stack. Returns its text,
    /// and how tightly it binds.
    fn part(&self, part: &FormulaPart, stack: &mut Vec<(String, u8)>) -> (String, u8) {
        let mut take = || stack.pop().unwrap_or_default();
        match part {
            FormulaPart::Integer(value) => (value.to_string(), ATOM),
            FormulaPart::Real(value) => (value.to_string(), ATOM),
            FormulaPart::Word(word) => (self.program.names.name(Address::Word(*word)), ATOM),
            FormulaPart::Bit(bit) => (self.program.names.name(Address::Bit(*bit)), ATOM),
            FormulaPart::Element(array) => {
                let (index, _) = take();
                (format!("{}[{index}]", self.program.names.array(*array)), ATOM)
            }
            FormulaPart::Unary(unary, _) => {
                let (operand, binds) = take();
                let operand = if binds < UNARY { format!("({operand})") } else { operand };
                (format!("{}{operand}", unary.sign()), UNARY)
            }
            FormulaPart::Binary(binary, _) => {
                let (right, left) = (take(), take());
                (binary_text(*binary, left, right), binary.precedence())
            }
            FormulaPart::Call(function, count, _) => {
                let mut arguments: Vec<String> = (0..*count).map(|_| take().0).collect();
                arguments.reverse();
                (format!("{}({})", function.spec().name, arguments.join(", ")), ATOM)
            }
        }
    }
}

/// Binds tighter than every operator.
const ATOM: u8 = u8::MAX;
/// How tightly `-`, `~` and `!` bind.
const UNARY: u8 = 11;

/// Two operands with their operator. A right operand that binds as tightly as the operator has
/// parentheses too, so that a reader need not know the order.
fn binary_text(binary: Binary, left: (String, u8), right: (String, u8)) -> String {
    let grouped = |(text, binds): (String, u8), is_left: bool| {
        let is_chain = is_left && binds == binary.precedence() && binary != Binary::Power;
        if binds > binary.precedence() || is_chain { text } else { format!("({text})") }
    };
    format!("{} {} {}", grouped(left, true), binary.sign(), grouped(right, false))
}
