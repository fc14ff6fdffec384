//! Latches, and the states of blocks, Stages and subroutines.
//!
//! A state is a latch from its first read or conditional write on.

use super::encoder::Encoder;
use super::held::{Next, OwnNumber, OwnedLatch};
use super::number::Number;
use crate::aig::Literal;
use crate::gates::Held;

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

    /// A state of a block, Stage or subroutine.
    pub(super) fn own(&mut self, held: Held) -> Literal {
        if let Some(literal) = self.own.get(&held) {
            return *literal;
        }
        let mut literal = match self.first_own(held) {
            Some(initial) => self.latch(initial, held, Next::Own(held)),
            None => Literal::FALSE,
        };
        if let Held::FirstTurn(program) = held
            && let Some(is_due) = self.first_turns.get(&program).copied()
        {
            let first = self.beginning();
            literal = self.graph.mux(first, is_due, literal);
        }
        self.own.insert(held, literal);
        literal
    }

    /// The state before the first scan; `None` if it is always OFF.
    fn first_own(&self, held: Held) -> Option<bool> {
        let start = self.start;
        match held {
            Held::PassDue(block) => {
                let is_due = start.block(block).pass_due;
                (is_due || self.written.halted.contains(&block)).then_some(is_due)
            }
            Held::StagePassDue(stage) => {
                let is_due = start.stage(stage).pass_due;
                (is_due || self.written.left.contains(&stage)).then_some(is_due)
            }
            Held::FirstTurn(block) => Some(start.first_turns.contains(&block)),
            Held::Recurrent(task) => {
                let is_recurrent = start.block(task).recurrent;
                let may_be = is_recurrent || self.written.recurrent.contains_key(&task);
                may_be.then_some(is_recurrent)
            }
            Held::Executed(block) => Some(start.block(block).executed),
            Held::StageExecuted(stage) => Some(start.stage(stage).executed),
            Held::Caller(subroutine, element) => Some(start.is_caller(subroutine, element)),
            Held::Bit(_)
            | Held::WordBit(..)
            | Held::TimerScans(..)
            | Held::Interval(..)
            | Held::Phase(..)
            | Held::Age(..)
            | Held::StageAge(..)
            | Held::FirstScan
            | Held::LastScan
            | Held::Stopped
            | Held::Beginning
            | Held::ImageBit(_)
            | Held::ImageWordBit(..)
            | Held::ImageIsFinal
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

    /// A number of a block, from 0 to `high`.
    pub(super) fn own_number(&mut self, number: OwnNumber, high: i128) -> Number {
        if let Some(value) = self.own_numbers.get(&number) {
            return value.clone();
        }
        let initial = i128::from(self.start.number(number)).min(high);
        let value = Number::made(0, high, |at| {
            let (is_on, at) = (initial >> at & 1 == 1, at as u8);
            self.latch(is_on, number.held(at), Next::OwnBit(number, at))
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

    /// A latch of the whole scan; OFF in the next one, unless its next value is set.
    pub(super) fn scan_latch(&mut self, initial: bool, holds: Held) -> Literal {
        if let Some(latch) = self.own.get(&holds) {
            return *latch;
        }
        let latch = self.fixed_latch(initial, holds);
        self.own.insert(holds, latch);
        latch
    }
}
