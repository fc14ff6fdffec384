//! What an instruction writes, and the structure, block and Stages that it names.
//!
//! The roles of its operands say it. The changes of the members of its own structure are not
//! listed. Called by the checks, by `lower`, and for retentive memory. `reads` is the counterpart.

use super::array::Array;
use super::instruction::{Instruction, OperandValue, ResolvedOperand, Value};
use crate::source::span::Located;
use rungd_engine::isa::{Address, Bit, BlockId, OperandRole, StageId, Structure, Word};

/// The operand that an instruction writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WrittenOperand {
    /// A bit.
    Bit(Bit),
    /// A word.
    Word(Word),
    /// One element of an array, or all elements.
    Array(Array),
}

impl WrittenOperand {
    /// Its bits; none if it is of words.
    fn bits(self) -> impl Iterator<Item = Bit> {
        let (bit, array) = match self {
            WrittenOperand::Bit(bit) => (Some(bit), None),
            WrittenOperand::Word(_) => (None, None),
            WrittenOperand::Array(array) => (None, Some(array)),
        };
        let elements = array.into_iter().flat_map(|array| array.addresses());
        bit.into_iter().chain(elements.filter_map(|address| match address {
            Address::Bit(bit) => Some(bit),
            Address::Word(_) | Address::Structure(_) => None,
        }))
    }
}

impl ResolvedOperand {
    /// What its instruction writes there; `None` if it only reads it.
    pub fn written(&self) -> Option<WrittenOperand> {
        if !self.row.role.writes() {
            return None;
        }
        match self.value {
            OperandValue::Bit(bit) => Some(WrittenOperand::Bit(bit)),
            OperandValue::Word(word) => Some(WrittenOperand::Word(word)),
            OperandValue::Array(array) => Some(WrittenOperand::Array(array)),
            OperandValue::Element(element) => Some(WrittenOperand::Array(element.array)),
            OperandValue::Run(run) => Some(WrittenOperand::Array(run.array)),
            OperandValue::Value(_)
            | OperandValue::Structure(_)
            | OperandValue::Block(_)
            | OperandValue::Stage(_) => None,
        }
    }
}

impl Instruction {
    /// The operands that it writes: one, but for a COPY of a record, which has one for each field.
    pub fn writes(&self) -> impl Iterator<Item = Located<WrittenOperand>> {
        self.operands.0.iter().filter_map(|operand| {
            let value = operand.written()?;
            Some(Located { value, span: operand.span })
        })
    }

    /// The bit that it writes: a coil's, the output of a delay timer, or the target of a MATH.
    pub fn written_bit(&self) -> Option<Located<Bit>> {
        let Located { value, span } = self.writes().next()?;
        match value {
            WrittenOperand::Bit(value) => Some(Located { value, span }),
            WrittenOperand::Word(_) | WrittenOperand::Array(_) => None,
        }
    }

    /// The array in which it writes one element or all elements.
    pub fn written_array(&self) -> Option<Array> {
        match self.writes().next()?.value {
            WrittenOperand::Array(array) => Some(array),
            WrittenOperand::Bit(_) | WrittenOperand::Word(_) => None,
        }
    }

    /// All bits that it can write, those of arrays too.
    pub fn written_bits(&self) -> impl Iterator<Item = Bit> {
        self.bits_written_as(|_| true)
    }

    /// The bits that it can write, those of arrays too, in some roles of its operands.
    pub fn bits_written_as(&self, is: impl Fn(OperandRole) -> bool) -> impl Iterator<Item = Bit> {
        let operands = self.operands.0.iter().filter(move |operand| is(operand.row.role));
        operands.filter_map(ResolvedOperand::written).flat_map(WrittenOperand::bits)
    }

    /// The bit that it writes ON and OFF at every execution, if it is a driver.
    pub fn driven(&self) -> Option<Located<Bit>> {
        self.operand_with(OperandRole::Drives)
    }

    /// The operands that have a part in what is written at a place: of a COPY of a record, those of
    /// the field; of any other instruction, all.
    pub fn operands_for(&self, has: impl Fn(WrittenOperand) -> bool) -> &[ResolvedOperand] {
        let all = &self.operands.0;
        if !self.is_record_copy() {
            return all;
        }
        let writes_it = |pair: &&[ResolvedOperand]| pair[1].written().is_some_and(&has);
        all.chunks_exact(2).find(writes_it).unwrap_or(all)
    }

    /// The structure that it names.
    pub fn structure(&self) -> Option<Structure> {
        self.first_operand().map(|structure| structure.value)
    }

    /// The structure that it owns: a structure has one owner in a program.
    pub fn owned(&self) -> Option<Structure> {
        self.operand_with(OperandRole::Owns).map(|structure| structure.value)
    }

    /// The Sensaphone counter that it owns.
    pub fn owned_sensaphone(&self) -> Option<Structure> {
        self.owned().filter(|structure| matches!(structure, Structure::Sensaphone(_)))
    }

    /// The preset of the structure that it owns, if there is one preset.
    pub fn preset(&self) -> Option<Located<Value>> {
        self.operands.get("preset")
    }

    /// The block that it starts, stops or enables.
    pub fn target_block(&self) -> Option<Located<BlockId>> {
        self.first_operand()
    }

    /// The Stages that it turns ON.
    pub fn stages_entered(&self) -> impl Iterator<Item = StageId> {
        let entered =
            self.operands_with(OperandRole::Enters).chain(self.operands_with(OperandRole::Starts));
        entered.map(|stage| stage.value)
    }

    /// Whether an operand or its target is an element that is selected at run time, or the
    /// instruction writes more than one operand: several operations execute it.
    pub fn has_elements(&self) -> bool {
        let is_element = |operand| {
            matches!(operand, OperandValue::Element(_) | OperandValue::Value(Value::Element(_)))
        };
        self.formulas().count() > 1
            || self.is_record_copy()
            || self.operands.each().any(|(_, operand)| is_element(operand))
    }
}
