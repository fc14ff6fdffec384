//! The addresses and arrays that contacts and instructions read.
//!
//! `observe` uses them to list the readers of a cell. The lists do not contain the state that an
//! instruction keeps for itself (a counter's accumulated value), nor the legs of its rung.

use super::array::{Array, Element};
use super::formula::{Formula, Part};
use super::instruction::{Filling, WordPlace};
use super::program::{Action, Contact, Value};
use crate::isa::{Address, Bit, Word};

/// An operand that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReadOperand {
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
            Contact::Not(..) | Contact::All(..) | Contact::Any(..) | Contact::Edge(..) => {}
        }
        all.0
    }
}

impl Action {
    /// The operands that an instruction reads.
    pub fn reads(&self) -> Vec<ReadOperand> {
        let mut all = ReadOperands::default();
        match self {
            Action::Coil { .. }
            | Action::Reset { .. }
            | Action::Shift { .. }
            | Action::Run { .. }
            | Action::Restart { .. }
            | Action::Halt { .. }
            | Action::Exit
            | Action::Jump { .. }
            | Action::StageOn { .. }
            | Action::StageOff { .. }
            | Action::Stop => {}
            Action::SetElement { on: _, bit } => all.word(bit.value.index),
            Action::Counter { preset, .. }
            | Action::DelayTimer { preset, .. }
            | Action::Timer { preset, .. } => all.value(preset.value),
            Action::UpDownCounter { up_preset, dn_preset, .. } => {
                [up_preset, dn_preset].into_iter().flatten().for_each(|of| all.value(of.value));
            }
            Action::Sensaphone { preset, .. } => {
                preset.iter().for_each(|preset| all.value(preset.value));
            }
            Action::Entask { block: _, every } => {
                every.iter().for_each(|every| all.value(every.value));
            }
            Action::Store { source, to } => {
                source.values().for_each(|value| all.value(value.value));
                if let WordPlace::Element(element) = to.value {
                    all.word(element.index);
                }
            }
            Action::Math { target: _, index, formula } => {
                index.iter().for_each(|index| all.formula(index));
                all.formula(formula);
            }
            Action::Copy { from, to: _ } => all.0.push(ReadOperand::Array(from.value)),
            Action::Fill { value, to: _ } => match value.value {
                Filling::Value(value) => all.value(value),
                Filling::Bit(bit) => all.bit(bit),
                Filling::Element(element) => all.element(element),
            },
            Action::Converge { stages, to: _ } => {
                stages.iter().for_each(|stage| all.bit(Bit::Stage(stage.value)));
            }
        }
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

    fn element(&mut self, Element { array, index }: Element) {
        self.word(index);
        self.0.push(ReadOperand::Array(array));
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
                Part::Word(word) => self.word(*word),
                Part::Bit(bit) => self.bit(*bit),
                Part::Element(array) => self.0.push(ReadOperand::Array(*array)),
                Part::Integer(_)
                | Part::Real(_)
                | Part::Unary(..)
                | Part::Binary(..)
                | Part::Call(..) => {}
            }
        }
    }
}
