//! The arrays of an instruction, for every kind of action.

use super::array::Array;
use super::instruction::{Action, OperandValue, Target, Value, WordPlace};
use crate::isa::{Address, Bit};
use crate::source::span::Located;

impl Action {
    /// The array in which it writes one element or all elements.
    pub fn written_array(&self) -> Option<Array> {
        if let Action::SetElement { bit, .. } = self {
            return Some(bit.value.array);
        }
        if let Action::Copy { to, .. } | Action::Fill { to, .. } = self {
            return Some(to.value);
        }
        if let Action::Shift { bits } = self {
            return Some(bits.value.array);
        }
        if let Action::Math { target: Located { value: Target::Array(array), .. }, .. } = self {
            return Some(*array);
        }
        if let Action::Store { to: Located { value: WordPlace::Element(element), .. }, .. } = self {
            return Some(element.array);
        }
        None
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
