//! COPY, FILL and SR: instructions on whole arrays.
//!
//! Behaviour: `docs/semantics.md`, section 9. Each element is written as if by its own instruction:
//! a forced element keeps its value, and the limits of the element apply.

use super::array_places::WordForm;
use super::memory::MemoryView;
use super::ops::{CopyBits, CopyWords, FillBits, FillWords, Operation, Sr};
use super::reach::Reach;
use super::role::{BitRead, BitWritten, CellRange, WordRead, WordWritten};
use crate::isa::Real;

impl WordForm {
    /// Writes the content of a word to an element, with the conversions of MOVE.
    fn put<R: Reach>(self, view: &mut MemoryView<R>, to: CellRange, at: u32, content: i32) {
        let stored = match (self.from_real, self.to_real) {
            (true, false) => f64::from(Real::of_cell(content)) as i64,
            (false, true) => i64::from(Real::nearest(content).cell()),
            (true, true) | (false, false) => i64::from(content),
        };
        let (low, high) = self.limits.limits(view, at);
        let limited = stored.clamp(low.into(), high.into()) as i32;
        view.put_word(WordWritten(to.first + at), limited);
    }
}

/// The order in which each element of overlapping arrays is read before it is overwritten.
fn in_order(from: CellRange, to: CellRange) -> impl Iterator<Item = u32> {
    let down = to.first > from.first;
    (0..from.count).map(move |at| if down { from.count - 1 - at } else { at })
}

impl Operation for CopyBits {
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        if view.leg(&self.leg) == 0 {
            return;
        }
        let (from, to) = (self.from.0, self.to.0);
        for at in in_order(from, to) {
            let bit = view.bit(BitRead(from.first + at));
            view.put_bit(BitWritten(to.first + at), bit);
        }
    }
}

impl Operation for CopyWords {
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        if view.leg(&self.leg) == 0 {
            return;
        }
        let (from, to) = (self.from.0, self.to.0);
        for at in in_order(from, to) {
            let word = view.word(WordRead(from.first + at));
            self.form.put(view, to, at, word);
        }
    }
}

impl Operation for FillBits {
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        if view.leg(&self.leg) == 0 {
            return;
        }
        let bit = view.bit(self.bit);
        for cell in self.to.0.each() {
            view.put_bit(BitWritten(cell), bit);
        }
    }
}

impl Operation for FillWords {
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        if view.leg(&self.leg) == 0 {
            return;
        }
        let word = view.word(self.word);
        for at in 0..self.to.0.count {
            self.form.put(view, self.to.0, at, word);
        }
    }
}

impl Operation for Sr {
    fn run<R: Reach>(&self, view: &mut MemoryView<R>) {
        let (clk, rst) = (view.leg(&self.clk), view.leg(&self.rst));
        let rises = clk & (view.bit(self.shift.history) ^ 1);
        view.put_own(self.shift.history, clk);
        let CellRange { first, count } = self.bits.0;
        let cell = |at: u32| first + if self.shift.down { count - 1 - at } else { at };
        if rst != 0 {
            (0..count).for_each(|at| view.put_bit(BitWritten(cell(at)), 0));
        } else if rises != 0 {
            let data = view.leg(&self.data);
            for at in (1..count).rev() {
                let before = view.bit(BitRead(cell(at - 1)));
                view.put_bit(BitWritten(cell(at)), before);
            }
            view.put_bit(BitWritten(cell(0)), data);
        }
    }
}
