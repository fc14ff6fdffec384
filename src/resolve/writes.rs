//! What an instruction writes, and the structure and block that it names.
//!
//! Each function matches every action, so that a new one cannot be taken for a writer, or for
//! none, without a decision. The changes of the members of its own structure are not listed.
//! Called by the checks, by `lower`, and for retentive memory. `reads` is the counterpart.

use super::array::Array;
use super::instruction::{Action, OperandValue, Target, Value, WordPlace};
use crate::isa::{Address, Bit, BlockId, Structure, Word};
use crate::source::span::Located;

/// The operand that an instruction writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WrittenOperand {
    /// A bit.
    Bit(Bit),
    /// A word.
    Word(Word),
    /// One element of an array, or all elements.
    Array(Array),
}

impl Action {
    /// The operand that it writes.
    pub fn written(&self) -> Option<Located<WrittenOperand>> {
        let (value, span) = match self {
            Action::Coil { coil: _, bit } | Action::DelayTimer { output: bit, .. } => {
                (WrittenOperand::Bit(bit.value), bit.span)
            }
            Action::SetElement { on: _, bit } => (WrittenOperand::Array(bit.value.array), bit.span),
            Action::Store { source: _, to } => match to.value {
                WordPlace::Word(word) => (WrittenOperand::Word(word), to.span),
                WordPlace::Element(element) => (WrittenOperand::Array(element.array), to.span),
            },
            Action::Math { target, index: _, formula: _ } => match target.value {
                Target::Word(word) => (WrittenOperand::Word(word), target.span),
                Target::Bit(bit) => (WrittenOperand::Bit(bit), target.span),
                Target::Array(array) => (WrittenOperand::Array(array), target.span),
            },
            Action::Copy { from: _, to } | Action::Fill { value: _, to } => {
                (WrittenOperand::Array(to.value), to.span)
            }
            Action::Shift { bits } => (WrittenOperand::Array(bits.value.array), bits.span),
            Action::Counter { .. }
            | Action::UpDownCounter { .. }
            | Action::Timer { .. }
            | Action::Sensaphone { .. }
            | Action::Reset { .. }
            | Action::Run { .. }
            | Action::Restart { .. }
            | Action::Halt { .. }
            | Action::Exit
            | Action::Entask { .. }
            | Action::Jump { .. }
            | Action::StageOn { .. }
            | Action::StageOff { .. }
            | Action::Converge { .. }
            | Action::Stop => return None,
        };
        Some(Located { value, span })
    }

    /// The bit that it writes: a coil's, the output of a delay timer, or the target of a MATH.
    pub fn written_bit(&self) -> Option<Located<Bit>> {
        let Located { value, span } = self.written()?;
        match value {
            WrittenOperand::Bit(value) => Some(Located { value, span }),
            WrittenOperand::Word(_) | WrittenOperand::Array(_) => None,
        }
    }

    /// The array in which it writes one element or all elements.
    pub fn written_array(&self) -> Option<Array> {
        match self.written()?.value {
            WrittenOperand::Array(array) => Some(array),
            WrittenOperand::Bit(_) | WrittenOperand::Word(_) => None,
        }
    }

    /// The structure that it names.
    pub fn structure(&self) -> Option<Structure> {
        match self {
            Action::Counter { ct: structure, .. }
            | Action::UpDownCounter { ct: structure, .. }
            | Action::DelayTimer { t: structure, .. }
            | Action::Timer { t: structure, .. }
            | Action::Sensaphone { n: structure, .. }
            | Action::Reset { structure } => Some(structure.value),
            Action::Coil { .. }
            | Action::SetElement { .. }
            | Action::Store { .. }
            | Action::Math { .. }
            | Action::Copy { .. }
            | Action::Fill { .. }
            | Action::Shift { .. }
            | Action::Run { .. }
            | Action::Restart { .. }
            | Action::Halt { .. }
            | Action::Exit
            | Action::Entask { .. }
            | Action::Jump { .. }
            | Action::StageOn { .. }
            | Action::StageOff { .. }
            | Action::Converge { .. }
            | Action::Stop => None,
        }
    }

    /// The block that it starts, stops or enables.
    pub fn target_block(&self) -> Option<Located<BlockId>> {
        match self {
            Action::Run { block }
            | Action::Restart { block }
            | Action::Halt { block }
            | Action::Entask { block, every: _ } => Some(*block),
            Action::Coil { .. }
            | Action::SetElement { .. }
            | Action::Counter { .. }
            | Action::UpDownCounter { .. }
            | Action::DelayTimer { .. }
            | Action::Timer { .. }
            | Action::Sensaphone { .. }
            | Action::Reset { .. }
            | Action::Store { .. }
            | Action::Math { .. }
            | Action::Copy { .. }
            | Action::Fill { .. }
            | Action::Shift { .. }
            | Action::Exit
            | Action::Jump { .. }
            | Action::StageOn { .. }
            | Action::StageOff { .. }
            | Action::Converge { .. }
            | Action::Stop => None,
        }
    }

    /// The bits of the array in which it writes one bit or all bits.
    pub fn written_bits(&self) -> impl Iterator<Item = Bit> + use<> {
        let array = self.written_array().into_iter();
        array.flat_map(|array| array.addresses()).filter_map(|address| match address {
            Address::Bit(bit) => Some(bit),
            Address::Word(_) | Address::Structure(_) => None,
        })
    }

    /// Whether an operand or its target is an element that is selected at run time.
    pub fn has_elements(&self) -> bool {
        let is_element = |operand| match operand {
            OperandValue::Value(Value::Element(_)) | OperandValue::Element(_) => true,
            OperandValue::Value(Value::Const(..) | Value::Real(_) | Value::Word(_))
            | OperandValue::Bit(_)
            | OperandValue::Word(_)
            | OperandValue::Structure(_)
            | OperandValue::Block(_)
            | OperandValue::Stage(_)
            | OperandValue::Array(_)
            | OperandValue::Run(_) => false,
        };
        let has_index = matches!(self, Action::Math { index: Some(_), .. });
        has_index || self.operands().each().any(|(_, operand)| is_element(operand))
    }
}
