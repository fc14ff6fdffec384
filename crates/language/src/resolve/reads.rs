//! The addresses and arrays that contacts and instructions read.
//!
//! `observe` uses them to list the readers of a cell. The lists do not contain the state that an
//! instruction keeps for itself (a counter's accumulated value), nor the legs of its rung.

use super::array::{Array, ArrayElement};
use super::formula::{Formula, FormulaPart};
use super::instruction::{Instruction, OperandValue};
use super::program::{Contact, Value};
use rungd_engine::isa::{Address, Bit, OperandRole, Word};

/// An operand that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadOperand {
    /// A bit or word.
    Address(Address),
    /// One or all elements of an array.
    Array(Array),
}

impl Contact {
    /// The operands that a contact itself reads, without those of its parts.
    pub fn reads(&self) -> Vec<ReadOperand> {
        let mut all = ReadOperands::default();
        match self {
            Contact::Bit(bit, _) => all.bit(*bit),
            Contact::Element(element, _) => all.element(*element),
            Contact::Compare(left, _, right, _) => {
                all.value(*left);
                all.value(*right);
            }
            Contact::Computed(computed, _) => {
                computed.formulas().for_each(|formula| all.formula(formula));
            }
            Contact::Not(..) | Contact::All(..) | Contact::Any(..) | Contact::Edge(..) => {}
        }
        all.0
    }
}

impl Contact {
    /// The operands that a contact reads, with those of its parts.
    pub fn reads_of_all(&self) -> Vec<ReadOperand> {
        let mut all = self.reads();
        match self {
            Contact::Not(inner, _) | Contact::Edge(_, inner, _) => {
                all.extend(inner.reads_of_all());
            }
            Contact::All(parts, _) | Contact::Any(parts, _) => {
                all.extend(parts.iter().flat_map(Contact::reads_of_all));
            }
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => {}
        }
        all
    }
}

impl Instruction {
    /// The operands that an instruction reads: those that it only reads, the Stages that it waits
    /// for, the words that select an element to write, and those of its expressions.
    pub fn reads(&self) -> Vec<ReadOperand> {
        let mut all = ReadOperands::default();
        for operand in &self.operands.0 {
            if matches!(operand.row.role, OperandRole::Reads | OperandRole::Awaits) {
                all.operand(operand.value);
            } else if let OperandValue::Element(element) = operand.value {
                all.word(element.index);
            }
        }
        self.formulas().for_each(|formula| all.formula(formula));
        all.0
    }
}

/// Collects the list of operands.
#[derive(Default)]
struct ReadOperands(Vec<ReadOperand>);

impl ReadOperands {
    fn bit(&mut self, bit: Bit) {
        self.0.push(ReadOperand::Address(Address::Bit(bit)));
    }

    fn word(&mut self, word: Word) {
        self.0.push(ReadOperand::Address(Address::Word(word)));
    }

    fn element(&mut self, ArrayElement { array, index }: ArrayElement) {
        self.word(index);
        self.0.push(ReadOperand::Array(array));
    }

    fn operand(&mut self, operand: OperandValue) {
        match operand {
            OperandValue::Bit(bit) => self.bit(bit),
            OperandValue::Word(word) => self.word(word),
            OperandValue::Value(value) => self.value(value),
            OperandValue::Stage(stage) => self.bit(Bit::Stage(stage)),
            OperandValue::Element(element) => self.element(element),
            OperandValue::Array(array) => self.0.push(ReadOperand::Array(array)),
            OperandValue::Structure(_) | OperandValue::Block(_) | OperandValue::Run(_) => {}
        }
    }

    fn value(&mut self, value: Value) {
        match value {
            Value::Const(..) | Value::Real(_) => {}
            Value::Word(word) => self.word(word),
            Value::Element(element) => self.element(element),
        }
    }

    fn formula(&mut self, formula: &Formula) {
        for part in &formula.parts {
            match part {
                FormulaPart::Word(word) => self.word(*word),
                FormulaPart::Bit(bit) => self.bit(*bit),
                FormulaPart::Element(array) => self.0.push(ReadOperand::Array(*array)),
                FormulaPart::Integer(_)
                | FormulaPart::Real(_)
                | FormulaPart::Unary(..)
                | FormulaPart::Binary(..)
                | FormulaPart::Call(..) => {}
            }
        }
    }
}
