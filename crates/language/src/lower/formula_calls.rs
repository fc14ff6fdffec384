//! The functions of an expression as steps.
//!
//! Called by `formula`, once for each call, with the arguments on the stack of operands. Matches
//! every function of `isa::function`.

use super::formula::{FormulaBuilder, OperandPlace, StepTypes, WaitingOperand, typed};
use crate::resolve::formula::NumberType;
pub use rungd_engine::isa::Function;
pub use rungd_engine::ops::{PairOperator, StepCode};

impl FormulaBuilder<'_, '_> {
    pub(super) fn call(&mut self, function: Function, count: usize, number_type: NumberType) {
        use PairOperator as O;
        if function == Function::If {
            return self.end_of_if(number_type);
        }
        let first = self.operands.len() - count;
        let kept = StepTypes::same(number_type);
        match function {
            Function::Abs => self.one(typed(number_type, StepCode::Abs, StepCode::RealAbs), kept),
            Function::Min => self.fold(typed(number_type, O::Min, O::RealMin), first, number_type),
            Function::Max => self.fold(typed(number_type, O::Max, O::RealMax), first, number_type),
            Function::Sum => self.fold(typed(number_type, O::Add, O::RealAdd), first, number_type),
            Function::Clamp => self.clamp(first, number_type),
            Function::Round => self.rounded(StepCode::Round, number_type),
            Function::Floor => self.rounded(StepCode::Floor, number_type),
            Function::Ceil => self.rounded(StepCode::Ceil, number_type),
            Function::Trunc => self.rounded(StepCode::Trunc, number_type),
            Function::Toreal => self.load_as(first, NumberType::Real),
            Function::Sqrt => self.real(StepCode::Sqrt),
            Function::Exp => self.real(StepCode::Exp),
            Function::Ln => self.real(StepCode::Ln),
            Function::Log10 => self.real(StepCode::Log10),
            Function::Sin => self.real(StepCode::Sin),
            Function::Cos => self.real(StepCode::Cos),
            Function::Tan => self.real(StepCode::Tan),
            Function::Asin => self.real(StepCode::Asin),
            Function::Acos => self.real(StepCode::Acos),
            Function::Atan => self.real(StepCode::Atan),
            Function::Atan2 => self.both(O::Atan2, NumberType::Real),
            Function::Scale => self.scale(first),
            Function::If => unreachable!("it returned above"),
        }
    }

    /// A function with a real argument and a real result.
    fn real(&mut self, code: StepCode) {
        self.one(code, StepTypes::same(NumberType::Real));
    }

    fn rounded(&mut self, code: StepCode, number_type: NumberType) {
        match number_type {
            NumberType::Integer => {}
            NumberType::Real => {
                self.one(code, StepTypes { operands: number_type, result: NumberType::Integer })
            }
        }
    }

    /// Moves an argument to the end of the stack, where operators find it.
    fn take(&mut self, at: usize) {
        let taken = WaitingOperand { place: OperandPlace::Integer(0), of: NumberType::Integer };
        let argument = std::mem::replace(&mut self.operands[at], taken);
        self.operands.push(argument);
    }

    /// Replaces the arguments, from `first` on, by the last operand.
    fn end_of_call(&mut self, first: usize) {
        self.operands.swap_remove(first);
        self.operands.truncate(first + 1);
    }

    /// An operation over all arguments, from left to right.
    fn fold(&mut self, operator: PairOperator, first: usize, number_type: NumberType) {
        let arguments = first..self.operands.len();
        // Each argument gets the type of the call, even a single argument.
        self.convert_all(first, number_type);
        self.take(first);
        for argument in arguments.skip(1) {
            self.take(argument);
            self.both(operator, number_type);
        }
        self.end_of_call(first);
    }

    /// `clamp`: `max(min(x, hi), lo)`, which is lo if lo > hi.
    fn clamp(&mut self, first: usize, number_type: NumberType) {
        self.take(first);
        self.take(first + 2);
        self.both(typed(number_type, PairOperator::Min, PairOperator::RealMin), number_type);
        self.take(first + 1);
        self.both(typed(number_type, PairOperator::Max, PairOperator::RealMax), number_type);
        self.end_of_call(first);
    }

    /// `scale`, made of the steps of operators.
    fn scale(&mut self, first: usize) {
        let number_type = NumberType::Real;
        self.convert_all(first, number_type);
        self.save_all();
        let [x, in_lo, in_hi, out_lo, out_hi] = [0, 1, 2, 3, 4].map(|at| self.operands[first + at]);
        self.operands.push(out_lo);
        self.operands.extend([x, in_lo]);
        self.both(PairOperator::RealSub, number_type);
        self.operands.extend([out_hi, out_lo]);
        self.both(PairOperator::RealSub, number_type);
        self.both(PairOperator::RealMul, number_type);
        self.operands.extend([in_hi, in_lo]);
        self.both(PairOperator::RealSub, number_type);
        self.both(PairOperator::RealDiv, number_type);
        self.both(PairOperator::RealAdd, number_type);
        self.end_of_call(first);
    }

    fn convert_all(&mut self, first: usize, number_type: NumberType) {
        for at in first..self.operands.len() {
            self.convert(at, number_type);
        }
    }
}
