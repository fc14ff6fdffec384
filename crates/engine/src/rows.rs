//! Executes the steps of formulas, one formula after the other.
//!
//! `steps` has the codes; `columns` executes many formulas at once.

use super::memory::MemoryView;
use super::mishap::{Mishap, Mishaps};
use super::reach::Reach;
use super::role::{BitRead, WordRead};
use super::steps::{FormulaStep, StepCode, StepNumber, cells, for_each_code, unless_accumulator};
use super::{integer, real};

/// A type of number that has an accumulator.
trait Accumulated: StepNumber {
    fn accumulator<'e, R: Reach>(run: &'e mut Evaluator<'_, '_, R>) -> &'e mut Self;
}

impl Accumulated for i64 {
    #[inline(always)]
    fn accumulator<'e, R: Reach>(run: &'e mut Evaluator<'_, '_, R>) -> &'e mut i64 {
        &mut run.integer
    }
}

impl Accumulated for f64 {
    #[inline(always)]
    fn accumulator<'e, R: Reach>(run: &'e mut Evaluator<'_, '_, R>) -> &'e mut f64 {
        &mut run.real
    }
}

/// Reads an operand.
macro_rules! operand {
    (Accumulator $run:ident $at:expr) => {
        *Accumulated::accumulator($run)
    };
    (Slot $run:ident $at:expr) => {
        StepNumber::of_slot($run.slots[$at as usize])
    };
    (Word $run:ident $at:expr) => {
        StepNumber::of_word($run.view.word(WordRead($at)))
    };
    (Whole $run:ident $at:expr) => {
        f64::from($run.view.word(WordRead($at)))
    };
    (Bit $run:ident $at:expr) => {
        i64::from($run.view.bit(BitRead($at)))
    };
}

macro_rules! rows {
    (
        two { $($two:ident = $number:ident $two_of:path, $($code:ident($a:ident $b:ident))*;)* }
        one { $($one:ident = $one_of:expr;)* }
        load { $($load:ident = $loaded:ident $from:ident;)* }
        save { $($save:ident = $saved:ident;)* }
        other { $($(#[$doc:meta])* $other:ident = $execute:ident;)* }
    ) => {
        impl<R: Reach> Evaluator<'_, '_, R> {
            /// Executes a step. An operator receives its own set of mishaps: no function receives
            /// the address of `noted`, so that `noted` stays in a register.
            #[inline(always)]
            fn step(&mut self, step: FormulaStep, noted: &mut Mishaps) {
                let FormulaStep { code, to, a, b } = step;
                match code {
                    $($(StepCode::$code => {
                        let (a, b) = (operand!($a self a), operand!($b self b));
                        unless_accumulator!($a $b, self.save::<$number>(to));
                        let mut own = Mishaps::default();
                        *Accumulated::accumulator(self) = $two_of(a, b, &mut own);
                        noted.add(own);
                    })*)*
                    $(StepCode::$one => {
                        let a = *Accumulated::accumulator(self);
                        let mut own = Mishaps::default();
                        *Accumulated::accumulator(self) = $one_of(a, &mut own);
                        noted.add(own);
                    })*
                    $(StepCode::$load => {
                        let a: $loaded = operand!($from self a);
                        self.save::<$loaded>(to);
                        *Accumulated::accumulator(self) = a;
                    })*
                    $(StepCode::$save => self.save::<$saved>(to),)*
                    $(StepCode::$other => self.$execute(step, noted),)*
                }
            }
        }
    };
}

for_each_code!(rows);

/// The evaluation of formulas.
pub(super) struct Evaluator<'a, 'v, R: Reach> {
    pub view: MemoryView<'v, R>,
    pub integer: i64,
    pub real: f64,
    slots: &'a mut [u64],
    /// The next step of the formula.
    at: usize,
}

impl<'a, 'v, R: Reach> Evaluator<'a, 'v, R> {
    #[inline(always)]
    pub fn new(view: MemoryView<'v, R>, slots: &'a mut [u64]) -> Self {
        Evaluator { view, integer: 0, real: 0.0, slots, at: 0 }
    }

    /// Executes all steps of a formula.
    #[inline(always)]
    pub fn evaluate(&mut self, steps: &[FormulaStep], noted: &mut Mishaps) {
        self.at = 0;
        while let Some(step) = steps.get(self.at) {
            self.at += 1;
            self.step(*step, noted);
        }
    }

    /// Puts an accumulator in a slot.
    #[inline(always)]
    fn save<N: Accumulated>(&mut self, slot: u32) {
        let number = *N::accumulator(self);
        self.slots[slot as usize] = number.slot();
    }

    #[inline(always)]
    fn load_mishap(&mut self, step: FormulaStep, noted: &mut Mishaps) {
        self.save::<i64>(step.to);
        let is_on = self.view.bit(BitRead(step.a)) != 0;
        self.integer = i64::from(is_on || noted.has_number(step.b));
    }

    #[inline(always)]
    fn load_word_bit(&mut self, step: FormulaStep, _: &mut Mishaps) {
        self.save::<i64>(step.to);
        let content = self.view.word(WordRead(step.a));
        self.integer = i64::from(content & step.b.cast_signed() != 0);
    }

    #[inline(always)]
    fn has_bit(&mut self, step: FormulaStep, _: &mut Mishaps) {
        self.integer = i64::from(self.integer as i32 & step.b.cast_signed() != 0);
    }

    #[inline(always)]
    fn check_index(&mut self, step: FormulaStep, noted: &mut Mishaps) {
        let index = self.view.word(WordRead(step.a));
        if !u32::try_from(index).is_ok_and(|index| index < step.b) {
            noted.note(Mishap::IndexError);
        }
    }

    #[inline(always)]
    fn jump(&mut self, step: FormulaStep, _: &mut Mishaps) {
        self.at = step.to as usize;
    }

    #[inline(always)]
    fn jump_if_zero(&mut self, step: FormulaStep, noted: &mut Mishaps) {
        if self.integer == 0 {
            self.jump(step, noted);
        }
    }

    #[inline(always)]
    fn jump_if_true(&mut self, step: FormulaStep, noted: &mut Mishaps) {
        if self.integer != 0 {
            self.jump(step, noted);
        }
    }

    /// The cell of the element that the integer selects.
    #[inline(always)]
    fn element(&self, step: FormulaStep, noted: &mut Mishaps) -> Option<u32> {
        let index = i32::try_from(self.integer).ok();
        let cell = index.and_then(|index| cells(step).cell(index));
        if cell.is_none() {
            noted.note(Mishap::IndexError);
        }
        cell
    }

    #[inline(always)]
    fn bit_of(&mut self, step: FormulaStep, noted: &mut Mishaps) {
        let cell = self.element(step, noted);
        self.integer = cell.map_or(0, |cell| self.view.bit(BitRead(cell)).into());
    }

    #[inline(always)]
    fn integer_of(&mut self, step: FormulaStep, noted: &mut Mishaps) {
        let cell = self.element(step, noted);
        self.integer = cell.map_or(0, |cell| self.view.word(WordRead(cell)).into());
    }

    #[inline(always)]
    fn real_of(&mut self, step: FormulaStep, noted: &mut Mishaps) {
        let cell = self.element(step, noted);
        self.real = cell.map_or(0.0, |cell| StepNumber::of_word(self.view.word(WordRead(cell))));
    }
}
