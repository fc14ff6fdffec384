//! Turns the expression of a MATH into steps.
//!
//! Called by `math` and `elements`. Walks the parts, which are in postfix order, with a stack of
//! operands. A word or constant stays in place, and its operator reads it there. A result stays in
//! the accumulator of its type until a different result needs the accumulator; then it moves to the
//! slot of its place on the stack.

use super::assembler::Assembler;
use super::formula_marks::{Mark, marks};
use crate::resolve::array::Array;
use crate::resolve::formula::{Binary, Formula, NumberType, Part, Unary, type_of, type_of_array};
use rungd_engine::isa::status::st;
use rungd_engine::isa::{Bit, BitSpace, Real, Word};
pub use rungd_engine::ops::{
    Accumulator, ArrayTarget, Code, FormulaStep, LegPowers, Math, MathTarget, Operator,
    StepOperand, WordTarget, WordWritten,
};

impl Assembler<'_> {
    /// A MATH that evaluates a formula and stores the result in `put`.
    pub fn formula_into(&mut self, put: MathTarget, formula: &Formula, leg: LegPowers) -> Math {
        let mut builder = Builder {
            assembler: self,
            steps: Vec::new(),
            operands: Vec::new(),
            jumps: Vec::new(),
            slots: 1,
        };
        if let MathTarget::At(at) = put {
            builder.check_index(at, formula);
        }
        let result = builder.walk(formula);
        let (steps, slots) = (builder.steps, builder.slots);
        let (first, number) = self.formula(&steps, slots);
        Math { leg, first, count: steps.len() as u32, number, put, result, quiet: false }
    }

    /// A word as a target.
    pub fn put_in_word(&self, word: Word) -> MathTarget {
        let ((low, high), (min, max)) = (word.range(), self.limits(word));
        let to = WordTarget { word: WordWritten(self.layout.word(word).0), min, max };
        if word.is_real() { MathTarget::Real(to) } else { MathTarget::Word { to, low, high } }
    }
}

/// An operand that waits for its operator.
#[derive(Clone, Copy)]
pub(super) struct Operand {
    pub place: OperandPlace,
    pub of: NumberType,
}

/// The place of an operand.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum OperandPlace {
    Integer(i64),
    Real(Real),
    Word(u32),
    Accumulator,
    Slot(u32),
}

pub(super) struct Builder<'a, 'p> {
    assembler: &'a mut Assembler<'p>,
    steps: Vec<FormulaStep>,
    pub operands: Vec<Operand>,
    /// The jumps whose targets are not known yet.
    jumps: Vec<usize>,
    /// The number of slots so far. Slot 0 is never read.
    slots: u32,
}

impl Builder<'_, '_> {
    /// Makes the steps; returns the accumulator with the result.
    fn walk(&mut self, formula: &Formula) -> Accumulator {
        let marks = marks(&formula.parts);
        for (part, mark) in formula.parts.iter().zip(marks) {
            if let Some(mark) = mark {
                self.mark(mark);
            }
            self.part(part);
        }
        self.load(0);
        match self.operands[0].of {
            NumberType::Integer => Accumulator::Integer,
            NumberType::Real => Accumulator::Real,
        }
    }

    /// A formula that reads `$IndexError` must see that the index of its target is outside.
    fn check_index(&mut self, at: ArrayTarget, formula: &Formula) {
        let error = Bit::Space(BitSpace::St, st::INDEX_ERROR);
        let reads = |part: &Part| matches!(part, Part::Bit(bit) if *bit == error);
        if formula.parts.iter().any(reads) {
            self.step(Code::CheckIndex, 0, at.index, at.count.into());
        }
    }

    fn part(&mut self, part: &Part) {
        match *part {
            Part::Integer(n) => self.push(OperandPlace::Integer(n), NumberType::Integer),
            Part::Real(real) => self.push(OperandPlace::Real(real), NumberType::Real),
            Part::Word(word) => {
                let cell = self.assembler.layout.word(word).0;
                self.push(OperandPlace::Word(cell), type_of(word));
            }
            Part::Bit(bit) => self.bit(bit),
            Part::Element(array) => self.element(array),
            Part::Unary(operator, of) => self.unary(operator, of),
            Part::Binary(operator, of) => self.binary(operator, of),
            Part::Call(function, count, of) => self.call(function, count as usize, of),
        }
    }

    /// A bit is read at its place in the expression, because the part before it may turn the status
    /// bit of a mishap ON.
    fn bit(&mut self, bit: Bit) {
        let cell = self.assembler.layout.bit(bit).0;
        let to = self.slot_of_waiting(NumberType::Integer);
        if let Bit::Space(BitSpace::St, n @ st::DIVIDE_BY_ZERO..) = bit {
            self.step(Code::LoadMishap, to, cell, n - st::DIVIDE_BY_ZERO);
        } else {
            self.step(Code::LoadBit, to, cell, 0);
        }
        self.push(OperandPlace::Accumulator, NumberType::Integer);
    }

    /// The element of an array that the last operand selects.
    fn element(&mut self, array: Array) {
        let last = self.operands.len() - 1;
        self.load(last);
        let of = type_of_array(array);
        if of == NumberType::Real {
            self.save(of);
        }
        let code = match of {
            NumberType::Integer if array.is_bits() => Code::BitOf,
            NumberType::Integer => Code::WordOf,
            NumberType::Real => Code::RealOf,
        };
        let cells = self.assembler.cells(array);
        self.step(code, 0, cells.first, cells.count);
        self.operands[last].of = of;
    }

    pub(super) fn push(&mut self, place: OperandPlace, of: NumberType) {
        self.operands.push(Operand { place, of });
    }

    pub(super) fn step(&mut self, code: Code, to: u32, a: u32, b: u32) {
        self.steps.push(FormulaStep { code, to, a, b });
    }

    /// If an operand is in this accumulator, assigns the slot of its place to it. Returns the slot
    /// for the step that needs the accumulator; 0 if there is no such operand.
    fn slot_of_waiting(&mut self, of: NumberType) -> u32 {
        let is_there =
            |operand: &Operand| operand.place == OperandPlace::Accumulator && operand.of == of;
        match self.operands.iter().position(is_there) {
            Some(at) => self.wait(at),
            None => 0,
        }
    }

    /// Assigns the slot of its place to an operand; returns the slot.
    fn wait(&mut self, at: usize) -> u32 {
        let slot = at as u32 + 1;
        self.slots = self.slots.max(slot + 1);
        self.operands[at].place = OperandPlace::Slot(slot);
        slot
    }

    /// Saves the operand that is in this accumulator, if there is one.
    fn save(&mut self, of: NumberType) {
        let slot = self.slot_of_waiting(of);
        if slot != 0 {
            self.step(typed(of, Code::Save, Code::SaveReal), slot, 0, 0);
        }
    }

    /// The cell and place of an operand, as an operator of this type reads it.
    fn source(&mut self, at: usize, of: NumberType) -> (StepOperand, u32) {
        let operand = self.operands[at];
        let word = if operand.of == of { StepOperand::Word } else { StepOperand::Whole };
        match operand.place {
            OperandPlace::Accumulator => (StepOperand::Accumulator, 0),
            OperandPlace::Slot(slot) => (StepOperand::Slot, slot),
            OperandPlace::Word(cell) => (word, cell),
            OperandPlace::Integer(n) => (word, self.assembler.constant(n as i32)),
            OperandPlace::Real(real) => (word, self.assembler.constant(real.cell())),
        }
    }

    /// Loads an operand into the accumulator of its type.
    pub(super) fn load(&mut self, at: usize) {
        self.load_as(at, self.operands[at].of);
    }

    /// Loads an operand into the accumulator of a type.
    pub(super) fn load_as(&mut self, at: usize, of: NumberType) {
        self.convert(at, of);
        let (place, cell) = self.source(at, of);
        let code = match place {
            StepOperand::Accumulator => return,
            StepOperand::Slot => typed(of, Code::LoadSlot, Code::LoadRealSlot),
            StepOperand::Word => typed(of, Code::LoadWord, Code::LoadReal),
            StepOperand::Whole => Code::LoadWhole,
        };
        let to = self.slot_of_waiting(of);
        self.step(code, to, cell, 0);
        self.operands[at] = Operand { place: OperandPlace::Accumulator, of };
    }

    /// Converts an integer result to a real if an operator needs a real. Words and constants are
    /// converted when they are read.
    pub(super) fn convert(&mut self, at: usize, of: NumberType) {
        let operand = self.operands[at];
        if operand.of == of {
            return;
        }
        if let OperandPlace::Slot(_) = operand.place {
            self.load(at);
        }
        if self.operands[at].place == OperandPlace::Accumulator {
            self.save(NumberType::Real);
            self.step(Code::ToReal, 0, 0, 0);
            self.operands[at].of = of;
        }
    }

    /// Saves all operands that are in accumulators.
    pub(super) fn save_all(&mut self) {
        self.save(NumberType::Integer);
        self.save(NumberType::Real);
    }

    fn unary(&mut self, operator: Unary, of: NumberType) {
        let last = self.operands.len() - 1;
        match (operator, of, self.operands[last].place) {
            // If a word can hold the constant: -(-2147483648) does not fit.
            (Unary::Minus, _, OperandPlace::Integer(n)) if i32::try_from(-n).is_ok() => {
                self.operands[last].place = OperandPlace::Integer(-n);
            }
            (Unary::Minus, NumberType::Integer, _) => self.one(Code::Neg, (of, of)),
            (Unary::Minus, NumberType::Real, _) => self.one(Code::RealNeg, (of, of)),
            (Unary::Complement, _, _) => self.one(Code::Complement, (of, of)),
            (Unary::Not, ..) => {
                let of = self.operands[last].of;
                self.one(typed(of, Code::Not, Code::RealNot), (of, NumberType::Integer));
            }
        }
    }

    /// Adds a step that takes the last operand as type `of` and returns type `result`.
    pub(super) fn one(&mut self, code: Code, (of, result): (NumberType, NumberType)) {
        let last = self.operands.len() - 1;
        self.load_as(last, of);
        if of != result {
            self.save(result);
        }
        self.step(code, 0, 0, 0);
        self.operands[last].of = result;
    }

    fn binary(&mut self, sign: Binary, of: NumberType) {
        use Operator as O;
        let integer = NumberType::Integer;
        let (operator, result) = match sign {
            Binary::AndAlso | Binary::OrElse => return self.end_of_right(),
            Binary::Power => (typed(of, O::Pow, O::RealPow), of),
            Binary::Multiply => (typed(of, O::Mul, O::RealMul), of),
            Binary::Divide => (typed(of, O::Div, O::RealDiv), of),
            Binary::Remainder => (typed(of, O::Rem, O::RealRem), of),
            Binary::Add => (typed(of, O::Add, O::RealAdd), of),
            Binary::Subtract => (typed(of, O::Sub, O::RealSub), of),
            Binary::ShiftLeft => (O::ShiftLeft, integer),
            Binary::ShiftRight => (O::ShiftRight, integer),
            Binary::ShiftRightZeros => (O::ShiftRightZeros, integer),
            Binary::Less => (typed(of, O::Less, O::RealLess), integer),
            Binary::AtMost => (typed(of, O::AtMost, O::RealAtMost), integer),
            Binary::Greater => (typed(of, O::Less, O::RealLess), integer),
            Binary::AtLeast => (typed(of, O::AtMost, O::RealAtMost), integer),
            Binary::Equal => (typed(of, O::Equal, O::RealEqual), integer),
            Binary::NotEqual => (typed(of, O::NotEqual, O::RealNotEqual), integer),
            Binary::And => (O::And, integer),
            Binary::Or => (O::Or, integer),
            Binary::Xor => (O::Xor, integer),
        };
        let (left, right) = (self.operands.len() - 2, self.operands.len() - 1);
        let is_swapped = matches!(sign, Binary::Greater | Binary::AtLeast);
        let sides = if is_swapped { [right, left] } else { [left, right] };
        self.sides(operator, sides, (of, result));
    }

    /// Adds a step that takes the last two operands; operands and result have this type.
    pub(super) fn both(&mut self, operator: Operator, of: NumberType) {
        let last = self.operands.len() - 1;
        self.sides(operator, [last - 1, last], (of, of));
    }

    /// Adds a step that takes two operands as type `of` and returns type `result`.
    fn sides(
        &mut self,
        operator: Operator,
        [left, right]: [usize; 2],
        (of, result): (NumberType, NumberType),
    ) {
        self.convert(left, of);
        self.convert(right, of);
        let (code, a, b) = loop {
            let (a, b) = (self.source(left, of), self.source(right, of));
            if let Some(code) = operator.code(a.0, b.0) {
                break (code, a, b);
            }
            let is_right = a.0 == StepOperand::Accumulator || b.0 == StepOperand::Slot;
            self.load_as(if is_right { right } else { left }, of);
        };
        self.operands.truncate(left.min(right));
        let is_free = a.0 != StepOperand::Accumulator && b.0 != StepOperand::Accumulator;
        let to = if is_free { self.slot_of_waiting(of) } else { 0 };
        if of != result {
            self.save(result);
        }
        self.step(code, to, a.1, b.1);
        self.push(OperandPlace::Accumulator, result);
    }

    fn mark(&mut self, mark: Mark) {
        match mark {
            Mark::AndAlso | Mark::Then => self.test(Code::JumpIfZero),
            Mark::OrElse => self.test(Code::JumpIfTrue),
            Mark::Else(of) => {
                self.end_of_value(of);
                let test = self.jumps.pop().expect("`if` has a condition");
                self.jumps.push(self.steps.len());
                self.step(Code::Jump, 0, 0, 0);
                self.arrive(test);
            }
        }
    }

    /// Tests the last operand and jumps by the result. All waiting operands are saved before, so on
    /// both paths the accumulators are free, and the integer accumulator contains the result of the
    /// test.
    fn test(&mut self, code: Code) {
        self.truth();
        self.operands.pop();
        self.save_all();
        self.jumps.push(self.steps.len());
        self.step(code, 0, 0, 0);
    }

    /// Converts the last operand to 0 or 1.
    fn truth(&mut self) {
        let of = self.operands[self.operands.len() - 1].of;
        self.one(typed(of, Code::Truth, Code::RealTruth), (of, NumberType::Integer));
    }

    /// Sets the target of a jump to the next step.
    fn arrive(&mut self, jump: usize) {
        self.steps[jump].to = self.steps.len() as u32;
    }

    /// Ends the right side of `&&` or `||` with 0 or 1. If the left side jumps here, its own 0 or 1
    /// is the result.
    fn end_of_right(&mut self) {
        self.truth();
        let test = self.jumps.pop().expect("`&&` and `||` have a left side");
        self.arrive(test);
    }

    /// Ends a value of `if`: loads it into the accumulator of its type.
    fn end_of_value(&mut self, of: NumberType) {
        self.load_as(self.operands.len() - 1, of);
        self.operands.pop();
    }

    pub(super) fn end_of_if(&mut self, of: NumberType) {
        self.end_of_value(of);
        let jump = self.jumps.pop().expect("`if` has a second argument");
        self.arrive(jump);
        self.push(OperandPlace::Accumulator, of);
    }
}

/// The code or operator for this type.
pub(super) fn typed<T>(of: NumberType, integer: T, real: T) -> T {
    if of == NumberType::Real { real } else { integer }
}
