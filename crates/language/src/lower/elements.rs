//! Instructions with elements of arrays that a word selects.
//!
//! Called by `instructions`, `stores` and `arrays`; `math` uses `put_at`. An instruction with such
//! an element must turn the status bit of a wrong index ON and report it. So it becomes a MATH, or
//! a MATH reads its operand beforehand. For a contact or compare, an operation of `values` reads
//! the element. An element with a constant index is a plain cell, and the resolved program has a
//! tag for each element, so limits, retentive memory, logs and reloads need no code for arrays.

use super::assembler::Assembler;
use crate::resolve::array::{Array, ArrayElement};
use crate::resolve::formula::{Formula, FormulaInteger, FormulaPart};
use crate::resolve::instruction::Value;
pub use rungd_engine::PassStep;
use rungd_engine::isa::status::st;
use rungd_engine::isa::{Bit, BitSpace, Space};
pub use rungd_engine::ops::{
    ArrayLimits, ArrayTarget, BitWritten, ElementType, LegPowers, Math, MathReports, MathTarget,
    Op, Power, WordRead, WordTarget, WordWritten,
};

impl Assembler<'_> {
    /// The word of a preset. Its owner reads it at every execution and, if `in_pass`, in the pass
    /// too.
    pub fn owner_preset(&mut self, value: Value, in_pass: bool) -> WordRead {
        let Value::Element(element) = value else { return self.value(value) };
        let on = self.on();
        let (math, cell) = self.reading(element, on);
        self.op(Op::Math(math));
        if in_pass {
            let pick = self.pick(math);
            self.terminates(PassStep::Pick(pick));
        }
        cell
    }

    /// A bit that a word selects, read while a leg is ON.
    pub fn bit_while(&mut self, element: ArrayElement, leg: LegPowers) -> u32 {
        let cell = self.private_bit();
        let parts = vec![FormulaPart::Word(element.index), FormulaPart::Element(element.array)];
        let math = self.formula_into(
            MathTarget::Bit(BitWritten(cell)),
            &Formula { parts },
            leg,
            MathReports::IndexError,
        );
        self.op(Op::Math(math));
        cell
    }

    /// The word of a value that an instruction reads while its leg is ON.
    pub fn value_while(&mut self, value: Value, leg: LegPowers) -> WordRead {
        let Value::Element(element) = value else { return self.value(value) };
        let (math, cell) = self.reading(element, leg);
        self.op(Op::Math(math));
        cell
    }

    /// The interval of an ENTASK, and the MATH that reads it when the Task is enabled.
    pub fn interval(&mut self, value: Value) -> (WordRead, Option<u32>) {
        let Value::Element(element) = value else { return (self.value(value), None) };
        let on = self.on();
        let (math, cell) = self.reading(element, on);
        (cell, Some(self.pick(math)))
    }

    /// A MATH that reads an element into a private word.
    fn reading(&mut self, element: ArrayElement, leg: LegPowers) -> (Math, WordRead) {
        let cell = self.private_word();
        let parts = vec![FormulaPart::Word(element.index), FormulaPart::Element(element.array)];
        let (min, max) = (i32::MIN, i32::MAX);
        let to = WordTarget { word: WordWritten(cell), min, max };
        let put = match element.array.is_real() {
            true => MathTarget::Real(to),
            false => MathTarget::Word { to, low: min, high: max },
        };
        let math = self.formula_into(put, &Formula { parts }, leg, MathReports::IndexError);
        (math, WordRead(cell))
    }

    /// The leg that is `$On`.
    pub(super) fn on(&self) -> LegPowers {
        LegPowers::of(Power::of(self.layout.bit(Bit::Space(BitSpace::St, st::ON)).0))
    }

    /// SET and RST of a bit that a word selects.
    pub fn set_element(&mut self, on: bool, element: ArrayElement, leg: LegPowers) -> Op {
        let index = self.layout.word(element.index).0;
        let put = self.put_at(element.array, index);
        let parts = vec![FormulaPart::Integer(FormulaInteger::new(i64::from(on)))];
        Op::Math(self.formula_into(put, &Formula { parts }, leg, MathReports::IndexError))
    }

    /// An element as a target; its index is the word in the cell `index`.
    pub fn put_at(&mut self, array: Array, index: u32) -> MathTarget {
        let cells = self.cells(array);
        let kind = match array.space {
            Space::Bit(_) => ElementType::Bits,
            _ if array.bit.is_some() => ElementType::WordBits,
            _ if array.is_real() => ElementType::Reals,
            _ if array.first_word().is_some_and(|word| word.range().0 == 0) => {
                ElementType::Unsigned
            }
            Space::Word(_) | Space::Counter | Space::Timer | Space::Sensaphone => {
                ElementType::Integers
            }
        };
        let limits = match self.mask(array) {
            Some(mask) => ArrayLimits { first: mask.cast_unsigned(), each: false },
            None => self.array_limits(array),
        };
        MathTarget::At(ArrayTarget {
            first: cells.first,
            count: cells.count as u16,
            kind,
            each: limits.each,
            index,
            limits: limits.first,
        })
    }
}
