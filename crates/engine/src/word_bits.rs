//! Bits of words: contacts on them, and the coils that write them.
//!
//! A contact's bit is copied to a private bit, which all other operations can read. A coil reads
//! the word, changes its bit and writes the word back; so a forced word keeps its value.
//! Behaviour: `docs/semantics.md`, section 11.

use super::layout::WordBitCell;
use super::memory::{MemoryView, select};
use super::ops::{LoadWordBit, Operation, OutWordBit, RstWordBit, SetWordBit};
use super::reach::Reach;
use super::role::{BitMask, FieldRole, TouchedCells, WordBitWritten, WordWritten};

impl Operation for LoadWordBit {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        let on = view.word(self.word) & self.bit.0 != 0;
        view.put_own(self.cell, u8::from(on));
    }

    /// Four at a time: of an operation as short as this one, the loop is a third of the cost.
    #[inline(always)]
    fn run_each<R: Reach>(ops: &[LoadWordBit], view: &mut MemoryView<R>) {
        let (fours, rest) = ops.as_chunks::<4>();
        for four in fours {
            four.iter().for_each(|op| op.run(view));
        }
        rest.iter().for_each(|op| op.run(view));
    }
}

macro_rules! coils {
    ($($coil:ident |$leg:ident, $content:ident, $mask:ident| $value:expr;)*) => {$(
        impl Operation for $coil {
            #[inline(always)]
            fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
                let WordBitCell { word, mask: $mask } = self.bit.0;
                let word = WordWritten(word.0);
                let ($leg, $content) = (view.all(&self.leg), view.word(word));
                view.put_word(word, $value);
            }
        }
    )*};
}

coils! {
    OutWordBit |leg, content, mask| select(leg, content | mask, content & !mask);
    SetWordBit |leg, content, mask| select(leg, content | mask, content);
    RstWordBit |leg, content, mask| select(leg, content & !mask, content);
}

/// A mask adds no cell: the word is a field of its own.
impl FieldRole for BitMask {
    fn touches(&self, _: &mut TouchedCells) {}
}

impl FieldRole for WordBitWritten {
    fn touches(&self, t: &mut TouchedCells) {
        t.words_written.push(self.0.word.0);
        t.word_bits_written.push(self.0);
    }
}
