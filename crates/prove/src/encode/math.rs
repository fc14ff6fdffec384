//! MATH: stores the result of its formula, as in the engine's `math` and `array_places`.

use super::encoder::Encoder;
use super::evaluation::{Evaluation, Integer};
use super::number::Number;
use super::value::RealValue;
use super::written::WordRange;
use crate::aig::Literal;
use rungd_engine::isa::Real;
use rungd_engine::ops::{
    Accumulator, ArrayLimits, ArrayTarget, ElementType, FormulaStep, Math, MathReports, MathTarget,
    WordTarget,
};
use rungd_engine::{BitCell, Cell, Mishap, WordBitCell, WordCell};

/// What a formula without any name for its cut is called.
const REALS: &str = "MATH with reals";

impl Encoder<'_> {
    /// A MATH.
    pub(super) fn math(&mut self, math: &Math, steps: &[FormulaStep]) {
        let leg = self.leg(&math.leg);
        self.under(leg, |scan| {
            if scan.guard == Literal::FALSE {
                return;
            }
            let mut run = scan.evaluate(steps);
            scan.store(math, &mut run, leg == Literal::TRUE);
            scan.report(math.reports, &run);
        });
    }

    /// A MATH of a pass or an ENTASK, by its index.
    pub(super) fn picked(&mut self, pick: u32) {
        let tables = &self.code.tables;
        let math = tables.picks[pick as usize];
        let steps = &tables.steps[math.first as usize..][..math.count as usize];
        self.math(&math, steps);
    }

    /// Turns the status bits of mishaps ON.
    fn report(&mut self, reports: MathReports, run: &Evaluation) {
        for mishap in Mishap::ALL {
            let is_reported = match reports {
                MathReports::All => true,
                MathReports::IndexError => mishap == Mishap::IndexError,
                MathReports::Nothing => false,
            };
            let (noted, unclear) = (run.noted[mishap as usize], run.unclear[mishap as usize]);
            if !is_reported || noted == Literal::FALSE && unclear == Literal::FALSE {
                continue;
            }
            let status = self.status() + mishap.status();
            let mut happens = noted;
            if unclear != Literal::FALSE {
                let any = self.cut(Cell::Bit(BitCell(status)), REALS, WordRange::BIT).bit(0);
                let any = self.graph.and(unclear, any);
                happens = self.graph.or(happens, any);
            }
            self.put_bit_if(happens, status, Literal::TRUE);
        }
    }

    /// The result as a bit.
    fn truth(&mut self, math: &Math, run: &Evaluation) -> Option<Literal> {
        match math.result {
            Accumulator::Integer => Some(!run.integer.as_ref()?.is_zero(&mut self.graph)),
            Accumulator::Real => run.real.truth(&mut self.graph),
        }
    }

    /// The result as an integer, truncated towards zero.
    fn whole(&self, math: &Math, run: &Evaluation) -> Integer {
        match math.result {
            Accumulator::Integer => run.integer.clone(),
            Accumulator::Real => run.real.whole(),
        }
    }

    /// The result as the cell of a real.
    fn real_cell(&mut self, math: &Math, run: &mut Evaluation) -> Integer {
        let real = match math.result {
            Accumulator::Integer => {
                run.integer.clone().map_or(RealValue::Unknown, RealValue::of_whole)
            }
            Accumulator::Real => run.real.clone(),
        };
        let cell = real.cell();
        if let RealValue::Known(value) = real {
            let is_beyond = Literal::constant(Real::stored(value).is_beyond);
            self.note(run, Mishap::Overflow, is_beyond);
        } else if cell.is_none() {
            self.lose_result(run, "a conversion to or from a real", &[Mishap::Overflow]);
        }
        cell
    }

    /// Stores the result. `always`: in every execution of the MATH's element.
    fn store(&mut self, math: &Math, run: &mut Evaluation, always: bool) {
        let what = run.what.unwrap_or(REALS);
        run.restart();
        match math.put {
            MathTarget::Word { to, low, high } => {
                let value = self.whole(math, run);
                let limited =
                    value.map(|value| self.limited_to(run, &value, WordRange { low, high }));
                self.store_word(run, &to, limited, always);
            }
            MathTarget::Real(to) => {
                let cell = self.real_cell(math, run);
                self.store_word(run, &to, cell, always);
            }
            MathTarget::Bit(bit) => {
                let truth = self.truth(math, run);
                let place = Cell::Bit(BitCell(bit.0));
                let truth = truth.unwrap_or_else(|| self.cut(place, what, WordRange::BIT).bit(0));
                if always {
                    self.pass_bit(bit.0, truth);
                } else {
                    self.put_bit(bit.0, truth);
                }
            }
            MathTarget::At(at) => self.store_at(math, run, &at),
            MathTarget::Index(word) => {
                let to = WordTarget { word, min: i32::MIN, max: i32::MAX };
                let value = run.integer.clone();
                self.store_word(run, &to, value, always);
            }
        }
    }

    fn store_word(&mut self, run: &mut Evaluation, to: &WordTarget, value: Integer, always: bool) {
        let value = value.unwrap_or_else(|| {
            self.lose_result(run, REALS, &[Mishap::Overflow]);
            let what = run.what.unwrap_or(REALS);
            self.cut(Cell::Word(WordCell(to.word.0)), what, WordRange::of(to))
        });
        let limited = value.clamp(&mut self.graph, to.min, to.max);
        if always {
            self.pass_word(to.word.0, limited);
        } else {
            self.put_word(to.word.0, limited);
        }
    }

    /// A result limited to the range of its target.
    fn limited_to(&mut self, run: &mut Evaluation, value: &Number, range: WordRange) -> Number {
        let outside = value.is_outside(&mut self.graph, range.low, range.high);
        self.note(run, Mishap::Overflow, outside);
        value.clamp(&mut self.graph, range.low, range.high)
    }

    /// Stores the result in an element of an array.
    fn store_at(&mut self, math: &Math, run: &mut Evaluation, at: &ArrayTarget) {
        let index = self.word(at.index);
        let count = u32::from(at.count);
        let is_inside = self.is_inside(&index, count);
        self.note(run, Mishap::IndexError, !is_inside);
        // Outside, nothing else is noted.
        let path = run.narrow(is_inside);
        match at.kind {
            ElementType::Bits | ElementType::WordBits => self.store_bit_at(math, run, at),
            ElementType::Unsigned => {
                let value = self.whole(math, run);
                let value = value
                    .map(|value| self.limited_to(run, &value, WordRange { low: 0, high: 65_535 }));
                self.store_word_at(run, at, value);
            }
            ElementType::Integers => {
                let value = self.whole(math, run);
                let value = value.map(|value| self.limited_to(run, &value, WordRange::ALL));
                self.store_word_at(run, at, value);
            }
            ElementType::Reals => {
                let cell = self.real_cell(math, run);
                self.store_word_at(run, at, cell);
            }
        }
        run.widen(path);
    }

    fn store_bit_at(&mut self, math: &Math, run: &mut Evaluation, at: &ArrayTarget) {
        let index = self.word(at.index);
        let word_bit = |element: u32| WordBitCell {
            word: WordCell(at.first + element),
            mask: at.limits.cast_signed(),
        };
        let truth = self.truth(math, run).unwrap_or_else(|| {
            let of_words = at.kind == ElementType::WordBits;
            let bit = Cell::Bit(BitCell(at.first));
            let first = if of_words { Cell::WordBit(word_bit(0)) } else { bit };
            let what = run.what.unwrap_or(REALS);
            self.cut_at(first, at.index, what, WordRange::BIT).bit(0)
        });
        for element in 0..u32::from(at.count) {
            let is_selected = index.equal(&mut self.graph, &Number::constant(element.into()));
            if at.kind == ElementType::WordBits {
                self.put_word_bit_if(is_selected, word_bit(element), truth);
            } else {
                self.put_bit_if(is_selected, at.first + element, truth);
            }
        }
    }

    fn store_word_at(&mut self, run: &mut Evaluation, at: &ArrayTarget, value: Integer) {
        let index = self.word(at.index);
        let limits = ArrayLimits { first: at.limits, each: at.each };
        let each = (0..u32::from(at.count)).map(|at| self.written.element_limits(limits, at));
        let each: Vec<WordRange> = each.collect();
        let value = value.unwrap_or_else(|| {
            self.lose_result(run, REALS, &[Mishap::Overflow]);
            let all = each.iter().fold(each[0], |all, one| all.with(one.low).with(one.high));
            let what = run.what.unwrap_or(REALS);
            self.cut_at(Cell::Word(WordCell(at.first)), at.index, what, all)
        });
        for (element, WordRange { low, high }) in (0..).zip(each) {
            let is_selected = index.equal(&mut self.graph, &Number::constant(element.into()));
            let limited = value.clamp(&mut self.graph, low, high);
            self.put_word_if(is_selected, at.first + element, limited);
        }
    }

    /// A cut for the element that a word selects.
    fn cut_at(&mut self, first: Cell, index: u32, what: &'static str, limits: WordRange) -> Number {
        let value = self.cut(first, what, limits);
        let cut = self.cuts.last_mut().expect("it was made");
        cut.index = Some(WordCell(index));
        value
    }
}
