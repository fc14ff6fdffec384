//! COPY of a record as operations.
//!
//! Called by `instructions`. First every field is read into a private cell, then every field is
//! written: so a record that selects what is copied to it is copied as it was. If an index is
//! outside, neither happens.

use super::assembler::Assembler;
use super::private_cells::PrivateCell;
use crate::resolve::array::ArrayElement;
use crate::resolve::instruction::{CopiedPlace, FieldCopy, Filling, Instruction, Value};
use crate::resolve::program::{Comparison, ConstantForm};
pub use rungd_engine::ops::{
    BitsRead, BitsWritten, CellRange, CopyBits, LegPowers, Move, Op, WordRead, WordTarget,
    WordWritten,
};

impl Assembler<'_> {
    /// COPY of a record.
    pub fn copy_record(&mut self, instruction: &Instruction, leg: LegPowers) -> Op {
        let fields: Vec<FieldCopy> = instruction.copied_fields().collect();
        let first = fields.first().expect("a record has a bit or a word to copy");
        let selected: Vec<ArrayElement> =
            first.from.element().into_iter().chain(first.to.element()).collect();
        let leg = self.within(&selected, leg);
        let index = first.to.element().map(|element| self.kept_index(element));
        let read: Vec<PrivateCell> =
            fields.iter().map(|field| self.read_field(field.from)).collect();
        let mut last = None;
        for (field, cell) in fields.iter().zip(read) {
            let op = self.write_field(field.to, index, cell, leg);
            last.replace(op).into_iter().for_each(|op| self.op(op));
        }
        last.expect("a record has a bit or a word to copy")
    }

    /// The leg that is ON while each of these elements is inside of its array. If one is outside
    /// while `leg` is ON, turns the status bit ON and reports it.
    fn within(&mut self, selected: &[ArrayElement], leg: LegPowers) -> LegPowers {
        if selected.is_empty() {
            return leg;
        }
        let check = self.index_check(selected, leg);
        self.op(Op::Math(check));
        let mut powers = leg.each().to_vec();
        for element in selected {
            let (index, count) = (Value::Word(element.index), element.array.count as i32);
            let number = |number| Value::Const(number, ConstantForm::Integer);
            powers.push(self.compare(index, Comparison::Ge, number(0)));
            powers.push(self.compare(index, Comparison::Lt, number(count)));
        }
        self.leg_of(&powers)
    }

    /// A private word with the index of an element, which a field that is written may hold.
    fn kept_index(&mut self, element: ArrayElement) -> u32 {
        let (index, kept) = (self.layout.word(element.index).0, self.private_word());
        let to = WordTarget { word: WordWritten(kept), min: i32::MIN, max: i32::MAX };
        self.op(Op::Move(Move { leg: self.on(), a: WordRead(index), to }));
        kept
    }

    /// Reads a field into a private cell.
    fn read_field(&mut self, from: Filling) -> PrivateCell {
        match from {
            Filling::Bit(bit) => PrivateCell::Bit(self.layout.bit(bit).0),
            Filling::Element(element) => PrivateCell::Bit(self.picked_bit(element).cell()),
            Filling::Value(value) => PrivateCell::Word(self.any(value)),
        }
    }

    /// Writes a field; `index`: the word with the index of an element.
    fn write_field(
        &mut self,
        to: CopiedPlace,
        index: Option<u32>,
        cell: PrivateCell,
        leg: LegPowers,
    ) -> Op {
        match (to, cell) {
            (CopiedPlace::Element(element), cell) => {
                let put = self.put_at(element.array, index.expect("an element has an index"));
                Op::Math(self.cell_into(put, cell, leg))
            }
            (CopiedPlace::Bit(bit), PrivateCell::Bit(from)) => {
                let [from, to] =
                    [from, self.layout.bit(bit).0].map(|first| CellRange { first, count: 1 });
                Op::CopyBits(CopyBits { leg, from: BitsRead(from), to: BitsWritten(to) })
            }
            (CopiedPlace::Word(word), PrivateCell::Word(from)) => {
                let (min, max) = self.limits(word);
                let to = WordTarget { word: WordWritten(self.layout.word(word).0), min, max };
                Op::Move(Move { leg, a: from.word, to })
            }
            (CopiedPlace::Bit(_), PrivateCell::Word(_))
            | (CopiedPlace::Word(_), PrivateCell::Bit(_)) => {
                unreachable!("both records have the same fields")
            }
        }
    }
}
