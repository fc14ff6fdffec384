//! The formulas of MATHs: their steps, as in the engine's `rows`.
//!
//! Steps are executed in order, each under the condition that no jump has passed it. `operators`
//! has the arithmetic, `math` stores the result.

use super::encoder::Encoder;
use super::evaluation::{Evaluation, Integer};
use super::number::Number;
use super::value::RealValue;
use crate::aig::Literal;
use rungd_engine::Mishap;
use rungd_engine::ops::{
    CellRange, CodeParts, FormulaStep, OneOperator, OtherStep, PairOperator, StepLoad, StepOperand,
    StepSave,
};

impl Encoder<'_> {
    /// Evaluates a formula.
    pub(super) fn evaluate(&mut self, steps: &[FormulaStep]) -> Evaluation {
        let mut run = Evaluation::new();
        let mut arrivals = vec![Literal::FALSE; steps.len() + 1];
        for (at, step) in steps.iter().enumerate() {
            run.path = self.graph.or(run.path, arrivals[at]);
            if run.path == Literal::FALSE {
                continue;
            }
            let jumps = match step.code.parts() {
                CodeParts::Two(operator, a, b) => self.two(&mut run, operator, [a, b], step),
                CodeParts::One(operator) => self.one(&mut run, operator),
                CodeParts::Load(load) => self.load(&mut run, load, step),
                CodeParts::Save(StepSave::Save) => self.save_integer(&mut run, step.to),
                CodeParts::Save(StepSave::SaveReal) => self.save_real(&mut run, step.to),
                CodeParts::Other(other) => match self.other(&mut run, other, step) {
                    Some(jumps) => jumps,
                    None => {
                        run.lose("a condition of reals");
                        return run;
                    }
                },
            };
            let leaves = self.graph.and(run.path, jumps);
            if leaves != Literal::FALSE {
                let to = (step.to as usize).min(steps.len());
                debug_assert!(to > at, "formulas jump forwards");
                arrivals[to] = self.graph.or(arrivals[to], leaves);
                run.path = self.graph.and(run.path, !jumps);
            }
        }
        run
    }

    fn save_integer(&mut self, run: &mut Evaluation, slot: u32) -> Literal {
        let value = match run.integers.get(&slot) {
            Some(before) => self.merged(run.path, run.integer.clone(), before),
            None => run.integer.clone(),
        };
        run.integers.insert(slot, value);
        Literal::FALSE
    }

    fn save_real(&mut self, run: &mut Evaluation, slot: u32) -> Literal {
        let value = match run.reals.get(&slot) {
            Some(before) => self.merged_real(run.path, run.real.clone(), before),
            None => run.real.clone(),
        };
        run.reals.insert(slot, value);
        Literal::FALSE
    }

    fn integer_operand(&mut self, run: &Evaluation, place: StepOperand, at: u32) -> Integer {
        match place {
            StepOperand::Accumulator => run.integer.clone(),
            StepOperand::Slot => run.integers.get(&at).cloned().flatten(),
            StepOperand::Word => Some(self.word(at)),
            StepOperand::Whole => unreachable!("an integer is read as it is"),
        }
    }

    fn real_operand(&mut self, run: &Evaluation, place: StepOperand, at: u32) -> RealValue {
        match place {
            StepOperand::Accumulator => run.real.clone(),
            StepOperand::Slot => run.reals.get(&at).cloned().unwrap_or(RealValue::Unknown),
            StepOperand::Word => RealValue::of_cell(self.word(at)),
            StepOperand::Whole => RealValue::of_whole(self.word(at)),
        }
    }

    /// An operator with two operands.
    fn two(
        &mut self,
        run: &mut Evaluation,
        operator: PairOperator,
        [a, b]: [StepOperand; 2],
        step: &FormulaStep,
    ) -> Literal {
        let saves = a != StepOperand::Accumulator && b != StepOperand::Accumulator;
        if self.is_of_integers(operator) {
            let (a, b) =
                (self.integer_operand(run, a, step.a), self.integer_operand(run, b, step.b));
            if saves {
                self.save_integer(run, step.to);
            }
            let result = self.integer_operator(run, operator, [a, b]);
            self.set_integer(run, result);
        } else {
            let (a, b) = (self.real_operand(run, a, step.a), self.real_operand(run, b, step.b));
            if saves {
                self.save_real(run, step.to);
            }
            self.real_operator(run, operator, [&a, &b]);
        }
        Literal::FALSE
    }

    fn one(&mut self, run: &mut Evaluation, operator: OneOperator) -> Literal {
        self.one_operator(run, operator);
        Literal::FALSE
    }

    fn load(&mut self, run: &mut Evaluation, load: StepLoad, step: &FormulaStep) -> Literal {
        let integer = match load {
            StepLoad::LoadWord => Some(self.word(step.a)),
            StepLoad::LoadSlot => run.integers.get(&step.a).cloned().flatten(),
            StepLoad::LoadBit => Some(Number::of_bit(self.bit(step.a))),
            StepLoad::LoadReal => return self.load_real(run, StepOperand::Word, step),
            StepLoad::LoadWhole => return self.load_real(run, StepOperand::Whole, step),
            StepLoad::LoadRealSlot => return self.load_real(run, StepOperand::Slot, step),
        };
        self.save_integer(run, step.to);
        self.set_integer(run, integer);
        Literal::FALSE
    }

    fn load_real(
        &mut self,
        run: &mut Evaluation,
        place: StepOperand,
        step: &FormulaStep,
    ) -> Literal {
        let real = self.real_operand(run, place, step.a);
        self.save_real(run, step.to);
        self.set_real(run, real);
        Literal::FALSE
    }

    /// A step that is no operator: the condition under which it jumps, `None` if that is not known.
    fn other(
        &mut self,
        run: &mut Evaluation,
        other: OtherStep,
        step: &FormulaStep,
    ) -> Option<Literal> {
        let array = CellRange { first: step.a, count: step.b };
        match other {
            OtherStep::Jump => return Some(Literal::TRUE),
            OtherStep::JumpIfZero => return Some(run.integer.clone()?.is_zero(&mut self.graph)),
            OtherStep::JumpIfTrue => return Some(!run.integer.clone()?.is_zero(&mut self.graph)),
            OtherStep::LoadMishap => {
                self.save_integer(run, step.to);
                let is_on = self.bit(step.a);
                let is_on = self.graph.or(is_on, run.noted[step.b as usize]);
                let is_clear = run.unclear[step.b as usize] == Literal::FALSE;
                let is_known = is_clear || is_on == Literal::TRUE;
                self.set_integer(run, is_known.then(|| Number::of_bit(is_on)));
            }
            OtherStep::CheckIndex => {
                let index = self.word(step.a);
                let is_inside = self.is_inside(&index, step.b);
                self.note(run, Mishap::IndexError, !is_inside);
            }
            OtherStep::LoadWordBit => {
                self.save_integer(run, step.to);
                let content = self.word(step.a);
                let is_on = self.has_bit(&content, step.b.cast_signed());
                self.set_integer(run, Some(Number::of_bit(is_on)));
            }
            OtherStep::HasBit => {
                let found = run.integer.clone().map(|content| {
                    let is_on = self.has_bit(&content.low_32(), step.b.cast_signed());
                    Number::of_bit(is_on)
                });
                self.set_integer(run, found);
            }
            OtherStep::BitOf => {
                let index = self.index(run, step);
                let bit = index.map(|index| Number::of_bit(self.selected_bit(array, &index)));
                self.set_integer(run, bit);
            }
            OtherStep::WordOf => {
                let index = self.index(run, step);
                let word = index.map(|index| self.selected_word(array, &index));
                self.set_integer(run, word);
            }
            OtherStep::RealOf => {
                let index = self.index(run, step);
                let real = index.map(|index| self.selected_word(array, &index));
                self.set_real(run, real.map_or(RealValue::Unknown, RealValue::of_cell));
            }
        }
        Some(Literal::FALSE)
    }

    /// The index of an element; notes whether it is outside.
    fn index(&mut self, run: &mut Evaluation, step: &FormulaStep) -> Integer {
        let Some(index) = run.integer.clone() else {
            self.lose_result(run, "an index that reals decide", &[Mishap::IndexError]);
            return None;
        };
        let is_inside = self.is_inside(&index, step.b);
        self.note(run, Mishap::IndexError, !is_inside);
        Some(index)
    }
}
