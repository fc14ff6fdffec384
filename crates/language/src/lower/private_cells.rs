//! MATHs without an expression: one stores a private cell in an element of an array, another one
//! checks indexes.
//!
//! Called by `packing` and `record_copy`.

use super::assembler::Assembler;
use super::formula::{OperandPlace, accumulator};
use crate::resolve::array::ArrayElement;
use crate::resolve::formula::NumberType;
pub use rungd_engine::ops::{
    Accumulator, AnyWord, BitWritten, LegPowers, Math, MathReports, MathTarget, StepCode,
};

/// A private cell that holds what an instruction stores.
#[derive(Clone, Copy)]
pub(super) enum PrivateCell {
    Bit(u32),
    Word(AnyWord),
}

impl Assembler<'_> {
    /// A MATH that stores the content of a private cell in an element of an array.
    pub fn cell_into(&mut self, put: MathTarget, cell: PrivateCell, leg: LegPowers) -> Math {
        let mut builder = self.formula_builder(MathReports::IndexError);
        let result = match cell {
            PrivateCell::Bit(cell) => {
                builder.step(StepCode::LoadBit, 0, cell, 0);
                Accumulator::Integer
            }
            PrivateCell::Word(AnyWord { word, real }) => {
                let number_type = if real { NumberType::Real } else { NumberType::Integer };
                builder.push(OperandPlace::Word(word.0), number_type);
                builder.load(0);
                accumulator(number_type)
            }
        };
        builder.math(put, leg, result)
    }

    /// A MATH that reports each element that is outside of its array, and reads none.
    pub fn index_check(&mut self, elements: &[ArrayElement], leg: LegPowers) -> Math {
        let put = MathTarget::Bit(BitWritten(self.private_bit()));
        let mut builder = self.formula_builder(MathReports::IndexError);
        for element in elements {
            let index = builder.assembler.layout.word(element.index).0;
            builder.step(StepCode::CheckIndex, 0, index, element.array.count);
        }
        builder.push(OperandPlace::Integer(0), NumberType::Integer);
        builder.load(0);
        builder.math(put, leg, Accumulator::Integer)
    }
}
