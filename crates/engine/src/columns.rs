//! Executes formulas that differ only in their cells: each step for all formulas at once.
//!
//! A step is dispatched once for up to [`LANES`] formulas, and its loop has no branch that depends
//! on the formula. A lane is one formula with its own accumulators, slots and mishaps. `lower`
//! ensures that no formula reads a cell that an earlier formula writes.

use super::memory::MemoryView;
use super::mishap::Mishaps;
use super::reach::{CellAccess, Reach};
use super::steps::{
    COLUMN_SLOTS, FormulaStep, StepCode, StepNumber, for_each_code, unless_accumulator,
};
use super::{integer, real};

/// The greatest number of formulas that are executed at once.
pub(super) const LANES: usize = 64;

/// The numbers of the executed formulas within their columns. The legs of all others are OFF.
pub(super) struct ActiveFormulas {
    numbers: [u8; LANES],
    count: usize,
}

impl ActiveFormulas {
    /// The formulas whose leg is 1; the others have 0.
    #[inline(always)]
    pub fn of(legs: impl Iterator<Item = u8>) -> ActiveFormulas {
        let mut active = ActiveFormulas { numbers: [0; LANES], count: 0 };
        for (number, leg) in (0..LANES as u8).zip(legs) {
            active.numbers[active.count % LANES] = number;
            active.count += usize::from(leg);
        }
        active
    }

    pub fn numbers(&self) -> &[u8] {
        &self.numbers[..self.count]
    }
}

/// The steps of formulas: a column contains one step of all formulas.
pub(super) struct Columns<'s> {
    pub steps: &'s [FormulaStep],
    /// The number of formulas in a column.
    pub height: usize,
    /// The part of each column that is executed.
    pub first: usize,
    pub count: usize,
}

/// The state of the lanes.
#[derive(Debug)]
pub(super) struct Lanes {
    pub integers: [i64; LANES],
    pub reals: [f64; LANES],
    pub noted: [Mishaps; LANES],
    slots: [[u64; LANES]; COLUMN_SLOTS],
}

impl Lanes {
    pub fn new() -> Box<Lanes> {
        Box::new(Lanes {
            integers: [0; LANES],
            reals: [0.0; LANES],
            noted: [Mishaps::default(); LANES],
            slots: [[0; LANES]; COLUMN_SLOTS],
        })
    }

    /// Executes all steps. The active formulas have the first lanes, in order.
    pub fn evaluate<R: Reach>(
        &mut self,
        columns: &Columns,
        active: &ActiveFormulas,
        view: &MemoryView<R>,
    ) {
        self.noted = [Mishaps::default(); LANES];
        for column in columns.steps.chunks_exact(columns.height) {
            let steps = &column[columns.first..columns.first + columns.count];
            let (words, bits) = (view.words(), view.bits());
            self.step(Column::<R> { steps, active, words, bits });
        }
    }

    /// Puts accumulators in a slot, unless it is slot 0, which is never read.
    fn save<N: Lane>(&mut self, slot: u32) {
        if slot != 0 {
            let numbers = *N::lanes(self);
            self.slots[slot as usize] = numbers.map(StepNumber::slot);
        }
    }
}

/// One step of all formulas, and the memory that it reads.
struct Column<'a, R: Reach> {
    steps: &'a [FormulaStep],
    active: &'a ActiveFormulas,
    words: &'a R::Words,
    bits: &'a R::Bits,
}

/// A type of number for which lanes have an accumulator.
trait Lane: StepNumber {
    fn lanes(lanes: &Lanes) -> &[Self; LANES];
    fn lanes_mut(lanes: &mut Lanes) -> &mut [Self; LANES];
}

impl Lane for i64 {
    #[inline(always)]
    fn lanes(lanes: &Lanes) -> &[i64; LANES] {
        &lanes.integers
    }

    #[inline(always)]
    fn lanes_mut(lanes: &mut Lanes) -> &mut [i64; LANES] {
        &mut lanes.integers
    }
}

impl Lane for f64 {
    #[inline(always)]
    fn lanes(lanes: &Lanes) -> &[f64; LANES] {
        &lanes.reals
    }

    #[inline(always)]
    fn lanes_mut(lanes: &mut Lanes) -> &mut [f64; LANES] {
        &mut lanes.reals
    }
}

/// The sources of the operands of a lane's operator.
struct LaneOperands<'a, R: Reach> {
    lanes: &'a Lanes,
    at: usize,
    words: &'a R::Words,
    bits: &'a R::Bits,
}

/// Executes an operator for all active formulas. Not inlined, so that the loop's pointers can use
/// all registers.
#[inline(never)]
fn each<R: Reach, N: Lane>(
    column: Column<R>,
    lanes: &mut Lanes,
    operator: impl Fn(LaneOperands<R>, &FormulaStep, &mut Mishaps) -> N,
) {
    let Column { steps, active, words, bits } = column;
    let mut one = |at: usize, step: &FormulaStep| {
        let mut own = Mishaps::default();
        let result = operator(LaneOperands { lanes, at, words, bits }, step, &mut own);
        N::lanes_mut(lanes)[at] = result;
        if !own.is_empty() {
            lanes.noted[at].add(own);
        }
    };
    // Usually all legs are ON: then the number of a lane is the number of its formula.
    if active.count == steps.len() {
        (0..LANES).zip(steps).for_each(|(at, step)| one(at, step));
    } else {
        let numbers = &active.numbers[..active.count.min(LANES)];
        (0..LANES).zip(numbers).for_each(|(at, number)| one(at, &steps[usize::from(*number)]));
    }
}

/// Reads an operand.
macro_rules! operand {
    (Accumulator $from:ident $at:expr) => {
        Lane::lanes($from.lanes)[$from.at]
    };
    (Slot $from:ident $at:expr) => {
        StepNumber::of_slot($from.lanes.slots[$at as usize % COLUMN_SLOTS][$from.at])
    };
    (Word $from:ident $at:expr) => {
        StepNumber::of_word(*$from.words.cell($at))
    };
    (Whole $from:ident $at:expr) => {
        f64::from(*$from.words.cell($at))
    };
    (Bit $from:ident $at:expr) => {
        i64::from(*$from.bits.cell($at))
    };
}

macro_rules! columns {
    (
        two { $($two:ident = $number:ident $two_of:path, $($code:ident($a:ident $b:ident))*;)* }
        one { $($one:ident = $one_of:expr;)* }
        load { $($load:ident = $loaded:ident $from:ident;)* }
        save { $($save:ident = $saved:ident;)* }
        other { $($(#[$doc:meta])* $other:ident = $execute:ident;)* }
    ) => {
        impl Lanes {
            /// Executes a step.
            fn step<R: Reach>(&mut self, column: Column<R>) {
                let FormulaStep { code, to, .. } = column.steps[0];
                match code {
                    $($(StepCode::$code => {
                        unless_accumulator!($a $b, self.save::<$number>(to));
                        each(column, self, |from, step, own| {
                            let (a, b) = (operand!($a from step.a), operand!($b from step.b));
                            $two_of(a, b, own)
                        });
                    })*)*
                    $(StepCode::$one => each(column, self, |from, _, own| {
                        $one_of(operand!(Accumulator from 0), own)
                    }),)*
                    $(StepCode::$load => {
                        self.save::<$loaded>(to);
                        each::<R, $loaded>(column, self, |from, step, _| {
                            operand!($from from step.a)
                        });
                    })*
                    $(StepCode::$save => self.save::<$saved>(to),)*
                    $(StepCode::$other)|* => unreachable!("a step without a shape is in no column"),
                }
            }
        }
    };
}

for_each_code!(columns);
