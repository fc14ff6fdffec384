//! The resolved instruction: its row in the instruction table and its operands, each with its row.
//!
//! The resolver checks each operand against the table. What an instruction reads, writes, owns,
//! enters and starts follows from the roles of its operands: `reads` and `writes` ask them, the
//! checks and `observe` too. `lower` matches every mnemonic; nothing else does.

use super::formula::Formula;
pub use super::operand_list::{
    CopiedPlace, FieldCopy, Filling, FormulaTarget, OperandList, OperandType, OperandValue,
    ResolvedOperand, Value, WordPlace,
};
use crate::source::span::{Located, Span};
pub use rungd_engine::isa::{Mnemonic, OperandRole};

/// One instruction with its operands.
#[derive(Clone, Debug)]
pub struct Instruction {
    /// Its row in the instruction table.
    pub mnemonic: Mnemonic,
    /// The place of its whole text.
    pub span: Span,
    /// Its operands in the order of the table, without omitted ones. Several Stages have the same
    /// row.
    pub operands: OperandList,
    /// The expressions of a MATH.
    pub calculation: Option<Box<Calculation>>,
}

/// The expressions of a MATH.
#[derive(Clone, Debug)]
pub struct Calculation {
    /// The index of the target, if that is an array.
    pub index: Option<Formula>,
    /// The value.
    pub value: Formula,
}

impl Instruction {
    /// The operands of one type with a role.
    pub fn operands_with<T: OperandType>(
        &self,
        role: OperandRole,
    ) -> impl Iterator<Item = Located<T>> {
        let operands = self.operands.0.iter().filter(move |operand| operand.row.role == role);
        operands.filter_map(ResolvedOperand::located)
    }

    /// The first operand of one type with a role.
    pub fn operand_with<T: OperandType>(&self, role: OperandRole) -> Option<Located<T>> {
        self.operands_with(role).next()
    }

    /// The first operand of one type.
    pub fn first_operand<T: OperandType>(&self) -> Option<Located<T>> {
        self.operands.0.iter().find_map(ResolvedOperand::located)
    }

    /// The role of the operand that it acts on: the first one that it does not only read. `None`
    /// without operands.
    pub fn acting_role(&self) -> Option<OperandRole> {
        let mut roles = self.operands.0.iter().map(|operand| operand.row.role);
        roles.find(|role| *role != OperandRole::Reads)
    }

    /// Whether it is a COPY of a record.
    pub fn is_record_copy(&self) -> bool {
        self.mnemonic == Mnemonic::Copy && self.copied_fields().next().is_some()
    }

    /// The fields that a COPY of a record copies, in the order of the record.
    pub fn copied_fields(&self) -> impl Iterator<Item = FieldCopy> {
        self.operands.0.chunks_exact(2).map_while(|pair| {
            let (from, to) = (Filling::of(pair[0].value)?, CopiedPlace::of(pair[1].value)?);
            Some(FieldCopy { from, to })
        })
    }

    /// The expressions of a MATH: the index of its target first.
    pub fn formulas(&self) -> impl Iterator<Item = &Formula> {
        let each = self.calculation.iter();
        each.flat_map(|calculation| calculation.index.iter().chain([&calculation.value]))
    }

    /// Whether it is an ENTASK that runs its Task again and again.
    pub fn is_recurrent(&self) -> bool {
        self.acting_role() == Some(OperandRole::Enables) && !self.runs_once()
    }

    /// Whether it is an ENTASK that runs its Task once.
    pub fn runs_once(&self) -> bool {
        self.acting_role() == Some(OperandRole::Enables) && self.first_operand::<Value>().is_none()
    }
}
