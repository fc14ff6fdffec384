//! Contacts, coils and arithmetic, as in the engine's `logic` and `word_bits`.

use super::encoder::Encoder;
use super::number::Number;
use super::value::RealValue;
use super::written::WordRange;
use crate::aig::Literal;
use rungd_engine::ops::{
    Add, AddMixed, AnyTarget, AnyWord, BitOwn, BitWritten, Equal, EqualMixed, Fall, Less,
    LessMixed, LoadWordBit, Move, Nd, OutWordBit, Pd, Ponoff, Powers, Rise, Rst, RstWordBit, Set,
    SetWordBit, Sub, SubMixed,
};
use rungd_engine::{BitCell, Cell, WordBitCell, WordCell};

impl Encoder<'_> {
    pub(super) fn and<const N: usize>(&mut self, cell: BitOwn, powers: &Powers<N>) {
        let all = self.powers(powers);
        self.pass_bit(cell.0, all);
    }

    /// The value of a bit now, and whether it is another one than at the last evaluation.
    fn edge(&mut self, now: Literal, history: BitOwn) -> Literal {
        let before = self.bit(history.0);
        self.put_bit(history.0, now);
        self.graph.xor(now, before)
    }

    pub(super) fn rise(&mut self, op: &Rise) {
        let now = self.bit(op.bit.0);
        let changes = self.edge(now, op.history);
        let rises = self.graph.and(now, changes);
        self.pass_bit(op.cell.0, rises);
    }

    pub(super) fn fall(&mut self, op: &Fall) {
        let now = self.bit(op.bit.0);
        let changes = self.edge(now, op.history);
        let falls = self.graph.and(!now, changes);
        self.pass_bit(op.cell.0, falls);
    }

    pub(super) fn equal(&mut self, op: &Equal) {
        let (a, b) = (self.word(op.a.0), self.word(op.b.0));
        let equal = a.equal(&mut self.graph, &b);
        self.pass_bit(op.cell.0, equal);
    }

    pub(super) fn less(&mut self, op: &Less) {
        let (a, b) = (self.word(op.a.0), self.word(op.b.0));
        let less = a.less(&mut self.graph, &b);
        self.pass_bit(op.cell.0, less);
    }

    /// The value of a word that is read as a real.
    fn any_word(&mut self, word: AnyWord) -> RealValue {
        let content = self.word(word.word.0);
        if word.real { RealValue::of_cell(content) } else { RealValue::of_whole(content) }
    }

    pub(super) fn equal_mixed(&mut self, op: &EqualMixed) {
        let (a, b) = (self.any_word(op.a), self.any_word(op.b));
        let found = a.equal(&mut self.graph, &b);
        self.compared(op.cell, found);
    }

    pub(super) fn less_mixed(&mut self, op: &LessMixed) {
        let (a, b) = (self.any_word(op.a), self.any_word(op.b));
        let found = a.less(&mut self.graph, &b);
        self.compared(op.cell, found);
    }

    fn compared(&mut self, cell: BitOwn, found: Option<Literal>) {
        let place = Cell::Bit(BitCell(cell.0));
        let what = "a compare of an integer and a real";
        let found = found.unwrap_or_else(|| self.cut(place, what, WordRange::BIT).bit(0));
        self.pass_bit(cell.0, found);
    }

    pub(super) fn out<const N: usize>(&mut self, leg: &Powers<N>, bit: BitWritten) {
        let leg = self.powers(leg);
        self.pass_bit(bit.0, leg);
    }

    pub(super) fn set(&mut self, op: &Set) {
        let leg = self.leg(&op.leg);
        self.put_bit_if(leg, op.bit.0, Literal::TRUE);
    }

    pub(super) fn rst(&mut self, op: &Rst) {
        let leg = self.leg(&op.leg);
        self.put_bit_if(leg, op.bit.0, Literal::FALSE);
    }

    pub(super) fn pd(&mut self, op: &Pd) {
        let now = self.leg(&op.leg);
        let changes = self.edge(now, op.history);
        let rises = self.graph.and(now, changes);
        self.put_bit(op.bit.0, rises);
    }

    pub(super) fn nd(&mut self, op: &Nd) {
        let now = self.leg(&op.leg);
        let changes = self.edge(now, op.history);
        let falls = self.graph.and(!now, changes);
        self.put_bit(op.bit.0, falls);
    }

    pub(super) fn ponoff(&mut self, op: &Ponoff) {
        let now = self.leg(&op.leg);
        let bit = self.bit(op.bit.0);
        let changes = self.edge(now, op.history);
        let rises = self.graph.and(now, changes);
        let toggled = self.graph.xor(bit, rises);
        self.put_bit(op.bit.0, toggled);
    }

    /// Whether a number has a bit of a mask.
    pub(super) fn has_bit(&mut self, number: &Number, mask: i32) -> Literal {
        let bits = (0..32).filter(|at| mask >> at & 1 == 1).map(|at| number.bit(at));
        self.graph.any(bits)
    }

    /// A number with the bits of a mask ON or OFF.
    pub(super) fn with_bits(&mut self, number: &Number, mask: i32, on: Literal) -> Number {
        let bit = |at: usize| if mask >> at & 1 == 1 { on } else { number.bit(at) };
        Number::of_bits((0..32).map(bit).collect())
    }

    pub(super) fn load_word_bit(&mut self, op: &LoadWordBit) {
        let word = self.word(op.word.0);
        let on = self.has_bit(&word, op.bit.0);
        self.pass_bit(op.cell.0, on);
    }

    /// Writes a bit of a word while a condition is ON.
    pub(super) fn put_word_bit_if(&mut self, condition: Literal, bit: WordBitCell, on: Literal) {
        let WordBitCell { word: WordCell(word), mask } = bit;
        let content = self.word(word);
        let changed = self.with_bits(&content, mask, on);
        self.put_word_if(condition, word, changed);
    }

    pub(super) fn out_word_bit(&mut self, op: &OutWordBit) {
        let leg = self.leg(&op.leg);
        self.put_word_bit_if(Literal::TRUE, op.bit.0, leg);
    }

    pub(super) fn set_word_bit(&mut self, op: &SetWordBit) {
        let leg = self.leg(&op.leg);
        self.put_word_bit_if(leg, op.bit.0, Literal::TRUE);
    }

    pub(super) fn rst_word_bit(&mut self, op: &RstWordBit) {
        let leg = self.leg(&op.leg);
        self.put_word_bit_if(leg, op.bit.0, Literal::FALSE);
    }

    pub(super) fn mov(&mut self, op: &Move) {
        let (leg, value) = (self.leg(&op.leg), self.word(op.a.0));
        self.put_target(&op.to, leg, &value);
    }

    pub(super) fn add(&mut self, op: &Add) {
        let (a, b) = (self.word(op.a.0), self.word(op.b.0));
        let (leg, sum) = (self.leg(&op.leg), a.add(&mut self.graph, &b));
        self.put_target(&op.to, leg, &sum);
    }

    pub(super) fn sub(&mut self, op: &Sub) {
        let (a, b) = (self.word(op.a.0), self.word(op.b.0));
        let (leg, difference) = (self.leg(&op.leg), a.sub(&mut self.graph, &b));
        self.put_target(&op.to, leg, &difference);
    }

    pub(super) fn add_mixed(&mut self, op: &AddMixed) {
        let (a, b) = (self.any_word(op.a), self.any_word(op.b));
        let leg = self.leg(&op.leg);
        let what = if b.is_zero() { "a conversion to or from a real" } else { "ADD of a real" };
        self.put_any(&op.to, leg, &a.sum(&b), what);
    }

    pub(super) fn sub_mixed(&mut self, op: &SubMixed) {
        let (a, b) = (self.any_word(op.a), self.any_word(op.b));
        let leg = self.leg(&op.leg);
        self.put_any(&op.to, leg, &a.difference(&b), "SUB of a real");
    }

    /// Stores a real in an integer or a real.
    fn put_any(&mut self, to: &AnyTarget, leg: Literal, value: &RealValue, what: &'static str) {
        let cell = if to.real { value.cell() } else { value.whole() };
        let target = &to.target;
        let cell = cell.unwrap_or_else(|| {
            let place = Cell::Word(WordCell(target.word.0));
            self.cut(place, what, WordRange::of(target))
        });
        self.put_target(target, leg, &cell);
    }
}
