//! Turns the expression of a MATH into steps.
//!
//! Called by `instructions`. Walks the parts, which are in postfix order, with a stack of operands.
//! A word or constant stays where it is until its operator comes, which reads it in place; only
//! what is computed takes a slot. The slots are a stack too, so that a formula needs as many as its
//! results wait for their operators at once.

use super::assembler::Assembler;
use super::formula_marks::{Mark, marks};
use crate::engine::ops::{
    BitWritten, Code, Fused, Leg, Math, Op, Other, Put, Step, Target, WordWritten,
};
use crate::isa::status::st;
use crate::isa::{Bit, BitSpace, Real, Word};
use crate::resolve::formula::{Binary, Formula, NumberType, Part, Unary};
use crate::resolve::instruction::Target as MathTarget;

impl Assembler<'_> {
    /// Lowers a MATH.
    pub fn math(&mut self, target: MathTarget, formula: &Formula, leg: Leg) -> Op {
        let first = self.next_step();
        let mut builder = Builder {
            assembler: self,
            first,
            steps: Vec::new(),
            operands: Vec::new(),
            jumps: Vec::new(),
            next: 0,
            most: 0,
        };
        builder.walk(formula);
        let (steps, slots) = (builder.steps, builder.most);
        let number = self.formula(&steps, slots);
        let put = self.put(target);
        let status = self.layout.bit(Bit::Space(BitSpace::St, 0)).0;
        Op::Math(Math { leg, first, number, put, status })
    }

    fn put(&self, target: MathTarget) -> Put {
        let word = match target {
            MathTarget::Bit(bit) => return Put::Bit(BitWritten(self.layout.bit(bit).0)),
            MathTarget::Word(word) => word,
        };
        let ((low, high), (min, max)) = (word.range(), self.limits(word));
        let to = Target { word: WordWritten(self.layout.word(word).0), min, max };
        if word.is_real() { Put::Real(to) } else { Put::Word { to, low, high } }
    }
}

/// An operand that waits for its operator.
#[derive(Clone, Copy)]
pub(super) struct Operand {
    pub place: Place,
    pub of: NumberType,
}

/// The place of an operand.
#[derive(Clone, Copy)]
pub(super) enum Place {
    Integer(i64),
    Real(Real),
    Word(u32),
    Bit(u32),
    Slot(u32),
}

/// An operand as a step reads it.
#[derive(Clone, Copy)]
pub(super) enum Source {
    Slot(u32),
    Word(u32),
}

/// A jump that does not know its end yet: its step, and the slot of the result.
pub(super) struct Jump {
    step: usize,
    slot: u32,
}

pub(super) struct Builder<'a, 'p> {
    assembler: &'a mut Assembler<'p>,
    /// The number of the formula's first step.
    first: u32,
    steps: Vec<Step>,
    pub operands: Vec<Operand>,
    jumps: Vec<Jump>,
    /// The first free slot.
    pub next: u32,
    /// The number of slots so far.
    most: u32,
}

impl Builder<'_, '_> {
    fn walk(&mut self, formula: &Formula) {
        let marks = marks(&formula.parts);
        for (part, mark) in formula.parts.iter().zip(marks) {
            if let Some(mark) = mark {
                self.mark(mark);
            }
            let operand = self.part(part);
            self.operands.push(operand);
        }
        let whole = self.pop();
        let slot = self.slot(whole, whole.of);
        let code = match whole.of {
            NumberType::Integer => Code::Other(Other::PutInteger),
            NumberType::Real => Code::Other(Other::PutReal),
        };
        self.step(code, 0, slot, 0);
    }

    fn part(&mut self, part: &Part) -> Operand {
        let integer = |place| Operand { place, of: NumberType::Integer };
        match *part {
            Part::Integer(n) => integer(Place::Integer(n)),
            Part::Real(real) => Operand { place: Place::Real(real), of: NumberType::Real },
            Part::Word(word) => self.word(word),
            Part::Bit(bit) => integer(self.bit(bit)),
            Part::Unary(operator, of) => self.unary(operator, of),
            Part::Binary(operator, of) => self.binary(operator, of),
            Part::Call(function, count, of) => self.call(function, count as usize, of),
        }
    }

    fn bit(&mut self, bit: Bit) -> Place {
        let cell = self.assembler.layout.bit(bit).0;
        let Bit::Space(BitSpace::St, st::DIVIDE_BY_ZERO..) = bit else { return Place::Bit(cell) };
        // Read at its place in the expression: what stands before it may turn it ON.
        let slot = self.take_slot();
        self.step(Code::Other(Other::LoadMishap), slot, cell, 0);
        Place::Slot(slot)
    }

    fn word(&self, word: Word) -> Operand {
        let place = Place::Word(self.assembler.layout.word(word).0);
        Operand { place, of: crate::resolve::formula::type_of(word) }
    }

    pub(super) fn pop(&mut self) -> Operand {
        self.operands.pop().expect("an operator stands behind its operands")
    }

    pub(super) fn step(&mut self, code: Code, to: u32, a: u32, b: u32) {
        self.steps.push(Step { code, to, a, b });
    }

    pub(super) fn take_slot(&mut self) -> u32 {
        self.next += 1;
        self.most = self.most.max(self.next);
        self.next - 1
    }

    /// An operand as a number of a type, in a word where that is possible.
    pub(super) fn source(&mut self, operand: Operand, wanted: NumberType) -> Source {
        match (operand.place, wanted) {
            (Place::Word(cell), _) if operand.of == wanted => Source::Word(cell),
            (Place::Integer(n), NumberType::Integer) => {
                Source::Word(self.assembler.constant(n as i32))
            }
            (Place::Integer(n), NumberType::Real) if n as f32 as i64 == n => {
                let (real, _) = Real::stored(n as f64);
                Source::Word(self.assembler.constant(real.cell()))
            }
            (Place::Real(real), NumberType::Real) => {
                Source::Word(self.assembler.constant(real.cell()))
            }
            _ => Source::Slot(self.slot(operand, wanted)),
        }
    }

    /// The slot of an operand as a number of a type.
    pub(super) fn slot(&mut self, operand: Operand, wanted: NumberType) -> u32 {
        let to_real = operand.of == NumberType::Integer && wanted == NumberType::Real;
        match operand.place {
            Place::Slot(slot) => {
                if to_real {
                    self.step(Code::ToReal, slot, slot, 0);
                }
                slot
            }
            Place::Bit(cell) => {
                let slot = self.take_slot();
                self.step(Code::Other(Other::LoadBit), slot, cell, 0);
                if to_real {
                    self.step(Code::ToReal, slot, slot, 0);
                }
                slot
            }
            Place::Word(_) | Place::Integer(_) | Place::Real(_) => {
                let cell = match operand.place {
                    Place::Word(cell) => cell,
                    Place::Integer(n) => self.assembler.constant(n as i32),
                    Place::Real(real) => self.assembler.constant(real.cell()),
                    Place::Slot(_) | Place::Bit(_) => unreachable!("matched above"),
                };
                let code = match operand.of {
                    NumberType::Integer if to_real => Code::LoadWordAsReal,
                    NumberType::Integer => Code::LoadWord,
                    NumberType::Real => Code::LoadReal,
                };
                let slot = self.take_slot();
                self.step(code, slot, cell, 0);
                slot
            }
        }
    }

    /// The slot of a result of these operands, which are then done with.
    pub(super) fn result(&mut self, operands: &[Operand], of: NumberType) -> Operand {
        let slots = operands.iter().filter_map(|operand| match operand.place {
            Place::Slot(slot) => Some(slot),
            Place::Integer(_) | Place::Real(_) | Place::Word(_) | Place::Bit(_) => None,
        });
        self.next = slots.min().unwrap_or(self.next).min(self.next);
        Operand { place: Place::Slot(self.take_slot()), of }
    }

    fn unary(&mut self, operator: Unary, of: NumberType) -> Operand {
        let operand = self.pop();
        if let (Unary::Minus, Place::Integer(n)) = (operator, operand.place) {
            return Operand { place: Place::Integer(-n), of };
        }
        let (code, result) = match (operator, of) {
            (Unary::Minus, NumberType::Integer) => (Code::Neg, of),
            (Unary::Minus, NumberType::Real) => (Code::RealNeg, of),
            (Unary::Complement, _) => (Code::Complement, NumberType::Integer),
            (Unary::Not, _) => (Code::Not, NumberType::Integer),
        };
        self.one(code, operand, (of, result))
    }

    /// A step with one operand, which it takes and gives as these types.
    pub(super) fn one(
        &mut self,
        code: Code,
        operand: Operand,
        (of, result): (NumberType, NumberType),
    ) -> Operand {
        let before = self.next;
        let a = self.slot(operand, of);
        self.next = before;
        let result = self.result(&[operand], result);
        self.step(code, slot_of(result), a, 0);
        result
    }

    fn binary(&mut self, operator: Binary, of: NumberType) -> Operand {
        let (b, a) = (self.pop(), self.pop_left(operator));
        let integer = NumberType::Integer;
        let (step, result) = match operator {
            Binary::AndAlso | Binary::OrElse => return self.end_of_right(b),
            Binary::Power => (two(of, Code::Pow, Code::RealPow), of),
            Binary::Multiply => (fused(of, Fused::Mul, Fused::RealMul), of),
            Binary::Divide => (fused(of, Fused::Div, Fused::RealDiv), of),
            Binary::Remainder if of == integer => (Operator::Fused(Fused::Rem), of),
            Binary::Remainder => (Operator::Two(Code::RealRem), of),
            Binary::Add => (fused(of, Fused::Add, Fused::RealAdd), of),
            Binary::Subtract => (fused(of, Fused::Sub, Fused::RealSub), of),
            Binary::ShiftLeft => (Operator::Two(Code::ShiftLeft), integer),
            Binary::ShiftRight => (Operator::Two(Code::ShiftRight), integer),
            Binary::ShiftRightZeros => (Operator::Two(Code::ShiftRightZeros), integer),
            Binary::Less | Binary::Greater => (fused(of, Fused::Less, Fused::RealLess), integer),
            Binary::AtMost | Binary::AtLeast => {
                (fused(of, Fused::AtMost, Fused::RealAtMost), integer)
            }
            Binary::Equal => (fused(of, Fused::Equal, Fused::RealEqual), integer),
            Binary::NotEqual => (fused(of, Fused::NotEqual, Fused::RealNotEqual), integer),
            Binary::And => (Operator::Fused(Fused::And), integer),
            Binary::Or => (Operator::Fused(Fused::Or), integer),
            Binary::Xor => (Operator::Two(Code::Xor), integer),
        };
        let is_swapped = matches!(operator, Binary::Greater | Binary::AtLeast);
        let (a, b) = if is_swapped { (b, a) } else { (a, b) };
        self.both(step, [a, b], (of, result))
    }

    /// The left operand of an operator; that of `&&` and `||` is gone since their mark.
    fn pop_left(&mut self, operator: Binary) -> Operand {
        if matches!(operator, Binary::AndAlso | Binary::OrElse) {
            return Operand { place: Place::Integer(0), of: NumberType::Integer };
        }
        self.pop()
    }

    /// A step with two operands, which it takes and gives as these types.
    pub(super) fn both(
        &mut self,
        operator: Operator,
        [a, b]: [Operand; 2],
        (of, result): (NumberType, NumberType),
    ) -> Operand {
        let before = self.next;
        let (code, from_a, from_b) = match operator {
            Operator::Two(code) => (code, self.slot(a, of), self.slot(b, of)),
            Operator::Fused(operator) => {
                let (a, b) = (self.source(a, of), self.source(b, of));
                (operator.code(a.is_word(), b.is_word()), a.number(), b.number())
            }
        };
        self.next = before;
        let result = self.result(&[a, b], result);
        self.step(code, slot_of(result), from_a, from_b);
        result
    }

    fn mark(&mut self, mark: Mark) {
        match mark {
            Mark::AndAlso | Mark::Then => self.test(Code::Other(Other::JumpIfZero)),
            Mark::OrElse => self.test(Code::Other(Other::JumpIfTrue)),
            Mark::Else(of) => {
                let value = self.pop();
                let test = self.jumps.pop().expect("`if` has a condition");
                self.put_in(test.slot, value, of);
                self.jumps.push(Jump { step: self.steps.len(), slot: test.slot });
                self.step(Code::Other(Other::Jump), 0, 0, 0);
                self.arrive(test.step);
                self.next = test.slot;
            }
        }
    }

    /// Tests the last operand, and leaves its slot to what is evaluated next.
    fn test(&mut self, code: Code) {
        let condition = self.pop();
        let slot = self.slot(condition, condition.of);
        self.jumps.push(Jump { step: self.steps.len(), slot });
        self.step(code, 0, slot, 0);
        self.next = slot;
    }

    /// Lets a jump go to the next step.
    fn arrive(&mut self, jump: usize) {
        self.steps[jump].to = self.first + self.steps.len() as u32;
    }

    /// Puts an operand in this slot, the first free one.
    fn put_in(&mut self, slot: u32, operand: Operand, of: NumberType) {
        let from = self.slot(operand, of);
        if from != slot {
            self.step(Code::Other(Other::Copy), slot, from, 0);
        }
    }

    /// The end of the right side of `&&` or `||`.
    fn end_of_right(&mut self, right: Operand) -> Operand {
        let test = self.jumps.pop().expect("`&&` and `||` have a left side");
        let from = self.slot(right, right.of);
        self.step(Code::Truth, test.slot, from, 0);
        self.arrive(test.step);
        self.next = test.slot + 1;
        Operand { place: Place::Slot(test.slot), of: NumberType::Integer }
    }

    pub(super) fn end_of_if(&mut self, of: NumberType) -> Operand {
        let value = self.pop();
        let jump = self.jumps.pop().expect("`if` has a second argument");
        self.put_in(jump.slot, value, of);
        self.arrive(jump.step);
        self.next = jump.slot + 1;
        Operand { place: Place::Slot(jump.slot), of }
    }
}

impl Source {
    pub(super) fn is_word(self) -> bool {
        matches!(self, Source::Word(_))
    }

    pub(super) fn number(self) -> u32 {
        match self {
            Source::Slot(number) | Source::Word(number) => number,
        }
    }
}

/// An operator with two operands.
#[derive(Clone, Copy)]
pub(super) enum Operator {
    /// It reads words in place.
    Fused(Fused),
    /// It reads slots.
    Two(Code),
}

pub(super) fn fused(of: NumberType, integer: Fused, real: Fused) -> Operator {
    Operator::Fused(if of == NumberType::Real { real } else { integer })
}

pub(super) fn two(of: NumberType, integer: Code, real: Code) -> Operator {
    Operator::Two(one(of, integer, real))
}

pub(super) fn one(of: NumberType, integer: Code, real: Code) -> Code {
    if of == NumberType::Real { real } else { integer }
}

pub(super) fn slot_of(operand: Operand) -> u32 {
    match operand.place {
        Place::Slot(slot) => slot,
        Place::Integer(_) | Place::Real(_) | Place::Word(_) | Place::Bit(_) => {
            unreachable!("a result has a slot")
        }
    }
}
