//! The cells that hold the values of contacts and instructions: constants, words, and elements of
//! arrays, which a separate operation reads beforehand.
//!
//! `contacts`, `elements` and `instructions` ask for them.

use super::assembler::Assembler;
use super::loaded_bits::WordAndMask;
use crate::resolve::array::{Array, ArrayElement};
use crate::resolve::formula::{Formula, FormulaPart};
use crate::resolve::instruction::Value;
use crate::resolve::program::ComputedContact;
pub use rungd_engine::Cell;
pub use rungd_engine::isa::{Address, Bit};
pub use rungd_engine::ops::{
    AnyWord, BitMask, BitOwn, BitsRead, LoadWordBit, Op, PickBit, PickWord, Power, WordRead,
    WordWritten, WordsRead,
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

    /// The cell of a bit that is only read. A bit of a word is copied to a private bit.
    pub fn bit_cell(&mut self, bit: Bit) -> u32 {
        match self.layout.bit_in(bit) {
            Cell::Bit(cell) => cell.0,
            Cell::WordBit(bit) => self.copied_bit(WordRead(bit.word.0), bit.mask),
            Cell::Word(_) => unreachable!("a bit is no word"),
        }
    }

    /// A private bit with the bit of a word: that of an earlier contact, if it is still the same.
    fn copied_bit(&mut self, word: WordRead, mask: i32) -> u32 {
        let bit = WordAndMask { word: word.0, mask };
        if let Some(cell) = self.loaded.copy(bit) {
            return cell;
        }
        let cell = self.private_bit();
        self.op(Op::LoadWordBit(LoadWordBit { cell: BitOwn(cell), word, bit: BitMask(mask) }));
        self.loaded.keep(bit, cell);
        cell
    }

    /// The power of a bit that a word selects; OFF if the index is outside of the array.
    pub fn picked_bit(&mut self, element: ArrayElement) -> Power {
        if let Some(mask) = self.mask(element.array) {
            let word = self.picked_word(element);
            return Power::of(self.copied_bit(word, mask));
        }
        if element.array.member.is_some() {
            let parts = vec![FormulaPart::Word(element.index), FormulaPart::Element(element.array)];
            return self.computed(&ComputedContact { left: Formula { parts }, compare: None });
        }
        let from = BitsRead(self.cells(element.array));
        let index = WordRead(self.layout.word(element.index).0);
        let cell = self.private_bit();
        self.op(Op::PickBit(PickBit { cell: BitOwn(cell), from, index }));
        Power::of(cell)
    }

    /// The mask of the bit in each word of an array of bits of words; else `None`.
    pub fn mask(&self, array: Array) -> Option<i32> {
        match array.element(0) {
            Address::Bit(Bit::InWord(bit)) => Some(self.layout.word_bit(bit).mask),
            Address::Bit(_) | Address::Word(_) | Address::Structure(_) => None,
        }
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
