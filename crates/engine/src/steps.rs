//! The steps of a formula.
//!
//! `lower` makes the steps of an expression: one for each operator. Two accumulators, one for
//! integers and one for reals, hold the newest result of their type. A step reads its operands in
//! place: from an accumulator, from a word of the image (a constant is a word too), or from a slot,
//! which keeps a result until its operator needs it. The code of the step includes these places; so
//! an operator takes one dispatch, and its operands take none.
//!
//! Behaviour: `docs/semantics.md`, section 8. The arithmetic is in `integer` and `real`. `rows`
//! executes the steps of one formula after the other, `columns` each step for many formulas.

use super::role::CellRange;
use crate::isa::Real;

/// One step of a formula.
#[derive(Clone, Copy, Debug)]
pub struct FormulaStep {
    /// Its operation, with the places of its operands.
    pub code: StepCode,
    /// The slot in which a step without an operand in the accumulator first saves the accumulator;
    /// slot 0 is never read. For a jump: the target, a step of the formula.
    pub to: u32,
    /// The slot or cell of its first operand.
    pub a: u32,
    /// The slot or cell of its second operand.
    pub b: u32,
}

/// The place of an operand, of the type that its operator computes in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepOperand {
    /// The accumulator.
    Accumulator,
    /// A slot.
    Slot,
    /// A word.
    Word,
    /// A word with an integer that is read as a real.
    Whole,
}

/// An accumulator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Accumulator {
    /// Of integers.
    Integer,
    /// Of reals.
    Real,
}

/// A number, as slots and accumulators hold it.
pub(super) trait StepNumber: Copy {
    fn of_slot(bits: u64) -> Self;
    fn slot(self) -> u64;
    fn of_word(word: i32) -> Self;
}

impl StepNumber for i64 {
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
}

impl StepNumber for f64 {
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
}

/// Passes all codes to a macro: operators with the places of their operands, functions of one
/// number, loads, saves, and the codes that only `rows` executes.
macro_rules! for_each_code {
    ($then:ident) => {
        $then! {
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
            Equal = i64 integer::equal, EqualWw(Word Word) EqualAw(Accumulator Word) EqualWa(Word
                Accumulator) EqualSa(Slot Accumulator) EqualAs(Accumulator Slot);
            NotEqual = i64 integer::not_equal, NotEqualWw(Word Word) NotEqualAw(Accumulator Word)
                NotEqualWa(Word Accumulator) NotEqualSa(Slot Accumulator) NotEqualAs(Accumulator
                Slot);
            Less = i64 integer::less, LessWw(Word Word) LessAw(Accumulator Word) LessWa(Word
                Accumulator) LessSa(Slot Accumulator) LessAs(Accumulator Slot);
            AtMost = i64 integer::at_most, AtMostWw(Word Word) AtMostAw(Accumulator Word)
                AtMostWa(Word Accumulator) AtMostSa(Slot Accumulator) AtMostAs(Accumulator Slot);
            Pow = i64 integer::pow, PowAw(Accumulator Word) PowSa(Slot Accumulator)
                PowAs(Accumulator Slot);
            Xor = i64 integer::xor, XorAw(Accumulator Word) XorSa(Slot Accumulator)
                XorAs(Accumulator Slot);
            ShiftLeft = i64 integer::shift_left, ShiftLeftAw(Accumulator Word) ShiftLeftSa(Slot
                Accumulator) ShiftLeftAs(Accumulator Slot);
            ShiftRight = i64 integer::shift_right, ShiftRightAw(Accumulator Word) ShiftRightSa(Slot
                Accumulator) ShiftRightAs(Accumulator Slot);
            ShiftRightZeros = i64 integer::shift_right_zeros, ShiftRightZerosAw(Accumulator Word)
                ShiftRightZerosSa(Slot Accumulator) ShiftRightZerosAs(Accumulator Slot);
            Min = i64 integer::min, MinAw(Accumulator Word) MinSa(Slot Accumulator)
                MinAs(Accumulator Slot);
            Max = i64 integer::max, MaxAw(Accumulator Word) MaxSa(Slot Accumulator)
                MaxAs(Accumulator Slot);
            RealAdd = f64 real::add, RealAddWw(Word Word) RealAddWi(Word Whole) RealAddIw(Whole
                Word) RealAddAw(Accumulator Word) RealAddAi(Accumulator Whole) RealAddWa(Word
                Accumulator) RealAddIa(Whole Accumulator) RealAddSa(Slot Accumulator)
                RealAddAs(Accumulator Slot);
            RealSub = f64 real::sub, RealSubWw(Word Word) RealSubWi(Word Whole) RealSubIw(Whole
                Word) RealSubAw(Accumulator Word) RealSubAi(Accumulator Whole) RealSubWa(Word
                Accumulator) RealSubIa(Whole Accumulator) RealSubSa(Slot Accumulator)
                RealSubAs(Accumulator Slot);
            RealMul = f64 real::mul, RealMulWw(Word Word) RealMulWi(Word Whole) RealMulIw(Whole
                Word) RealMulAw(Accumulator Word) RealMulAi(Accumulator Whole) RealMulWa(Word
                Accumulator) RealMulIa(Whole Accumulator) RealMulSa(Slot Accumulator)
                RealMulAs(Accumulator Slot);
            RealDiv = f64 real::div, RealDivWw(Word Word) RealDivWi(Word Whole) RealDivIw(Whole
                Word) RealDivAw(Accumulator Word) RealDivAi(Accumulator Whole) RealDivWa(Word
                Accumulator) RealDivIa(Whole Accumulator) RealDivSa(Slot Accumulator)
                RealDivAs(Accumulator Slot);
            RealEqual = f64 real::equal, RealEqualWw(Word Word) RealEqualWi(Word Whole)
                RealEqualIw(Whole Word) RealEqualAw(Accumulator Word) RealEqualAi(Accumulator Whole)
                RealEqualWa(Word Accumulator) RealEqualIa(Whole Accumulator) RealEqualSa(Slot
                Accumulator) RealEqualAs(Accumulator Slot);
            RealNotEqual = f64 real::not_equal, RealNotEqualWw(Word Word) RealNotEqualWi(Word Whole)
                RealNotEqualIw(Whole Word) RealNotEqualAw(Accumulator Word)
                RealNotEqualAi(Accumulator Whole) RealNotEqualWa(Word Accumulator)
                RealNotEqualIa(Whole Accumulator) RealNotEqualSa(Slot Accumulator)
                RealNotEqualAs(Accumulator Slot);
            RealLess = f64 real::less, RealLessWw(Word Word) RealLessWi(Word Whole) RealLessIw(Whole
                Word) RealLessAw(Accumulator Word) RealLessAi(Accumulator Whole) RealLessWa(Word
                Accumulator) RealLessIa(Whole Accumulator) RealLessSa(Slot Accumulator)
                RealLessAs(Accumulator Slot);
            RealAtMost = f64 real::at_most, RealAtMostWw(Word Word) RealAtMostWi(Word Whole)
                RealAtMostIw(Whole Word) RealAtMostAw(Accumulator Word) RealAtMostAi(Accumulator
                Whole) RealAtMostWa(Word Accumulator) RealAtMostIa(Whole Accumulator)
                RealAtMostSa(Slot Accumulator) RealAtMostAs(Accumulator Slot);
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
            LoadBit = i64 Bit;
        }
        save {
            Save = i64;
            SaveReal = f64;
        }
        other {
            /// Loads the bit `a`, the status bit of the mishap `b`. It is also ON if the formula
            /// had this mishap.
            LoadMishap = load_mishap;
            /// Notes an index error if the word `a` selects none of `b` elements.
            CheckIndex = check_index;
            /// Loads the bit that the integer selects among the `b` bits from `a` on.
            BitOf = bit_of;
            /// Loads the word that the integer selects among the `b` words from `a` on.
            WordOf = integer_of;
            /// Loads the real that the integer selects among the `b` words from `a` on.
            RealOf = real_of;
            /// Loads the bit with the mask `b` of the word `a`.
            LoadWordBit = load_word_bit;
            /// Replaces the integer by whether it has a bit of the mask `b`.
            HasBit = has_bit;
            /// Jumps to a step.
            Jump = jump;
            /// Jumps to a step if the integer is 0.
            JumpIfZero = jump_if_zero;
            /// Jumps to a step unless the integer is 0.
            JumpIfTrue = jump_if_true;
        }
        }
    };
}

pub(super) use for_each_code;

/// Executes `$then` if no operand is the accumulator: only then can it hold a result for later.
macro_rules! unless_accumulator {
    (Accumulator $b:ident, $then:expr) => {};
    ($a:ident Accumulator, $then:expr) => {};
    ($a:ident $b:ident, $then:expr) => {
        $then
    };
}

pub(super) use unless_accumulator;

/// The number of an operand's word or slot.
macro_rules! number_of {
    (Word Word $at:expr) => {
        Some($at)
    };
    (Word Whole $at:expr) => {
        Some($at)
    };
    (Slot Slot $at:expr) => {
        Some($at)
    };
    ($kind:ident $place:ident $at:expr) => {
        None
    };
}

macro_rules! codes {
    (
        two { $($two:ident = $number:ident $two_of:path, $($code:ident($a:ident $b:ident))*;)* }
        one { $($one:ident = $one_of:expr;)* }
        load { $($load:ident = $loaded:ident $from:ident;)* }
        save { $($save:ident = $saved:ident;)* }
        other { $($(#[$doc:meta])* $other:ident = $execute:ident;)* }
    ) => {
        /// The operation of a step. The letters behind an operator with two operands are their
        /// places: (a)ccumulator, (s)lot, (w)ord or integer word read as a real (i).
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u8)]
        #[allow(missing_docs)]
        pub enum StepCode {
            $($($code,)*)*
            $($one,)*
            $($load,)*
            $($save,)*
            $($(#[$doc])* $other,)*
        }

        /// The operators with two operands.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum PairOperator { $($two),* }

        /// The operators and functions with one operand.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum OneOperator { $($one),* }

        /// The loads.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum StepLoad { $($load),* }

        /// The saves of an accumulator.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum StepSave { $($save),* }

        /// The codes that are executed for one formula alone.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum OtherStep { $($(#[$doc])* $other),* }

        impl StepCode {
            /// Its parts.
            pub fn parts(self) -> CodeParts {
                match self {
                    $($(StepCode::$code => CodeParts::Two(
                        PairOperator::$two,
                        StepOperand::$a,
                        StepOperand::$b,
                    ),)*)*
                    $(StepCode::$one => CodeParts::One(OneOperator::$one),)*
                    $(StepCode::$load => CodeParts::Load(StepLoad::$load),)*
                    $(StepCode::$save => CodeParts::Save(StepSave::$save),)*
                    $(StepCode::$other => CodeParts::Other(OtherStep::$other),)*
                }
            }
        }

        impl PairOperator {
            /// The code for operands at these places, if there is one.
            pub fn code(self, a: StepOperand, b: StepOperand) -> Option<StepCode> {
                match (self, a, b) {
                    $($((Self::$two, StepOperand::$a, StepOperand::$b) => Some(StepCode::$code),)*)*
                    _ => None,
                }
            }
        }

        impl FormulaStep {
            /// The words that it reads.
            pub(super) fn words(&self) -> [Option<u32>; 2] {
                match self.code {
                    $($(StepCode::$code => {
                        [number_of!(Word $a self.a), number_of!(Word $b self.b)]
                    })*)*
                    $(StepCode::$load => [number_of!(Word $from self.a), None],)*
                    $(StepCode::$one)|*
                    | $(StepCode::$save)|*
                    | $(StepCode::$other)|* => [None, None],
                }
            }

            /// The step without the cells that it reads; `None` if it cannot be executed for many
            /// formulas at once.
            pub(super) fn shape(&self) -> Option<StepShape> {
                let slots = match self.code {
                    $($(StepCode::$code => {
                        [number_of!(Slot $a self.a), number_of!(Slot $b self.b)]
                    })*)*
                    $(StepCode::$load => [number_of!(Slot $from self.a), None],)*
                    $(StepCode::$one)|* | $(StepCode::$save)|* => [None, None],
                    $(StepCode::$other)|* => return None,
                };
                Some(StepShape { code: self.code, to: self.to, slots })
            }
        }
    };
}

/// A code in parts, for a reader that is no executor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CodeParts {
    /// An operator, and the places of its operands.
    Two(PairOperator, StepOperand, StepOperand),
    /// An operator or function of the accumulator.
    One(OneOperator),
    /// A load.
    Load(StepLoad),
    /// A save.
    Save(StepSave),
    /// Any other code.
    Other(OtherStep),
}

/// The common part of steps that differ only in their cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StepShape {
    code: StepCode,
    to: u32,
    slots: [Option<u32>; 2],
}

impl StepShape {
    /// The greatest slot number in it.
    fn slot(&self) -> u32 {
        let [a, b] = self.slots;
        self.to.max(a.unwrap_or(0)).max(b.unwrap_or(0))
    }
}

/// The shapes of a formula's steps; `None` if they cannot be executed for many formulas at once.
pub fn shapes(steps: &[FormulaStep]) -> Option<Vec<StepShape>> {
    if steps.len() > COLUMN_STEPS {
        return None;
    }
    let shapes: Option<Vec<StepShape>> = steps.iter().map(FormulaStep::shape).collect();
    shapes.filter(|shapes| shapes.iter().all(|shape| (shape.slot() as usize) < COLUMN_SLOTS))
}

/// The number of slots that a formula may have in columns.
pub(super) const COLUMN_SLOTS: usize = 16;

/// The number of steps that a formula may have in columns.
const COLUMN_STEPS: usize = 64;

for_each_code!(codes);

/// The array from which a step reads an element.
pub(super) fn cells(step: FormulaStep) -> CellRange {
    CellRange { first: step.a, count: step.b }
}
