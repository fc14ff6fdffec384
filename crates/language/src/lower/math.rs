//! Turns MATH into operations: its target, and the index of a target.
//!
//! Called by `instructions`. `formula` turns the expressions into steps.

use super::assembler::Assembler;
use crate::resolve::array::Array;
use crate::resolve::formula::{Formula, FormulaPart};
use crate::resolve::instruction::{Calculation, FormulaTarget, Instruction};
pub use rungd_engine::Cell;
pub use rungd_engine::isa::Bit;
pub use rungd_engine::ops::{
    ArrayTarget, BitWritten, ElementType, LegPowers, MathReports, MathTarget, Op, WordWritten,
};

impl Assembler<'_> {
    /// Lowers a MATH.
    pub fn math(&mut self, instruction: &Instruction, leg: LegPowers) -> Op {
        let Calculation { index, value } =
            instruction.calculation.as_deref().expect("a MATH has an expression");
        let put = match (instruction.operands.required("target"), index) {
            (FormulaTarget::Bit(bit), _) => self.put_in_bit(bit),
            (FormulaTarget::Word(word), _) => self.put_in_word(word),
            (FormulaTarget::Array(array), Some(index)) => self.math_element(array, index, leg),
            (FormulaTarget::Array(_), None) => unreachable!("an element has an index"),
        };
        Op::Math(self.formula_into(put, value, leg, MathReports::All))
    }

    /// A bit as a target. A bit of a word is the only element of an array.
    fn put_in_bit(&mut self, bit: Bit) -> MathTarget {
        match self.layout.bit_in(bit) {
            Cell::Bit(cell) => MathTarget::Bit(BitWritten(cell.0)),
            Cell::WordBit(bit) => MathTarget::At(ArrayTarget {
                first: bit.word.0,
                count: 1,
                kind: ElementType::WordBits,
                each: false,
                index: self.constant(0),
                limits: bit.mask.cast_unsigned(),
            }),
            Cell::Word(_) => unreachable!("a bit is no word"),
        }
    }

    /// The target of a MATH with an index, which is evaluated first.
    fn math_element(&mut self, array: Array, index: &Formula, leg: LegPowers) -> MathTarget {
        let cell = match index.parts[..] {
            [FormulaPart::Word(word)] => self.layout.word(word).0,
            _ => {
                let cell = self.private_word();
                let target = MathTarget::Index(WordWritten(cell));
                let math = self.formula_into(target, index, leg, MathReports::All);
                self.op(Op::Math(math));
                cell
            }
        };
        self.put_at(array, cell)
    }
}
