//! Reads and writes of bits and words. A write is a choice by the guard.
//!
//! A private cell into which an operation writes in every execution, and which only later
//! operations of the same execution read, passes a value: its write needs no guard, and it needs no
//! latch. This is assumed of every such write, and checked at every read.

use super::acc_forms::AccForm;
use super::encoder::Encoder;
use super::held::Next;
use super::number::Number;
use crate::aig::Literal;
use crate::gates::Held;
use rungd_engine::ops::{LegPowers, Powers, WordTarget};
use rungd_engine::record::RECORD;
use rungd_engine::{BitCell, Cell, Power, WordCell};

impl Encoder<'_> {
    /// A bit.
    pub(super) fn bit(&mut self, bit: u32) -> Literal {
        self.check(Cell::Bit(BitCell(bit)));
        if let Some(literal) = self.bits[bit as usize] {
            return literal;
        }
        let literal = self.first_bit(bit);
        self.bits[bit as usize] = Some(literal);
        literal
    }

    /// A word.
    pub(super) fn word(&mut self, word: u32) -> Number {
        self.check(Cell::Word(WordCell(word)));
        if let Some(number) = self.words.get(&word) {
            return number.clone();
        }
        let number = self.first_word(word);
        self.words.insert(word, number.clone());
        number
    }

    /// The value of a bit at the start of a scan.
    pub(super) fn first_bit(&mut self, bit: u32) -> Literal {
        if let Some(literal) = self.status_bit(bit) {
            return literal;
        }
        let cell = BitCell(bit);
        let initial = self.start.image.bit(cell);
        if !self.written.has_bit(cell) {
            return Literal::constant(initial);
        }
        let latch = self.latch(initial, Held::Bit(cell), Next::Bit(cell));
        match self.at_start.get(&Cell::Bit(cell)).map(|free| free.bit(0)) {
            None => latch,
            Some(free) => {
                let first = self.beginning();
                self.graph.mux(first, free, latch)
            }
        }
    }

    /// The value of a word at the start of a scan.
    pub(super) fn first_word(&mut self, word: u32) -> Number {
        if let Some(number) = self.status_word(word) {
            return number;
        }
        let cell = WordCell(word);
        let initial = self.start.image.word(cell);
        let Some(limits) = self.written.word(cell) else {
            return Number::constant(initial.into());
        };
        let form = self.acc_forms.get(&word).copied();
        let limits = form.map_or(limits.with(initial), AccForm::range);
        let counts_scans = matches!(form, Some(AccForm::Scans { .. }));
        let latches = Number::made(limits.low.into(), limits.high.into(), |at| {
            let (initial, at) = (initial >> at & 1 == 1, at as u8);
            let held = if counts_scans { Held::TimerScans } else { Held::WordBit };
            self.latch(initial, held(cell, at), Next::WordBit(cell, at))
        });
        match self.at_start.get(&Cell::Word(cell)).cloned() {
            None => latches,
            Some(free) => {
                let first = self.beginning();
                self.choose(first, &free, &latches)
            }
        }
    }

    /// Notes a cell that lasts beyond the execution that wrote it.
    fn check(&mut self, cell: Cell) {
        if self.passing.get(&cell).is_some_and(|execution| *execution != self.execution) {
            self.lasting.insert(cell);
        }
    }

    pub(super) fn power(&mut self, power: Power) -> Literal {
        self.bit(power.cell()).inverted_if(power.is_opposite())
    }

    /// Whether all powers are ON.
    pub(super) fn powers<const N: usize>(&mut self, powers: &Powers<N>) -> Literal {
        let mut all = Literal::TRUE;
        for power in powers.each() {
            let power = self.power(power);
            all = self.graph.and(all, power);
        }
        all
    }

    pub(super) fn leg(&mut self, leg: &LegPowers) -> Literal {
        self.powers(leg)
    }

    /// Writes a bit.
    pub(super) fn put_bit(&mut self, bit: u32, value: Literal) {
        self.put_bit_if(Literal::TRUE, bit, value);
    }

    /// Writes a bit while a condition is ON.
    pub(super) fn put_bit_if(&mut self, condition: Literal, bit: u32, value: Literal) {
        if self.model.start.is_forced(Cell::Bit(BitCell(bit))) {
            return;
        }
        let condition = self.graph.and(self.guard, condition);
        let value = match condition.as_constant() {
            Some(true) => {
                self.passing.remove(&Cell::Bit(BitCell(bit)));
                value
            }
            Some(false) => return,
            // A choice between this value and a passing one is a passing one.
            None => {
                let before = self.bit(bit);
                self.graph.mux(condition, value, before)
            }
        };
        self.bits[bit as usize] = Some(value);
    }

    /// Writes a word.
    pub(super) fn put_word(&mut self, word: u32, value: Number) {
        self.put_word_if(Literal::TRUE, word, value);
    }

    /// Writes a word while a condition is ON.
    pub(super) fn put_word_if(&mut self, condition: Literal, word: u32, value: Number) {
        if self.model.start.is_forced(Cell::Word(WordCell(word))) {
            return;
        }
        let condition = self.graph.and(self.guard, condition);
        let value = match condition.as_constant() {
            Some(true) => {
                self.passing.remove(&Cell::Word(WordCell(word)));
                value
            }
            Some(false) => return,
            None => {
                let before = self.word(word);
                Number::mux(&mut self.graph, condition, &value, &before)
            }
        };
        self.words.insert(word, value);
    }

    /// Writes the result of an operation whose private cell passes it to others.
    pub(super) fn pass_bit(&mut self, bit: u32, value: Literal) {
        let cell = Cell::Bit(BitCell(bit));
        if bit < self.code.layout.bit_count() || self.is_lasting(cell) {
            return self.put_bit(bit, value);
        }
        self.passing.insert(cell, self.execution);
        self.bits[bit as usize] = Some(value);
    }

    /// Does the same for a word.
    pub(super) fn pass_word(&mut self, word: u32, value: Number) {
        let cell = Cell::Word(WordCell(word));
        if word < self.code.layout.word_count() || self.is_lasting(cell) {
            return self.put_word(word, value);
        }
        self.passing.insert(cell, self.execution);
        self.words.insert(word, value);
    }

    fn is_lasting(&self, cell: Cell) -> bool {
        self.guard == Literal::TRUE || self.kept.contains(&cell)
    }

    /// Writes a word within the limits of a target while a leg is ON.
    pub(super) fn put_target(&mut self, to: &WordTarget, leg: Literal, value: &Number) {
        let limited = value.clamp(&mut self.graph, to.min, to.max);
        if leg == Literal::TRUE {
            return self.pass_word(to.word.0, limited);
        }
        self.put_word_if(leg, to.word.0, limited);
    }

    /// A bit of a record.
    pub(super) fn record_bit(&mut self, at: u32, place: u32) -> Literal {
        self.bit(at * RECORD as u32 + place)
    }

    /// Writes a bit of a record.
    pub(super) fn put_record_bit(&mut self, at: u32, place: u32, value: Literal) {
        self.put_bit(at * RECORD as u32 + place, value);
    }

    /// `on` while `choice` is ON, else `off`.
    pub(super) fn choose(&mut self, choice: Literal, on: &Number, off: &Number) -> Number {
        Number::mux(&mut self.graph, choice, on, off)
    }

    /// Does what `act` does under a narrower guard.
    pub(super) fn under<T>(&mut self, condition: Literal, act: impl FnOnce(&mut Self) -> T) -> T {
        let narrower = self.graph.and(self.guard, condition);
        let before = std::mem::replace(&mut self.guard, narrower);
        let found = act(self);
        self.guard = before;
        found
    }
}
