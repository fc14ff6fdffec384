//! MATH: evaluates its formula while its leg is ON, and stores the result in its target.
//!
//! Behaviour: `docs/semantics.md`, section 8. `rows` and `columns` evaluate formulas.

use super::array_places::{ArrayTarget, StoredResult};
use super::columns::{ActiveFormulas, Columns, LANES, Lanes};
use super::integer;
use super::memory::MemoryView;
use super::mishap::{Mishap, Mishaps};
use super::places::WordTarget;
use super::power::LegPowers;
use super::reach::Reach;
use super::role::{BitOwn, BitWritten, FieldRole, TouchedCells, WordWritten};
use super::rows::Evaluator;
use super::steps::{Accumulator, FormulaStep};
use crate::isa::Real;

/// A MATH: the formula that it evaluates while its leg is ON, and its target.
#[derive(Clone, Copy, Debug)]
pub struct Math {
    /// Its leg.
    pub leg: LegPowers,
    /// Its first step.
    pub first: u32,
    /// The number of its steps.
    pub count: u32,
    /// Its number in the program, for the log.
    pub number: u32,
    /// Its target.
    pub put: MathTarget,
    /// The accumulator that holds its result.
    pub result: Accumulator,
    /// The mishaps that it reports.
    pub reports: MathReports,
}

/// The mishaps whose status bits a MATH turns ON, and that it reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MathReports {
    /// All: a MATH of the ladder.
    All,
    /// Index errors alone: a different instruction with an element of an array.
    IndexError,
    /// None: a contact that computes.
    Nothing,
}

/// The target of a MATH.
#[derive(Clone, Copy, Debug)]
pub enum MathTarget {
    /// A word of integers: first limited to the range of its memory, then to its tag's limits.
    Word {
        /// The word, with its tag's limits.
        to: WordTarget,
        /// The lower end of the range.
        low: i32,
        /// The upper end of the range.
        high: i32,
    },
    /// A word that holds a real, with the limits of its cell.
    Real(WordTarget),
    /// A bit.
    Bit(BitWritten),
    /// An element of an array.
    At(ArrayTarget),
    /// The private word that holds the index of the next MATH's target.
    Index(WordWritten),
}

/// The working memory of the formulas of a program.
#[derive(Debug)]
pub(super) struct Calculator {
    slots: Box<[u64]>,
    lanes: Box<Lanes>,
    /// The cell of the first status bit, ST0.
    status: u32,
}

/// MATHs, and the steps of all formulas.
#[derive(Clone, Copy)]
pub(super) struct Maths<'p> {
    pub maths: &'p [Math],
    pub steps: &'p [FormulaStep],
}

/// The values of both accumulators after the last step of a formula.
#[derive(Clone, Copy)]
struct AccumulatorValues {
    integer: i64,
    real: f64,
}

impl Calculator {
    /// Makes a calculator with enough slots for every formula.
    pub fn new(slots: u32, status: u32) -> Calculator {
        Calculator { slots: vec![0; slots as usize].into(), lanes: Lanes::new(), status }
    }

    /// Executes MATHs one after the other; `report` receives the number of each MATH that had a
    /// mishap.
    pub fn run<R: Reach>(
        &mut self,
        Maths { maths, steps }: Maths,
        view: MemoryView<R>,
        mut report: impl FnMut(u32, Mishaps),
    ) {
        let mut run = Evaluator::new(view, &mut self.slots);
        for math in maths {
            if run.view.leg(&math.leg) == 0 {
                continue;
            }
            let steps = &steps[math.first as usize..][..math.count as usize];
            let mut noted = Mishaps::default();
            run.evaluate(steps, &mut noted);
            let values = AccumulatorValues { integer: run.integer, real: run.real };
            math.store(&mut run.view, values, &mut noted);
            if !noted.is_empty() {
                math.report_mishaps(&mut run.view, self.status, noted, &mut report);
            }
        }
    }

    /// Executes MATHs whose formulas differ only in their cells. No MATH reads a cell that an
    /// earlier MATH writes.
    pub fn run_columns<R: Reach>(
        &mut self,
        Maths { maths, steps }: Maths,
        mut view: MemoryView<R>,
        mut report: impl FnMut(u32, Mishaps),
    ) {
        let (height, lanes) = (maths.len(), &mut *self.lanes);
        let columns = &steps[maths[0].first as usize..][..maths[0].count as usize * height];
        for (chunk, maths) in maths.chunks(LANES).enumerate() {
            let active = ActiveFormulas::of(maths.iter().map(|math| view.leg(&math.leg)));
            if active.numbers().is_empty() {
                continue;
            }
            let (first, count) = (chunk * LANES, maths.len());
            lanes.evaluate(&Columns { steps: columns, height, first, count }, &active, &view);
            for (at, number) in active.numbers().iter().enumerate() {
                let math = &maths[usize::from(*number)];
                let mut noted = lanes.noted[at];
                let values =
                    AccumulatorValues { integer: lanes.integers[at], real: lanes.reals[at] };
                math.store(&mut view, values, &mut noted);
                if !noted.is_empty() {
                    math.report_mishaps(&mut view, self.status, noted, &mut report);
                }
            }
        }
    }
}

impl Math {
    /// Stores the result from its accumulator. Most results pass two tests, which are cheaper than
    /// a jump table.
    #[inline(always)]
    fn store<R: Reach>(
        &self,
        view: &mut MemoryView<R>,
        values: AccumulatorValues,
        noted: &mut Mishaps,
    ) {
        let AccumulatorValues { integer, real } = values;
        if let MathTarget::Word { to, low, high } = &self.put {
            let integer = match self.result {
                Accumulator::Integer => integer,
                // The cast saturates at the limits of 64 bits, which lie beyond the limits of every
                // word.
                Accumulator::Real => real as i64,
            };
            let limited = integer::within(integer, *low, *high, noted);
            view.put_word(to.word, limited.max(to.min).min(to.max));
            return;
        }
        let mut own = Mishaps::default();
        self.store_elsewhere(view, values, &mut own);
        noted.add(own);
    }

    /// Stores the result in a target that is not a word of integers.
    #[inline(never)]
    fn store_elsewhere<R: Reach>(
        &self,
        view: &mut MemoryView<R>,
        AccumulatorValues { integer, real }: AccumulatorValues,
        noted: &mut Mishaps,
    ) {
        let is_real = self.result == Accumulator::Real;
        match self.put {
            MathTarget::Word { .. } => unreachable!("`store` stores in words of integers"),
            MathTarget::Real(to) => {
                let nearest = Real::stored(if is_real { real } else { integer as f64 });
                if nearest.is_beyond {
                    noted.note(Mishap::Overflow);
                }
                view.put_word(to.word, nearest.real.cell().max(to.min).min(to.max));
            }
            MathTarget::Bit(bit) => {
                let is_on = if is_real { real != 0.0 } else { integer != 0 };
                view.put_bit(bit, u8::from(is_on));
            }
            MathTarget::At(at) => {
                let stored =
                    if is_real { StoredResult::Real(real) } else { StoredResult::Integer(integer) };
                at.put(view, stored, noted);
            }
            MathTarget::Index(word) => {
                let index = integer.clamp(i32::MIN.into(), i32::MAX.into()) as i32;
                view.put_word(word, index);
            }
        }
    }

    /// Turns the status bits of its mishaps ON, and reports them. `status`: the cell of the first
    /// status bit. A separate function, because this is rare.
    #[cold]
    fn report_mishaps<R: Reach>(
        &self,
        view: &mut MemoryView<R>,
        status: u32,
        noted: Mishaps,
        report: &mut impl FnMut(u32, Mishaps),
    ) {
        let noted = match self.reports {
            MathReports::All => noted,
            MathReports::IndexError => noted.of_index(),
            MathReports::Nothing => return,
        };
        if noted.is_empty() {
            return;
        }
        for mishap in noted.each() {
            view.put_own(BitOwn(status + mishap.status()), 1);
        }
        report(self.number, noted);
    }
}

/// The cells of its leg, of its formula and of its target, and the status bits.
impl FieldRole for Math {
    fn touches(&self, t: &mut TouchedCells) {
        self.leg.touches(t);
        let reads = &t.formulas.reads[self.number as usize];
        t.bits_read.extend(&reads.bits);
        t.words_read.extend(&reads.words);
        t.bit_arrays_read.extend(&reads.bit_arrays);
        t.word_arrays_read.extend(&reads.word_arrays);
        match self.put {
            MathTarget::Word { to, .. } | MathTarget::Real(to) => to.touches(t),
            MathTarget::Bit(bit) => bit.touches(t),
            MathTarget::At(at) => at.touches(t),
            MathTarget::Index(word) => word.touches(t),
        }
        if self.reports != MathReports::Nothing {
            t.bits_written.extend(t.formulas.mishaps());
        }
    }
}
