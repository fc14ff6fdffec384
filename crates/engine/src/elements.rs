//! Elements of arrays that contacts and compares read by an index known only at run time.
//!
//! Behaviour: `docs/semantics.md`, section 9. No index reaches a cell outside of its array.
//! Formulas read and store elements too: `steps`, `array_places`.

use super::memory::MemoryView;
use super::ops::{Operation, PickBit, PickWord};
use super::reach::Reach;
use super::role::{BitRead, WordRead};

impl Operation for PickBit {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        let cell = self.from.0.cell(view.word(self.index));
        let bit = cell.map_or(0, |cell| view.bit(BitRead(cell)));
        view.put_own(self.cell, bit);
    }
}

impl Operation for PickWord {
    #[inline(always)]
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        let cell = self.from.0.cell(view.word(self.index));
        let word = cell.map_or(0, |cell| view.word(WordRead(cell)));
        view.put_word(self.cell, word);
    }
}
