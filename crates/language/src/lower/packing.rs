//! PACK and UNPACK as operations.
//!
//! Called by `instructions`. For an element that a word selects, PACK fills a private word, and a
//! MATH stores it.

use super::assembler::Assembler;
use super::private_cells::PrivateCell;
use crate::resolve::array::Array;
use crate::resolve::instruction::{Instruction, Value, WordPlace};
pub use rungd_engine::isa::{Word, WordBit};
pub use rungd_engine::ops::{
    AnyWord, BitMask, BitsRead, BitsWritten, LegPowers, Op, PackBits, UnpackBits, WordRead,
    WordTarget, WordWritten,
};

impl Assembler<'_> {
    /// PACK and UNPACK.
    pub fn pack_or_unpack(&mut self, instruction: &Instruction, leg: LegPowers) -> Op {
        match instruction.operands.get("word") {
            Some(word) => self.unpack(word.value, instruction, leg),
            None => self.pack(instruction, leg),
        }
    }

    /// PACK.
    fn pack(&mut self, instruction: &Instruction, leg: LegPowers) -> Op {
        let bits: Array = instruction.operands.required("bits");
        let from = BitsRead(self.cells(bits));
        let last = |assembler: &Self, word: Word| {
            let number = bits.count as u8 - 1;
            BitMask(assembler.layout.word_bit(WordBit { word, number }).mask)
        };
        let element = match instruction.operands.required("to") {
            WordPlace::Word(word) => {
                let (min, max) = self.limits(word);
                let to = WordTarget { word: WordWritten(self.layout.word(word).0), min, max };
                return Op::PackBits(PackBits { leg, from, last: last(self, word), to });
            }
            WordPlace::Element(element) => element,
        };
        let word = element.array.first_word().expect("PACK writes words");
        let (last, packed) = (last(self, word), self.private_word());
        let to = WordTarget { word: WordWritten(packed), min: i32::MIN, max: i32::MAX };
        self.op(Op::PackBits(PackBits { leg, from, last, to }));
        let index = self.layout.word(element.index).0;
        let put = self.put_at(element.array, index);
        let packed = AnyWord { word: WordRead(packed), real: false };
        Op::Math(self.cell_into(put, PrivateCell::Word(packed), leg))
    }

    /// UNPACK.
    fn unpack(&mut self, value: Value, instruction: &Instruction, leg: LegPowers) -> Op {
        let to = BitsWritten(self.cells(instruction.operands.required("to")));
        let word = self.value_while(value, leg);
        Op::UnpackBits(UnpackBits { leg, word, to })
    }
}
