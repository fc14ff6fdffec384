//! Elements of arrays that a word selects, COPY, FILL, PACK, UNPACK and SR, as in the engine's
//! `arrays`, `array_places` and `packing`.

use super::encoder::Encoder;
use super::number::Number;
use super::value::RealValue;
use crate::aig::Literal;
use rungd_engine::isa::Real;
use rungd_engine::ops::{
    CellRange, CopyBits, CopyWords, FillBits, FillWords, PackBits, PickBit, PickWord, Sr,
    UnpackBits, WordForm,
};
use rungd_engine::{Cell, WordCell};

/// An element of an array.
struct ArrayPlace {
    array: CellRange,
    at: u32,
}

impl Encoder<'_> {
    /// Whether an index is inside of an array.
    pub(super) fn is_inside(&mut self, index: &Number, count: u32) -> Literal {
        !index.is_outside(&mut self.graph, 0, i128::from(count) - 1)
    }

    /// The bit that an index selects; OFF outside.
    pub(super) fn selected_bit(&mut self, from: CellRange, index: &Number) -> Literal {
        let bits = (from.first..from.first + from.count).map(|cell| self.bit(cell));
        let bits: Vec<Number> = bits.map(Number::of_bit).collect();
        self.selected(bits, index).bit(0)
    }

    /// The word that an index selects; 0 outside.
    pub(super) fn selected_word(&mut self, from: CellRange, index: &Number) -> Number {
        let words = (from.first..from.first + from.count).map(|cell| self.word(cell)).collect();
        self.selected(words, index)
    }

    /// The element that an index selects; 0 outside.
    fn selected(&mut self, mut elements: Vec<Number>, index: &Number) -> Number {
        let count = elements.len() as u32;
        let zero = Number::constant(0);
        let mut bit = 0;
        while elements.len() > 1 {
            let choice = index.bit(bit);
            let pairs = elements.chunks(2);
            let chosen = pairs.map(|pair| {
                Number::mux(&mut self.graph, choice, pair.get(1).unwrap_or(&zero), &pair[0])
            });
            elements = chosen.collect();
            bit += 1;
        }
        let is_inside = self.is_inside(index, count);
        let element = elements.pop().unwrap_or(zero.clone());
        self.choose(is_inside, &element, &zero)
    }

    pub(super) fn pick_bit(&mut self, op: &PickBit) {
        let index = self.word(op.index.0);
        let bit = self.selected_bit(op.from.0, &index);
        self.pass_bit(op.cell.0, bit);
    }

    pub(super) fn pick_word(&mut self, op: &PickWord) {
        let index = self.word(op.index.0);
        let word = self.selected_word(op.from.0, &index);
        self.pass_word(op.cell.0, word);
    }

    pub(super) fn copy_bits(&mut self, op: &CopyBits) {
        let leg = self.leg(&op.leg);
        let (from, to) = (op.from.0, op.to.0);
        let read: Vec<Literal> = (0..from.count).map(|at| self.bit(from.first + at)).collect();
        for (at, bit) in (0..).zip(read) {
            self.put_bit_if(leg, to.first + at, bit);
        }
    }

    pub(super) fn copy_words(&mut self, op: &CopyWords) {
        let leg = self.leg(&op.leg);
        let (from, to) = (op.from.0, op.to.0);
        let read: Vec<Number> = (0..from.count).map(|at| self.word(from.first + at)).collect();
        for (at, word) in (0..).zip(read) {
            self.put_in_form(op.form, leg, ArrayPlace { array: to, at }, &word);
        }
    }

    /// Writes the content of a word to an element, with the conversions of MOVE.
    fn put_in_form(&mut self, form: WordForm, leg: Literal, to: ArrayPlace, word: &Number) {
        let limits = self.written.element_limits(form.limits, to.at);
        let converted = match (form.from_real, form.to_real) {
            (true, true) | (false, false) => Some(word.clone()),
            (true, false) => RealValue::of_cell(word.clone()).whole(),
            (false, true) => word.as_constant().map(|word| {
                let nearest = Real::nearest(word as i32);
                Number::constant(nearest.cell().into())
            }),
        };
        let cell = to.array.first + to.at;
        let stored = converted.unwrap_or_else(|| {
            let place = Cell::Word(WordCell(cell));
            self.cut(place, "a conversion to or from a real", limits)
        });
        let limited = stored.clamp(&mut self.graph, limits.low, limits.high);
        self.put_word_if(leg, cell, limited);
    }

    pub(super) fn fill_bits(&mut self, op: &FillBits) {
        let (leg, bit) = (self.leg(&op.leg), self.bit(op.bit.0));
        for at in 0..op.to.0.count {
            self.put_bit_if(leg, op.to.0.first + at, bit);
        }
    }

    pub(super) fn fill_words(&mut self, op: &FillWords) {
        let (leg, word) = (self.leg(&op.leg), self.word(op.word.0));
        for at in 0..op.to.0.count {
            self.put_in_form(op.form, leg, ArrayPlace { array: op.to.0, at }, &word);
        }
    }

    pub(super) fn pack_bits(&mut self, op: &PackBits) {
        let leg = self.leg(&op.leg);
        let from = op.from.0;
        let mut bits = vec![Literal::FALSE; 32];
        for at in 0..from.count - 1 {
            bits[at as usize] = self.bit(from.first + at);
        }
        let last = self.bit(from.first + from.count - 1);
        for (at, bit) in bits.iter_mut().enumerate() {
            if op.last.0 >> at & 1 == 1 {
                *bit = self.graph.or(*bit, last);
            }
        }
        self.put_target(&op.to, leg, &Number::of_bits(bits));
    }

    pub(super) fn unpack_bits(&mut self, op: &UnpackBits) {
        let (leg, word) = (self.leg(&op.leg), self.word(op.word.0));
        for at in 0..op.to.0.count {
            self.put_bit_if(leg, op.to.0.first + at, word.bit(at as usize));
        }
    }

    pub(super) fn sr(&mut self, op: &Sr) {
        let (clk, rst) = (self.leg(&op.clk), self.leg(&op.rst));
        let before = self.bit(op.shift.history.0);
        let rises = self.graph.and(clk, !before);
        self.put_bit(op.shift.history.0, clk);
        let data = self.leg(&op.data);
        let CellRange { first, count } = op.bits.0;
        let cell = |at: u32| first + if op.shift.down { count - 1 - at } else { at };
        for at in (0..count).rev() {
            let from = if at == 0 { data } else { self.bit(cell(at - 1)) };
            let shifted = self.graph.mux(rises, from, Literal::FALSE);
            let changes = self.graph.or(rst, rises);
            let value = self.graph.and(shifted, !rst);
            self.put_bit_if(changes, cell(at), value);
        }
    }
}
