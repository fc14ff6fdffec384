//! The cells that hold the values of contacts and instructions: constants, words, and elements of
//! arrays, which a separate operation reads beforehand.
//!
//! `contacts`, `elements` and `instructions` ask for them.

use super::assembler::Assembler;
use crate::resolve::array::ArrayElement;
use crate::resolve::instruction::Value;
pub use rungd_engine::ops::{
    AnyWord, BitOwn, BitsRead, Op, PickBit, PickWord, Power, WordRead, WordWritten, WordsRead,
};

impl Assembler<'_> {
    /// The word of a value. An element outside of its array has the value 0.
    pub fn value(&mut self, value: Value) -> WordRead {
        match value {
            Value::Const(value, _) => WordRead(self.constant(value)),
            Value::Real(real) => WordRead(self.constant(real.cell())),
            Value::Word(word) => WordRead(self.layout.word(word).0),
            Value::Element(element) => self.picked_word(element),
        }
    }

    /// The word of a value, integer or real.
    pub fn any(&mut self, value: Value) -> AnyWord {
        AnyWord { word: self.value(value), real: value.is_real() }
    }

    /// The power of a bit that a word selects; OFF if the index is outside of the array.
    pub fn picked_bit(&mut self, element: ArrayElement) -> Power {
        let from = BitsRead(self.cells(element.array));
        let index = WordRead(self.layout.word(element.index).0);
        let cell = self.private_bit();
        self.op(Op::PickBit(PickBit { cell: BitOwn(cell), from, index }));
        Power::of(cell)
    }

    /// A word that a word selects; 0 if the index is outside of the array.
    fn picked_word(&mut self, element: ArrayElement) -> WordRead {
        let from = WordsRead(self.cells(element.array));
        let index = WordRead(self.layout.word(element.index).0);
        let cell = self.private_word();
        self.op(Op::PickWord(PickWord { cell: WordWritten(cell), from, index }));
        WordRead(cell)
    }
}
