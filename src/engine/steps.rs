//! The steps of a formula, and their execution.
//!
//! `lower` makes the steps of an expression: one for each operator. Two accumulators, one for
//! integers and one for reals, hold the newest result of their type. A step reads its operands
//! where they are: an accumulator, a word of the image (a constant is such a word too), or a slot,
//! which keeps a result until its operator comes. Its code says where; so an operator takes one
//! dispatch, and its operands none.
//!
//! Behaviour: `docs/semantics.md`, section 8. The arithmetic is in `integer` and `real`.

use super::memory::View;
use super::mishap::{Mishap, Mishaps};
use super::reach::Reach;
use super::role::{BitRead, Cells, WordRead};
use super::{integer, real};
use crate::isa::Real;

/// One step of a formula.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// What it does.
    pub code: Code,
    /// The slot that a step which needs no accumulator first puts its accumulator in; slot 0 is
    /// never read. Or the step that a jump goes to.
    pub to: u32,
    /// The slot or cell of its first operand.
    pub a: u32,
    /// The slot or cell of its second operand.
    pub b: u32,
}

/// The place of an operand, of the type that its operator computes in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum At {
    /// The accumulator.
    Accumulator,
    /// A slot.
    Slot,
    /// A word.
    Word,
    /// A word of an integer that is read as a real.
    Whole,
}

/// The end of a formula: which accumulator holds its result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    Integer,
    Real,
}

/// A number, as slots and accumulators hold it.
trait Number: Copy {
    fn of_slot(bits: u64) -> Self;
    fn slot(self) -> u64;
    fn of_word(word: i32) -> Self;
    fn accumulator<'e, R: Reach>(run: &'e mut Evaluator<'_, '_, R>) -> &'e mut Self;
}

impl Number for i64 {
    #[inline(always)]
    fn of_slot(bits: u64) -> i64 {
        bits.cast_signed()
    }

    #[inline(always)]
    fn slot(self) -> u64 {
        self.cast_unsigned()
    }

    #[inline(always)]
    fn of_word(word: i32) -> i64 {
        i64::from(word)
    }

    #[inline(always)]
    fn accumulator<'e, R: Reach>(run: &'e mut Evaluator<'_, '_, R>) -> &'e mut i64 {
        &mut run.integer
    }
}

impl Number for f64 {
    #[inline(always)]
    fn of_slot(bits: u64) -> f64 {
        f64::from_bits(bits)
    }

    #[inline(always)]
    fn slot(self) -> u64 {
        self.to_bits()
    }

    #[inline(always)]
    fn of_word(word: i32) -> f64 {
        Real::of_cell(word).into()
    }

    #[inline(always)]
    fn accumulator<'e, R: Reach>(run: &'e mut Evaluator<'_, '_, R>) -> &'e mut f64 {
        &mut run.real
    }
}

/// Reads an operand.
macro_rules! operand {
    (Accumulator $run:ident $at:expr) => {
        *Number::accumulator($run)
    };
    (Slot $run:ident $at:expr) => {
        Number::of_slot($run.slots[$at as usize])
    };
    (Word $run:ident $at:expr) => {
        Number::of_word($run.view.word(WordRead($at)))
    };
    (Whole $run:ident $at:expr) => {
        f64::from($run.view.word(WordRead($at)))
    };
}

/// Whether an operand is a word: the one with this number.
macro_rules! word_of {
    (Accumulator $at:expr) => {
        None
    };
    (Slot $at:expr) => {
        None
    };
    (Word $at:expr) => {
        Some($at)
    };
    (Whole $at:expr) => {
        Some($at)
    };
}

macro_rules! codes {
    (
        two { $($two:ident = $number:ident $two_of:path, $($code:ident($a:ident $b:ident))*;)* }
        one { $($one:ident = $one_of:expr;)* }
        load { $($load:ident = $loaded:ident $from:ident;)* }
        other { $($(#[$doc:meta])* $other:ident = $execute:ident;)* }
    ) => {
        /// What a step does. The letters behind an operator with two operands say where they are:
        /// (a)ccumulator, (s)lot, (w)ord or integer word read as a real (i).
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        #[allow(missing_docs)]
        pub enum Code {
            $($($code,)*)*
            $($one,)*
            $($load,)*
            $($(#[$doc])* $other,)*
        }

        /// The operators with two operands.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum Operator { $($two),* }

        impl Operator {
            /// The code for operands at these places, if there is one.
            pub fn code(self, a: At, b: At) -> Option<Code> {
                match (self, a, b) {
                    $($((Operator::$two, At::$a, At::$b) => Some(Code::$code),)*)*
                    _ => None,
                }
            }
        }

        impl Step {
            /// The words that it reads.
            pub(super) fn words(&self) -> [Option<u32>; 2] {
                match self.code {
                    $($(Code::$code => [word_of!($a self.a), word_of!($b self.b)],)*)*
                    $(Code::$load => [word_of!($from self.a), None],)*
                    $(Code::$one)|* | $(Code::$other)|* => [None, None],
                }
            }
        }

        impl<R: Reach> Evaluator<'_, '_, R> {
            /// Executes a step; returns the end of the formula if it is the last one. An operator
            /// gets mishaps of its own: the address of `noted` goes to no function, so that it
            /// stays in a register.
            #[inline(always)]
            fn step(&mut self, step: Step, noted: &mut Mishaps) -> Option<End> {
                let Step { code, to, a, b } = step;
                match code {
                    $($(Code::$code => {
                        let (a, b) = (operand!($a self a), operand!($b self b));
                        codes!(save $a $b, $number self to);
                        let mut own = Mishaps::default();
                        *Number::accumulator(self) = $two_of(a, b, &mut own);
                        noted.add(own);
                    })*)*
                    $(Code::$one => {
                        let a = *Number::accumulator(self);
                        let mut own = Mishaps::default();
                        *Number::accumulator(self) = $one_of(a, &mut own);
                        noted.add(own);
                    })*
                    $(Code::$load => {
                        let a: $loaded = operand!($from self a);
                        self.save::<$loaded>(to);
                        *Number::accumulator(self) = a;
                    })*
                    $(Code::$other => return self.$execute(step, noted),)*
                }
                None
            }
        }
    };
    // Only where no operand is the accumulator can it hold something else.
    (save Word Word, $number:ident $run:ident $to:ident) => { $run.save::<$number>($to) };
    (save Word Whole, $number:ident $run:ident $to:ident) => { $run.save::<$number>($to) };
    (save Whole Word, $number:ident $run:ident $to:ident) => { $run.save::<$number>($to) };
    (save Whole Whole, $number:ident $run:ident $to:ident) => { $run.save::<$number>($to) };
    (save $a:ident $b:ident, $number:ident $run:ident $to:ident) => {};
}

codes! {
    two {
        Add = i64 integer::add, AddWw(Word Word) AddAw(Accumulator Word) AddWa(Word Accumulator)
            AddSa(Slot Accumulator) AddAs(Accumulator Slot);
        Sub = i64 integer::sub, SubWw(Word Word) SubAw(Accumulator Word) SubWa(Word Accumulator)
            SubSa(Slot Accumulator) SubAs(Accumulator Slot);
        Mul = i64 integer::mul, MulWw(Word Word) MulAw(Accumulator Word) MulWa(Word Accumulator)
            MulSa(Slot Accumulator) MulAs(Accumulator Slot);
        Div = i64 integer::div, DivWw(Word Word) DivAw(Accumulator Word) DivWa(Word Accumulator)
            DivSa(Slot Accumulator) DivAs(Accumulator Slot);
        Rem = i64 integer::rem, RemWw(Word Word) RemAw(Accumulator Word) RemWa(Word Accumulator)
            RemSa(Slot Accumulator) RemAs(Accumulator Slot);
        And = i64 integer::and, AndWw(Word Word) AndAw(Accumulator Word) AndWa(Word Accumulator)
            AndSa(Slot Accumulator) AndAs(Accumulator Slot);
        Or = i64 integer::or, OrWw(Word Word) OrAw(Accumulator Word) OrWa(Word Accumulator)
            OrSa(Slot Accumulator) OrAs(Accumulator Slot);
        Equal = i64 integer::equal, EqualWw(Word Word) EqualAw(Accumulator Word)
            EqualWa(Word Accumulator) EqualSa(Slot Accumulator) EqualAs(Accumulator Slot);
        NotEqual = i64 integer::not_equal, NotEqualWw(Word Word) NotEqualAw(Accumulator Word)
            NotEqualWa(Word Accumulator) NotEqualSa(Slot Accumulator)
            NotEqualAs(Accumulator Slot);
        Less = i64 integer::less, LessWw(Word Word) LessAw(Accumulator Word)
            LessWa(Word Accumulator) LessSa(Slot Accumulator) LessAs(Accumulator Slot);
        AtMost = i64 integer::at_most, AtMostWw(Word Word) AtMostAw(Accumulator Word)
            AtMostWa(Word Accumulator) AtMostSa(Slot Accumulator) AtMostAs(Accumulator Slot);
        Pow = i64 integer::pow, PowAw(Accumulator Word) PowSa(Slot Accumulator)
            PowAs(Accumulator Slot);
        Xor = i64 integer::xor, XorAw(Accumulator Word) XorSa(Slot Accumulator)
            XorAs(Accumulator Slot);
        ShiftLeft = i64 integer::shift_left, ShiftLeftAw(Accumulator Word)
            ShiftLeftSa(Slot Accumulator) ShiftLeftAs(Accumulator Slot);
        ShiftRight = i64 integer::shift_right, ShiftRightAw(Accumulator Word)
            ShiftRightSa(Slot Accumulator) ShiftRightAs(Accumulator Slot);
        ShiftRightZeros = i64 integer::shift_right_zeros, ShiftRightZerosAw(Accumulator Word)
            ShiftRightZerosSa(Slot Accumulator) ShiftRightZerosAs(Accumulator Slot);
        Min = i64 integer::min, MinAw(Accumulator Word) MinSa(Slot Accumulator)
            MinAs(Accumulator Slot);
        Max = i64 integer::max, MaxAw(Accumulator Word) MaxSa(Slot Accumulator)
            MaxAs(Accumulator Slot);
        RealAdd = f64 real::add, RealAddWw(Word Word) RealAddWi(Word Whole) RealAddIw(Whole Word)
            RealAddAw(Accumulator Word) RealAddAi(Accumulator Whole) RealAddWa(Word Accumulator)
            RealAddIa(Whole Accumulator) RealAddSa(Slot Accumulator) RealAddAs(Accumulator Slot);
        RealSub = f64 real::sub, RealSubWw(Word Word) RealSubWi(Word Whole) RealSubIw(Whole Word)
            RealSubAw(Accumulator Word) RealSubAi(Accumulator Whole) RealSubWa(Word Accumulator)
            RealSubIa(Whole Accumulator) RealSubSa(Slot Accumulator) RealSubAs(Accumulator Slot);
        RealMul = f64 real::mul, RealMulWw(Word Word) RealMulWi(Word Whole) RealMulIw(Whole Word)
            RealMulAw(Accumulator Word) RealMulAi(Accumulator Whole) RealMulWa(Word Accumulator)
            RealMulIa(Whole Accumulator) RealMulSa(Slot Accumulator) RealMulAs(Accumulator Slot);
        RealDiv = f64 real::div, RealDivWw(Word Word) RealDivWi(Word Whole) RealDivIw(Whole Word)
            RealDivAw(Accumulator Word) RealDivAi(Accumulator Whole) RealDivWa(Word Accumulator)
            RealDivIa(Whole Accumulator) RealDivSa(Slot Accumulator) RealDivAs(Accumulator Slot);
        RealEqual = f64 real::equal, RealEqualWw(Word Word) RealEqualWi(Word Whole)
            RealEqualIw(Whole Word) RealEqualAw(Accumulator Word) RealEqualAi(Accumulator Whole)
            RealEqualWa(Word Accumulator) RealEqualIa(Whole Accumulator)
            RealEqualSa(Slot Accumulator) RealEqualAs(Accumulator Slot);
        RealNotEqual = f64 real::not_equal, RealNotEqualWw(Word Word) RealNotEqualWi(Word Whole)
            RealNotEqualIw(Whole Word) RealNotEqualAw(Accumulator Word)
            RealNotEqualAi(Accumulator Whole) RealNotEqualWa(Word Accumulator)
            RealNotEqualIa(Whole Accumulator) RealNotEqualSa(Slot Accumulator)
            RealNotEqualAs(Accumulator Slot);
        RealLess = f64 real::less, RealLessWw(Word Word) RealLessWi(Word Whole)
            RealLessIw(Whole Word) RealLessAw(Accumulator Word) RealLessAi(Accumulator Whole)
            RealLessWa(Word Accumulator) RealLessIa(Whole Accumulator)
            RealLessSa(Slot Accumulator) RealLessAs(Accumulator Slot);
        RealAtMost = f64 real::at_most, RealAtMostWw(Word Word) RealAtMostWi(Word Whole)
            RealAtMostIw(Whole Word) RealAtMostAw(Accumulator Word)
            RealAtMostAi(Accumulator Whole) RealAtMostWa(Word Accumulator)
            RealAtMostIa(Whole Accumulator) RealAtMostSa(Slot Accumulator)
            RealAtMostAs(Accumulator Slot);
        RealRem = f64 real::rem, RealRemAw(Accumulator Word) RealRemSa(Slot Accumulator)
            RealRemAs(Accumulator Slot);
        RealPow = f64 real::pow, RealPowAw(Accumulator Word) RealPowSa(Slot Accumulator)
            RealPowAs(Accumulator Slot);
        RealMin = f64 real::min, RealMinAw(Accumulator Word) RealMinSa(Slot Accumulator)
            RealMinAs(Accumulator Slot);
        RealMax = f64 real::max, RealMaxAw(Accumulator Word) RealMaxSa(Slot Accumulator)
            RealMaxAs(Accumulator Slot);
        Atan2 = f64 real::atan2, Atan2Aw(Accumulator Word) Atan2Sa(Slot Accumulator)
            Atan2As(Accumulator Slot);
    }
    one {
        Neg = integer::neg;
        Complement = integer::complement;
        Abs = integer::abs;
        RealNeg = real::neg;
        RealAbs = real::abs;
        Round = real::round;
        Floor = real::floor;
        Ceil = real::ceil;
        Trunc = real::trunc;
        Sqrt = real::sqrt;
        Exp = real::exp;
        Ln = real::log;
        Log10 = real::log10;
        Sin = real::sin;
        Cos = real::cos;
        Tan = real::tan;
        Asin = real::asin;
        Acos = real::acos;
        Atan = real::atan;
        ToReal = |a: i64, _: &mut Mishaps| a as f64;
        Truth = |a: i64, _: &mut Mishaps| i64::from(a != 0);
        RealTruth = |a: f64, _: &mut Mishaps| i64::from(a != 0.0);
        Not = |a: i64, _: &mut Mishaps| i64::from(a == 0);
        RealNot = |a: f64, _: &mut Mishaps| i64::from(a == 0.0);
    }
    load {
        LoadWord = i64 Word;
        LoadSlot = i64 Slot;
        LoadReal = f64 Word;
        LoadWhole = f64 Whole;
        LoadRealSlot = f64 Slot;
    }
    other {
        /// The bit `a`, as 0 or 1.
        LoadBit = load_bit;
        /// The bit `a`, the status bit of the mishap `b`: ON as well if the formula has had it.
        LoadMishap = load_mishap;
        /// The integer selects a bit of the `b` bits from `a` on.
        BitOf = bit_of;
        /// The integer selects a word of the `b` words from `a` on.
        WordOf = integer_of;
        /// The integer selects a real of the `b` words from `a` on.
        RealOf = real_of;
        /// Puts the integer in the slot `to`.
        Save = save_integer;
        /// Puts the real in the slot `to`.
        SaveReal = save_real;
        /// Puts the integer in the slot `to`, as a real.
        SaveAsReal = save_as_real;
        /// Goes to a step.
        Jump = jump;
        /// Goes to a step if the integer is 0.
        JumpIfZero = jump_if_zero;
        /// Goes to a step unless the integer is 0.
        JumpIfTrue = jump_if_true;
        /// The last step: the integer is the result.
        EndInteger = end_integer;
        /// The last step: the real is the result.
        EndReal = end_real;
    }
}

/// The evaluation of formulas.
pub(super) struct Evaluator<'a, 'v, R: Reach> {
    pub view: View<'v, R>,
    pub integer: i64,
    pub real: f64,
    slots: &'a mut [u64],
    /// The next step.
    at: usize,
}

impl<'a, 'v, R: Reach> Evaluator<'a, 'v, R> {
    #[inline(always)]
    pub fn new(view: View<'v, R>, slots: &'a mut [u64]) -> Self {
        Evaluator { view, integer: 0, real: 0.0, slots, at: 0 }
    }

    /// Executes the steps from this one on to the end of the formula.
    #[inline(always)]
    pub fn evaluate(&mut self, steps: &[Step], first: u32, noted: &mut Mishaps) -> End {
        self.at = first as usize;
        loop {
            let step = steps[self.at];
            self.at += 1;
            if let Some(end) = self.step(step, noted) {
                return end;
            }
        }
    }

    /// Puts an accumulator in a slot.
    #[inline(always)]
    fn save<N: Number>(&mut self, slot: u32) {
        let number = *N::accumulator(self);
        self.slots[slot as usize] = number.slot();
    }

    #[inline(always)]
    fn load_bit(&mut self, step: Step, _: &mut Mishaps) -> Option<End> {
        self.save::<i64>(step.to);
        self.integer = i64::from(self.view.bit(BitRead(step.a)));
        None
    }

    #[inline(always)]
    fn load_mishap(&mut self, step: Step, noted: &mut Mishaps) -> Option<End> {
        self.save::<i64>(step.to);
        let is_on = self.view.bit(BitRead(step.a)) != 0;
        self.integer = i64::from(is_on || noted.has_number(step.b));
        None
    }

    #[inline(always)]
    fn save_integer(&mut self, step: Step, _: &mut Mishaps) -> Option<End> {
        self.save::<i64>(step.to);
        None
    }

    #[inline(always)]
    fn save_real(&mut self, step: Step, _: &mut Mishaps) -> Option<End> {
        self.save::<f64>(step.to);
        None
    }

    #[inline(always)]
    fn save_as_real(&mut self, step: Step, _: &mut Mishaps) -> Option<End> {
        self.slots[step.to as usize] = (self.integer as f64).slot();
        None
    }

    #[inline(always)]
    fn jump(&mut self, step: Step, _: &mut Mishaps) -> Option<End> {
        self.at = step.to as usize;
        None
    }

    #[inline(always)]
    fn jump_if_zero(&mut self, step: Step, noted: &mut Mishaps) -> Option<End> {
        if self.integer == 0 { self.jump(step, noted) } else { None }
    }

    #[inline(always)]
    fn jump_if_true(&mut self, step: Step, noted: &mut Mishaps) -> Option<End> {
        if self.integer == 0 { None } else { self.jump(step, noted) }
    }

    /// The cell of the element that the integer selects.
    #[inline(always)]
    fn element(&self, step: Step, noted: &mut Mishaps) -> Option<u32> {
        let index = i32::try_from(self.integer).ok();
        let cell = index.and_then(|index| cells(step).cell(index));
        if cell.is_none() {
            noted.note(Mishap::IndexError);
        }
        cell
    }

    #[inline(always)]
    fn bit_of(&mut self, step: Step, noted: &mut Mishaps) -> Option<End> {
        let cell = self.element(step, noted);
        self.integer = cell.map_or(0, |cell| self.view.bit(BitRead(cell)).into());
        None
    }

    #[inline(always)]
    fn integer_of(&mut self, step: Step, noted: &mut Mishaps) -> Option<End> {
        let cell = self.element(step, noted);
        self.integer = cell.map_or(0, |cell| self.view.word(WordRead(cell)).into());
        None
    }

    #[inline(always)]
    fn real_of(&mut self, step: Step, noted: &mut Mishaps) -> Option<End> {
        let cell = self.element(step, noted);
        self.real = cell.map_or(0.0, |cell| Number::of_word(self.view.word(WordRead(cell))));
        None
    }

    #[inline(always)]
    fn end_integer(&mut self, _: Step, _: &mut Mishaps) -> Option<End> {
        Some(End::Integer)
    }

    #[inline(always)]
    fn end_real(&mut self, _: Step, _: &mut Mishaps) -> Option<End> {
        Some(End::Real)
    }
}

/// The array of which a step reads an element.
pub(super) fn cells(step: Step) -> Cells {
    Cells { first: step.a, count: step.b }
}
