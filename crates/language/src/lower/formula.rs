//! Turns the expression of a MATH or of a contact into steps.
//!
//! Called by `math`, `elements`, `stores` and `contacts`. Walks the parts, which are in postfix
//! order, with a stack of operands. A word or constant stays in place, and its operator reads it
//! there. A result stays in the accumulator of its type until a different result needs the
//! accumulator; then it moves to the slot of its place on the stack.

use super::assembler::Assembler;
use super::formula_marks::{FormulaMark, marks};
use crate::resolve::array::Array;
use crate::resolve::formula::{
    Binary, Formula, FormulaPart, NumberType, Unary, type_of, type_of_array,
};
use rungd_engine::isa::status::st;
use rungd_engine::isa::{Bit, BitSpace, Real, Word};
pub use rungd_engine::ops::{
    Accumulator, ArrayTarget, FormulaStep, LegPowers, Math, MathReports, MathTarget, PairOperator,
    StepCode, StepOperand, WordTarget, WordWritten,
};

/// The types of a step.
#[derive(Clone, Copy)]
pub(super) struct StepTypes {
    /// The type as which it takes its operands.
    pub operands: NumberType,
    /// The type of its result.
    pub result: NumberType,
}

impl StepTypes {
    /// Operands and result have one type.
    pub(super) fn same(number_type: NumberType) -> StepTypes {
        StepTypes { operands: number_type, result: number_type }
    }
}

impl<'p> Assembler<'p> {
    /// A MATH that evaluates a formula and stores the result in `put`.
    pub fn formula_into(
        &mut self,
        put: MathTarget,
        formula: &Formula,
        leg: LegPowers,
        reports: MathReports,
    ) -> Math {
        let mut builder = self.formula_builder(reports);
        if let MathTarget::At(at) = put {
            builder.check_index(at, formula);
        }
        let result = builder.walk(formula);
        builder.math(put, leg, result)
    }

    pub(super) fn formula_builder(&mut self, reports: MathReports) -> FormulaBuilder<'_, 'p> {
        FormulaBuilder {
            assembler: self,
            reports,
            steps: Vec::new(),
            operands: Vec::new(),
            jumps: Vec::new(),
            slots: 1,
        }
    }

    /// A word as a target.
    pub fn put_in_word(&self, word: Word) -> MathTarget {
        let ((low, high), (min, max)) = (word.range(), self.limits(word));
        let to = WordTarget { word: WordWritten(self.layout.word(word).0), min, max };
        if word.is_real() { MathTarget::Real(to) } else { MathTarget::Word { to, low, high } }
    }
}

/// The accumulator of a type.
pub(super) fn accumulator(number_type: NumberType) -> Accumulator {
    match number_type {
        NumberType::Integer => Accumulator::Integer,
        NumberType::Real => Accumulator::Real,
    }
}

/// An operand that waits for its operator.
#[derive(Clone, Copy)]
pub(super) struct WaitingOperand {
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

pub(super) struct FormulaBuilder<'a, 'p> {
    pub assembler: &'a mut Assembler<'p>,
    reports: MathReports,
    steps: Vec<FormulaStep>,
    pub operands: Vec<WaitingOperand>,
    /// The jumps whose targets are not known yet.
    jumps: Vec<usize>,
    /// The number of slots so far. Slot 0 is never read.
    slots: u32,
}

impl FormulaBuilder<'_, '_> {
    /// The MATH with these steps, which stores what an accumulator has in `put`.
    pub(super) fn math(self, put: MathTarget, leg: LegPowers, result: Accumulator) -> Math {
        let FormulaBuilder { assembler, reports, steps, slots, .. } = self;
        let (first, number) = assembler.formula(&steps, slots);
        Math { leg, first, count: steps.len() as u32, number, put, result, reports }
    }

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
        accumulator(self.operands[0].of)
    }

    /// A formula that reads `$IndexError` must see that the index of its target is outside.
    fn check_index(&mut self, at: ArrayTarget, formula: &Formula) {
        let error = Bit::Space(BitSpace::St, st::INDEX_ERROR);
        let reads = |part: &FormulaPart| matches!(part, FormulaPart::Bit(bit) if *bit == error);
        if formula.parts.iter().any(reads) {
            self.step(StepCode::CheckIndex, 0, at.index, at.count.into());
        }
    }

    fn part(&mut self, part: &FormulaPart) {
        match *part {
            FormulaPart::Integer(n) => {
                self.push(OperandPlace::Integer(n.number), NumberType::Integer)
            }
            FormulaPart::Real(real) => self.push(OperandPlace::Real(real), NumberType::Real),
            FormulaPart::Word(word) => {
                let cell = self.assembler.layout.word(word).0;
                self.push(OperandPlace::Word(cell), type_of(word));
            }
            FormulaPart::Bit(bit) => self.bit(bit),
            FormulaPart::Element(array) => self.element(array),
            FormulaPart::Unary(operator, number_type) => self.unary(operator, number_type),
            FormulaPart::Binary(operator, number_type) => self.binary(operator, number_type),
            FormulaPart::Call(function, count, number_type) => {
                self.call(function, count as usize, number_type)
            }
        }
    }

    /// A bit is read at its place in the expression, because the part before it may turn the status
    /// bit of a mishap ON.
    fn bit(&mut self, bit: Bit) {
        let to = self.slot_of_waiting(NumberType::Integer);
        if let Bit::InWord(bit) = bit {
            let bit = self.assembler.layout.word_bit(bit);
            self.step(StepCode::LoadWordBit, to, bit.word.0, bit.mask.cast_unsigned());
            return self.push(OperandPlace::Accumulator, NumberType::Integer);
        }
        let cell = self.assembler.layout.bit(bit).0;
        if let Bit::Space(BitSpace::St, n @ st::DIVIDE_BY_ZERO..) = bit
            && self.reports != MathReports::Nothing
        {
            self.step(StepCode::LoadMishap, to, cell, n - st::DIVIDE_BY_ZERO);
        } else {
            self.step(StepCode::LoadBit, to, cell, 0);
        }
        self.push(OperandPlace::Accumulator, NumberType::Integer);
    }

    /// The element of an array that the last operand selects.
    fn element(&mut self, array: Array) {
        self.scale_index(array);
        let last = self.operands.len() - 1;
        self.load(last);
        let number_type = type_of_array(array);
        if number_type == NumberType::Real {
            self.save(number_type);
        }
        let mask = self.assembler.mask(array);
        let code = match number_type {
            NumberType::Integer if array.is_bits() && mask.is_none() => StepCode::BitOf,
            NumberType::Integer => StepCode::WordOf,
            NumberType::Real => StepCode::RealOf,
        };
        let cells = self.assembler.cells(array);
        self.step(code, 0, cells.first, cells.count);
        if let Some(mask) = mask {
            self.step(StepCode::HasBit, 0, 0, mask.cast_unsigned());
        }
        self.operands[last].of = number_type;
    }

    /// Multiplies the index of flags by their distance. First it is limited to one beyond each end,
    /// so that the product sets no status bit.
    fn scale_index(&mut self, array: Array) {
        let stride = self.assembler.layout.stride(array.element(0));
        if stride == 1 {
            return;
        }
        let integer = NumberType::Integer;
        for (operator, limit) in [
            (PairOperator::Min, i64::from(array.count)),
            (PairOperator::Max, -1),
            (PairOperator::Mul, i64::from(stride)),
        ] {
            self.push(OperandPlace::Integer(limit), integer);
            self.both(operator, integer);
        }
    }

    pub(super) fn push(&mut self, place: OperandPlace, number_type: NumberType) {
        self.operands.push(WaitingOperand { place, of: number_type });
    }

    pub(super) fn step(&mut self, code: StepCode, to: u32, a: u32, b: u32) {
        self.steps.push(FormulaStep { code, to, a, b });
    }

    /// If an operand is in this accumulator, assigns the slot of its place to it. Returns the slot
    /// for the step that needs the accumulator; 0 if there is no such operand.
    fn slot_of_waiting(&mut self, number_type: NumberType) -> u32 {
        let is_there = |operand: &WaitingOperand| {
            operand.place == OperandPlace::Accumulator && operand.of == number_type
        };
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
    fn save(&mut self, number_type: NumberType) {
        let slot = self.slot_of_waiting(number_type);
        if slot != 0 {
            self.step(typed(number_type, StepCode::Save, StepCode::SaveReal), slot, 0, 0);
        }
    }

    /// The cell and place of an operand, as an operator of this type reads it.
    fn source(&mut self, at: usize, number_type: NumberType) -> (StepOperand, u32) {
        let operand = self.operands[at];
        let word = if operand.of == number_type { StepOperand::Word } else { StepOperand::Whole };
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
    pub(super) fn load_as(&mut self, at: usize, number_type: NumberType) {
        self.convert(at, number_type);
        let (place, cell) = self.source(at, number_type);
        let code = match place {
            StepOperand::Accumulator => return,
            StepOperand::Slot => typed(number_type, StepCode::LoadSlot, StepCode::LoadRealSlot),
            StepOperand::Word => typed(number_type, StepCode::LoadWord, StepCode::LoadReal),
            StepOperand::Whole => StepCode::LoadWhole,
        };
        let to = self.slot_of_waiting(number_type);
        self.step(code, to, cell, 0);
        self.operands[at] = WaitingOperand { place: OperandPlace::Accumulator, of: number_type };
    }

    /// Converts an integer result to a real if an operator needs a real. Words and constants are
    /// converted when they are read.
    pub(super) fn convert(&mut self, at: usize, number_type: NumberType) {
        let operand = self.operands[at];
        if operand.of == number_type {
            return;
        }
        if let OperandPlace::Slot(_) = operand.place {
            self.load(at);
        }
        if self.operands[at].place == OperandPlace::Accumulator {
            self.save(NumberType::Real);
            self.step(StepCode::ToReal, 0, 0, 0);
            self.operands[at].of = number_type;
        }
    }

    /// Saves all operands that are in accumulators.
    pub(super) fn save_all(&mut self) {
        self.save(NumberType::Integer);
        self.save(NumberType::Real);
    }

    fn unary(&mut self, operator: Unary, number_type: NumberType) {
        let last = self.operands.len() - 1;
        match (operator, number_type, self.operands[last].place) {
            // If a word can hold the constant: -(-2147483648) does not fit.
            (Unary::Minus, _, OperandPlace::Integer(n)) if i32::try_from(-n).is_ok() => {
                self.operands[last].place = OperandPlace::Integer(-n);
            }
            (Unary::Minus, NumberType::Integer, _) => {
                self.one(StepCode::Neg, StepTypes::same(number_type))
            }
            (Unary::Minus, NumberType::Real, _) => {
                self.one(StepCode::RealNeg, StepTypes::same(number_type))
            }
            (Unary::Complement, _, _) => {
                self.one(StepCode::Complement, StepTypes::same(number_type))
            }
            (Unary::Not, ..) => {
                let number_type = self.operands[last].of;
                self.one(
                    typed(number_type, StepCode::Not, StepCode::RealNot),
                    StepTypes { operands: number_type, result: NumberType::Integer },
                );
            }
        }
    }

    /// Adds a step that takes the last operand.
    pub(super) fn one(
        &mut self,
        code: StepCode,
        StepTypes { operands: number_type, result }: StepTypes,
    ) {
        let last = self.operands.len() - 1;
        self.load_as(last, number_type);
        if number_type != result {
            self.save(result);
        }
        self.step(code, 0, 0, 0);
        self.operands[last].of = result;
    }

    fn binary(&mut self, sign: Binary, number_type: NumberType) {
        use PairOperator as O;
        let integer = NumberType::Integer;
        let (operator, result) = match sign {
            Binary::AndAlso | Binary::OrElse => return self.end_of_right(),
            Binary::Power => (typed(number_type, O::Pow, O::RealPow), number_type),
            Binary::Multiply => (typed(number_type, O::Mul, O::RealMul), number_type),
            Binary::Divide => (typed(number_type, O::Div, O::RealDiv), number_type),
            Binary::Remainder => (typed(number_type, O::Rem, O::RealRem), number_type),
            Binary::Add => (typed(number_type, O::Add, O::RealAdd), number_type),
            Binary::Subtract => (typed(number_type, O::Sub, O::RealSub), number_type),
            Binary::ShiftLeft => (O::ShiftLeft, integer),
            Binary::ShiftRight => (O::ShiftRight, integer),
            Binary::ShiftRightZeros => (O::ShiftRightZeros, integer),
            Binary::Less => (typed(number_type, O::Less, O::RealLess), integer),
            Binary::AtMost => (typed(number_type, O::AtMost, O::RealAtMost), integer),
            Binary::Greater => (typed(number_type, O::Less, O::RealLess), integer),
            Binary::AtLeast => (typed(number_type, O::AtMost, O::RealAtMost), integer),
            Binary::Equal => (typed(number_type, O::Equal, O::RealEqual), integer),
            Binary::NotEqual => (typed(number_type, O::NotEqual, O::RealNotEqual), integer),
            Binary::And => (O::And, integer),
            Binary::Or => (O::Or, integer),
            Binary::Xor => (O::Xor, integer),
        };
        let (left, right) = (self.operands.len() - 2, self.operands.len() - 1);
        let is_swapped = matches!(sign, Binary::Greater | Binary::AtLeast);
        let sides = if is_swapped { [right, left] } else { [left, right] };
        self.sides(operator, sides, StepTypes { operands: number_type, result });
    }

    /// Adds a step that takes the last two operands; operands and result have this type.
    pub(super) fn both(&mut self, operator: PairOperator, number_type: NumberType) {
        let last = self.operands.len() - 1;
        self.sides(operator, [last - 1, last], StepTypes::same(number_type));
    }

    /// Adds a step that takes two operands.
    fn sides(
        &mut self,
        operator: PairOperator,
        [left, right]: [usize; 2],
        StepTypes { operands: number_type, result }: StepTypes,
    ) {
        self.convert(left, number_type);
        self.convert(right, number_type);
        let (code, a, b) = loop {
            let (a, b) = (self.source(left, number_type), self.source(right, number_type));
            if let Some(code) = operator.code(a.0, b.0) {
                break (code, a, b);
            }
            let is_right = a.0 == StepOperand::Accumulator || b.0 == StepOperand::Slot;
            self.load_as(if is_right { right } else { left }, number_type);
        };
        self.operands.truncate(left.min(right));
        let is_free = a.0 != StepOperand::Accumulator && b.0 != StepOperand::Accumulator;
        let to = if is_free { self.slot_of_waiting(number_type) } else { 0 };
        if number_type != result {
            self.save(result);
        }
        self.step(code, to, a.1, b.1);
        self.push(OperandPlace::Accumulator, result);
    }

    fn mark(&mut self, mark: FormulaMark) {
        match mark {
            FormulaMark::AndAlso | FormulaMark::Then => self.test(StepCode::JumpIfZero),
            FormulaMark::OrElse => self.test(StepCode::JumpIfTrue),
            FormulaMark::Else(of) => {
                self.end_of_value(of);
                let test = self.jumps.pop().expect("`if` has a condition");
                self.jumps.push(self.steps.len());
                self.step(StepCode::Jump, 0, 0, 0);
                self.arrive(test);
            }
        }
    }

    /// Tests the last operand and jumps by the result. All waiting operands are saved before, so on
    /// both paths the accumulators are free, and the integer accumulator contains the result of the
    /// test.
    fn test(&mut self, code: StepCode) {
        self.truth();
        self.operands.pop();
        self.save_all();
        self.jumps.push(self.steps.len());
        self.step(code, 0, 0, 0);
    }

    /// Converts the last operand to 0 or 1.
    fn truth(&mut self) {
        let number_type = self.operands[self.operands.len() - 1].of;
        self.one(
            typed(number_type, StepCode::Truth, StepCode::RealTruth),
            StepTypes { operands: number_type, result: NumberType::Integer },
        );
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
    fn end_of_value(&mut self, number_type: NumberType) {
        self.load_as(self.operands.len() - 1, number_type);
        self.operands.pop();
    }

    pub(super) fn end_of_if(&mut self, number_type: NumberType) {
        self.end_of_value(number_type);
        let jump = self.jumps.pop().expect("`if` has a second argument");
        self.arrive(jump);
        self.push(OperandPlace::Accumulator, number_type);
    }
}

/// The code or operator for this type.
pub(super) fn typed<T>(number_type: NumberType, integer: T, real: T) -> T {
    if number_type == NumberType::Real { real } else { integer }
}
