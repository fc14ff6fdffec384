//! The values at the start of a scan: constants, status, or latches; and what the latches become.

use super::number::Number;
use super::{Encoder, Encoding};
use crate::aig::Literal;
use crate::gates::{Gates, Held, Latch};
use rungd_engine::isa::BlockId;
use rungd_engine::{BitCell, Cell, Element, WordCell};
use rustc_hash::FxHashSet;

/// A number of a block, Stage or subroutine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum OwnNumber {
    /// The interval of a recurrent Task, ms.
    Interval(BlockId),
    /// The time in the current interval of a recurrent Task, ms.
    Phase(BlockId),
    /// The number of scans since the last execution of an element.
    Age(Element),
}

impl OwnNumber {
    fn held(self, bit: u8) -> Held {
        match self {
            OwnNumber::Interval(task) => Held::Interval(task, bit),
            OwnNumber::Phase(task) => Held::Phase(task, bit),
            OwnNumber::Age(Element::Block(block)) => Held::Age(block, bit),
            OwnNumber::Age(Element::Stage(stage)) => Held::StageAge(stage, bit),
        }
    }
}

/// The value of a latch in the next scan.
#[derive(Clone, Copy, Debug)]
pub(super) enum Next {
    /// That of the bit at the end of this scan.
    Bit(BitCell),
    /// A bit of the word.
    WordBit(WordCell, u8),
    /// The state.
    Own(Held),
    /// A bit of the number.
    OwnBit(OwnNumber, u8),
    /// A literal.
    Fixed(Literal),
}

/// A latch that was made.
#[derive(Clone, Copy, Debug)]
pub(super) struct OwnedLatch {
    pub literal: Literal,
    pub next: Next,
    pub initial: bool,
    pub holds: Held,
}

impl Encoder<'_> {
    /// Makes a latch.
    pub(super) fn latch(&mut self, initial: bool, holds: Held, next: Next) -> Literal {
        let literal = self.graph.latch();
        self.latches.push(OwnedLatch { literal, next, initial, holds });
        literal
    }

    /// Makes a latch whose next value is set at once.
    pub(super) fn fixed_latch(&mut self, initial: bool, holds: Held) -> Literal {
        self.latch(initial, holds, Next::Fixed(Literal::FALSE))
    }

    /// Sets the next value of a latch of [`Encoder::fixed_latch`].
    pub(super) fn set_next(&mut self, latch: Literal, next: Literal) {
        let made = self.latches.iter_mut().rev().find(|made| made.literal == latch);
        made.expect("it was made").next = Next::Fixed(next);
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
        self.latch(initial, Held::Bit(cell), Next::Bit(cell))
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
        let limits = limits.with(initial);
        Number::made(limits.low.into(), limits.high.into(), |at| {
            let (initial, at) = (initial >> at & 1 == 1, at as u8);
            self.latch(initial, Held::WordBit(cell, at), Next::WordBit(cell, at))
        })
    }

    /// A state of a block, Stage or subroutine.
    pub(super) fn own(&mut self, held: Held) -> Literal {
        if let Some(literal) = self.own.get(&held) {
            return *literal;
        }
        let literal = match self.first_own(held) {
            Some(initial) => self.latch(initial, held, Next::Own(held)),
            None => Literal::FALSE,
        };
        self.own.insert(held, literal);
        literal
    }

    /// The state before the first scan; `None` if it is always OFF.
    fn first_own(&self, held: Held) -> Option<bool> {
        match held {
            Held::PassDue(block) => self.written.halted.contains(&block).then_some(false),
            Held::StagePassDue(stage) => self.written.left.contains(&stage).then_some(false),
            Held::FirstTurn(block) => Some(self.start.first_turns.contains(&block)),
            Held::Recurrent(task) => self.written.recurrent.contains(&task).then_some(false),
            Held::Executed(_) | Held::StageExecuted(_) | Held::Caller(..) => Some(false),
            Held::Bit(_)
            | Held::WordBit(..)
            | Held::Interval(..)
            | Held::Phase(..)
            | Held::Age(..)
            | Held::StageAge(..)
            | Held::FirstScan
            | Held::LastScan
            | Held::Stopped
            | Held::Clock(..) => unreachable!("it is no state of a block"),
        }
    }

    /// Changes a state while a condition is ON.
    pub(super) fn put_own_if(&mut self, condition: Literal, held: Held, value: Literal) {
        let condition = self.graph.and(self.guard, condition);
        let value = match condition.as_constant() {
            Some(true) => value,
            Some(false) => return,
            None => {
                let before = self.own(held);
                self.graph.mux(condition, value, before)
            }
        };
        self.own.insert(held, value);
    }

    /// A state, which goes OFF while the guard is ON: the engine takes it.
    pub(super) fn take_own(&mut self, held: Held) -> Literal {
        let value = self.own(held);
        self.put_own_if(Literal::TRUE, held, Literal::FALSE);
        value
    }

    /// A number of a block, from 0 to `high`; 0 before the first scan.
    pub(super) fn own_number(&mut self, number: OwnNumber, high: i128) -> Number {
        if let Some(value) = self.own_numbers.get(&number) {
            return value.clone();
        }
        let value = Number::made(0, high, |at| {
            let at = at as u8;
            self.latch(false, number.held(at), Next::OwnBit(number, at))
        });
        self.own_numbers.insert(number, value.clone());
        value
    }

    /// Changes a number of a block while the guard is ON.
    pub(super) fn put_own_number(&mut self, number: OwnNumber, value: &Number, high: i128) {
        let before = self.own_number(number, high);
        let chosen = Number::mux(&mut self.graph, self.guard, value, &before).within(0, high);
        self.own_numbers.insert(number, chosen);
    }

    /// The encoding, and the private cells that were wrongly taken for passing values.
    pub(super) fn finish(mut self) -> (Encoding, FxHashSet<Cell>) {
        self.guard = Literal::TRUE;
        self.execution = 0;
        let judged: Vec<BitCell> = self.model.judged.clone();
        let judged: Vec<Literal> = judged.iter().map(|bit| self.bit(bit.0)).collect();
        self.end_ages();
        self.end_last_scan();
        let mut latches = Vec::new();
        // The next value of a latch may be that of a cell whose latch is made here.
        while latches.len() < self.latches.len() {
            let made = self.latches[latches.len()];
            let next = self.next(made.next);
            let OwnedLatch { literal, initial, holds, .. } = made;
            latches.push(Latch { literal, next, initial: Some(initial), holds });
        }
        let is_passing = |cell: &Cell| self.passing.contains_key(cell);
        let bits = (0..).map(BitCell).zip(&self.bits);
        let bits = bits.filter_map(|(cell, value)| value.map(|value| (cell, value)));
        let mut words: Vec<(WordCell, Vec<Literal>)> = (self.words.iter())
            .map(|(cell, number)| (WordCell(*cell), number.bits().to_vec()))
            .filter(|(cell, _)| !is_passing(&Cell::Word(*cell)))
            .collect();
        words.sort_unstable_by_key(|(cell, _)| *cell);
        let encoding = Encoding {
            bits: bits.filter(|(cell, _)| !is_passing(&Cell::Bit(*cell))).collect(),
            words,
            gates: Gates {
                latches,
                inputs: self.inputs,
                constraints: self.constraints,
                judged,
                free: self.free,
                cuts: self.cuts,
                graph: self.graph,
            },
        };
        (encoding, self.lasting)
    }

    fn next(&mut self, next: Next) -> Literal {
        match next {
            // Outside of every execution, the read finds a passing value that lasts.
            Next::Bit(BitCell(bit)) => self.bit(bit),
            Next::WordBit(WordCell(word), at) => self.word(word).bit(at.into()),
            Next::Own(held) => self.own(held),
            Next::OwnBit(number, at) => {
                let value = self.own_numbers.get(&number).expect("its latches were made");
                value.bit(at.into())
            }
            Next::Fixed(literal) => literal,
        }
    }
}
