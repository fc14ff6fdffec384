//! MATH: a formula as steps on slots, and their execution.
//!
//! `lower` makes the steps of an expression: each is one operator with its operands, so that an
//! operator takes one dispatch and its operands none. A slot holds a number of either type; the
//! code of a step gives the type. An operand is a slot, or a word of the image (a constant is such
//! a word too). The last step of a formula puts the result into its target.
//!
//! Behaviour: `docs/semantics.md`, section 8. The arithmetic is in `integer` and `real`.

use super::memory::View;
use super::mishap::{Mishap, Mishaps};
use super::places::Target;
use super::power::Leg;
use super::reach::Reach;
use super::role::{BitOwn, BitRead, BitWritten, Reads, Role, Touches, WordRead};
use super::{integer, real};
use crate::isa::Real;

/// A MATH: the formula that it evaluates while its leg is ON, and its target.
#[derive(Clone, Copy, Debug)]
pub struct Math {
    /// Its leg.
    pub leg: Leg,
    /// Its first step.
    pub first: u32,
    /// Its number in the program, for the log.
    pub number: u32,
    /// Its target.
    pub put: Put,
    /// The cell of the first status bit, ST0.
    pub status: u32,
}

/// The target of a MATH.
#[derive(Clone, Copy, Debug)]
pub enum Put {
    /// A word of integers: first limited to the range of its memory, then to its tag's limits.
    Word {
        /// The word, with its tag's limits.
        to: Target,
        /// The lower end of the range.
        low: i32,
        /// The upper end of the range.
        high: i32,
    },
    /// A word that holds a real, with the limits of its cell.
    Real(Target),
    /// A bit.
    Bit(BitWritten),
}

/// One step of a formula.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// What it does.
    pub code: Code,
    /// The slot of its result, or the step that a jump goes to.
    pub to: u32,
    /// The slot or cell of its first operand.
    pub a: u32,
    /// The slot or cell of its second operand.
    pub b: u32,
}

/// A number as a slot holds it.
trait Number: Copy {
    fn of_slot(bits: u64) -> Self;
    fn slot(self) -> u64;
    fn of_word(word: i32) -> Self;
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
}

/// Reads an operand: a slot, or a word.
macro_rules! operand {
    (slot $run:ident $at:expr) => {
        Number::of_slot($run.slots[$at as usize])
    };
    (word $run:ident $at:expr) => {
        Number::of_word($run.view.word(WordRead($at)))
    };
}

macro_rules! codes {
    (
        fused { $($fused:ident: $ss:ident $sw:ident $ws:ident $ww:ident = $fused_of:expr;)* }
        two { $($two:ident = $two_of:expr;)* }
        one { $($one:ident = $one_of:expr;)* }
        load { $($load:ident = $load_of:expr;)* }
        other { $($(#[$doc:meta])* $other:ident;)* }
    ) => {
        /// What a step does. Operators without a suffix take slots; of the others a suffix says for
        /// each operand whether it is a slot (s) or a word (w).
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum Code {
            $($ss, $sw, $ws, $ww,)*
            $($two,)*
            $($one,)*
            $($load,)*
            /// No operator.
            Other(Other),
        }

        /// The steps that are no operators.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Other { $($(#[$doc])* $other,)* }

        /// The operators that read words directly.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum Fused { $($fused),* }

        impl Fused {
            /// The code for operands that are words, or else slots.
            pub fn code(self, a_is_word: bool, b_is_word: bool) -> Code {
                match (self, a_is_word, b_is_word) {
                    $((Fused::$fused, false, false) => Code::$ss,
                    (Fused::$fused, false, true) => Code::$sw,
                    (Fused::$fused, true, false) => Code::$ws,
                    (Fused::$fused, true, true) => Code::$ww,)*
                }
            }
        }

        impl Step {
            /// The words that it reads.
            fn words(&self) -> [Option<u32>; 2] {
                let (a, b) = (Some(self.a), Some(self.b));
                match self.code {
                    $(Code::$ss => [None, None],
                    Code::$sw => [None, b],
                    Code::$ws => [a, None],
                    Code::$ww => [a, b],)*
                    $(Code::$load => [a, None],)*
                    $(Code::$two)|* | $(Code::$one)|* | Code::Other(_) => [None, None],
                }
            }
        }

        impl<R: Reach> Run<'_, '_, R> {
            /// Executes a step of a formula; returns whether it was the last one.
            #[inline(always)]
            fn step(&mut self, step: Step, math: &Math, noted: &mut Mishaps) -> bool {
                let Step { code, to, a, b } = step;
                let result = match code {
                    $(
                        Code::$ss => {
                            $fused_of(operand!(slot self a), operand!(slot self b), noted).slot()
                        }
                        Code::$sw => {
                            $fused_of(operand!(slot self a), operand!(word self b), noted).slot()
                        }
                        Code::$ws => {
                            $fused_of(operand!(word self a), operand!(slot self b), noted).slot()
                        }
                        Code::$ww => {
                            $fused_of(operand!(word self a), operand!(word self b), noted).slot()
                        }
                    )*
                    $(Code::$two => {
                        $two_of(operand!(slot self a), operand!(slot self b), noted).slot()
                    })*
                    $(Code::$one => $one_of(operand!(slot self a), noted).slot(),)*
                    $(Code::$load => $load_of(self.view.word(WordRead(a))).slot(),)*
                    Code::Other(other) => return self.other(other, step, (math, noted)),
                };
                self.slots[to as usize] = result;
                false
            }
        }
    };
}

codes! {
    fused {
        Add: AddSs AddSw AddWs AddWw = integer::add;
        Sub: SubSs SubSw SubWs SubWw = integer::sub;
        Mul: MulSs MulSw MulWs MulWw = integer::mul;
        Div: DivSs DivSw DivWs DivWw = integer::div;
        Rem: RemSs RemSw RemWs RemWw = integer::rem;
        And: AndSs AndSw AndWs AndWw = integer::and;
        Or: OrSs OrSw OrWs OrWw = integer::or;
        Equal: EqualSs EqualSw EqualWs EqualWw = integer::equal;
        NotEqual: NotEqualSs NotEqualSw NotEqualWs NotEqualWw = integer::not_equal;
        Less: LessSs LessSw LessWs LessWw = integer::less;
        AtMost: AtMostSs AtMostSw AtMostWs AtMostWw = integer::at_most;
        RealAdd: RealAddSs RealAddSw RealAddWs RealAddWw = real::add;
        RealSub: RealSubSs RealSubSw RealSubWs RealSubWw = real::sub;
        RealMul: RealMulSs RealMulSw RealMulWs RealMulWw = real::mul;
        RealDiv: RealDivSs RealDivSw RealDivWs RealDivWw = real::div;
        RealEqual: RealEqualSs RealEqualSw RealEqualWs RealEqualWw = real::equal;
        RealNotEqual: RealNotEqualSs RealNotEqualSw RealNotEqualWs RealNotEqualWw = real::not_equal;
        RealLess: RealLessSs RealLessSw RealLessWs RealLessWw = real::less;
        RealAtMost: RealAtMostSs RealAtMostSw RealAtMostWs RealAtMostWw = real::at_most;
    }
    two {
        Pow = integer::pow;
        Xor = integer::xor;
        ShiftLeft = integer::shift_left;
        ShiftRight = integer::shift_right;
        ShiftRightZeros = integer::shift_right_zeros;
        Min = integer::min;
        Max = integer::max;
        RealRem = real::rem;
        RealPow = real::pow;
        RealMin = real::min;
        RealMax = real::max;
        Atan2 = real::atan2;
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
        Truth = truth;
        Not = |a: i64, noted: &mut Mishaps| 1 - truth(a, noted);
    }
    load {
        LoadWord = i64::from;
        LoadWordAsReal = f64::from;
        LoadReal = <f64 as Number>::of_word;
    }
    other {
        /// The bit `a`, as 0 or 1.
        LoadBit;
        /// The bit `a`, a status bit of a mishap: ON as well if the formula has had it already.
        LoadMishap;
        /// Copies the slot `a`.
        Copy;
        /// Goes to a step.
        Jump;
        /// Goes to a step if the slot `a` is 0.
        JumpIfZero;
        /// Puts 1 in the slot `a` and goes to a step, unless it is 0.
        JumpIfTrue;
        /// The last step: stores the integer of the slot `a`.
        PutInteger;
        /// The last step: stores the real of the slot `a`.
        PutReal;
    }
}

/// Whether a number of either type is not 0: no bit of 0 is set, since a real is never -0.
#[inline(always)]
fn truth(slot: i64, _: &mut Mishaps) -> i64 {
    i64::from(slot != 0)
}

/// The state of the formulas of a program between two scans, and in one.
#[derive(Debug)]
pub(super) struct Calculator {
    slots: Box<[u64]>,
}

impl Calculator {
    /// With slots for the formula that needs the most.
    pub fn new(slots: u32) -> Calculator {
        Calculator { slots: vec![0; slots as usize].into() }
    }

    /// Executes MATHs; `report` gets the number of each that had a mishap.
    pub fn run<R: Reach>(
        &mut self,
        (maths, steps): (&[Math], &[Step]),
        view: View<R>,
        mut report: impl FnMut(u32, Mishaps),
    ) {
        // Apart from the run: only the address of the mishaps is handed to functions, so that all
        // else stays in registers.
        let mut mishaps = Mishaps::default();
        let mut run = Run { slots: &mut self.slots, view, at: 0 };
        for math in maths {
            if run.view.leg(&math.leg) == 0 {
                continue;
            }
            run.at = math.first as usize;
            loop {
                let step = steps[run.at];
                run.at += 1;
                if run.step(step, math, &mut mishaps) {
                    break;
                }
            }
            if !mishaps.is_empty() {
                let noted = std::mem::take(&mut mishaps);
                for mishap in noted.each() {
                    run.view.put_own(BitOwn(math.status + mishap.status()), 1);
                }
                report(math.number, noted);
            }
        }
    }
}

/// The execution of a batch.
struct Run<'a, 'v, R: Reach> {
    slots: &'a mut [u64],
    view: View<'v, R>,
    /// The next step.
    at: usize,
}

impl<R: Reach> Run<'_, '_, R> {
    /// A step that is no operator; returns whether it was the last one.
    #[inline(always)]
    fn other(
        &mut self,
        other: Other,
        Step { to, a, .. }: Step,
        (math, noted): (&Math, &mut Mishaps),
    ) -> bool {
        let slot = self.slots.get(a as usize).copied().unwrap_or(0);
        match other {
            Other::LoadBit => self.slots[to as usize] = u64::from(self.view.bit(BitRead(a))),
            Other::LoadMishap => {
                let is_noted = noted.has_status(a - math.status);
                self.slots[to as usize] = u64::from(self.view.bit(BitRead(a)) != 0 || is_noted);
            }
            Other::Copy => self.slots[to as usize] = slot,
            Other::Jump => self.at = to as usize,
            Other::JumpIfZero => {
                if slot == 0 {
                    self.at = to as usize;
                }
            }
            Other::JumpIfTrue => {
                if slot != 0 {
                    self.slots[a as usize] = 1;
                    self.at = to as usize;
                }
            }
            Other::PutInteger => {
                self.put(&math.put, Number::of_slot(slot), noted);
                return true;
            }
            Other::PutReal => {
                self.put_real(&math.put, Number::of_slot(slot), noted);
                return true;
            }
        }
        false
    }

    /// Stores an integer.
    #[inline(always)]
    fn put(&mut self, put: &Put, value: i64, noted: &mut Mishaps) {
        match put {
            Put::Word { to, low, high } => {
                let limited = integer::within(value, *low, *high, noted);
                self.view.put_word(to.word, limited.max(to.min).min(to.max));
            }
            Put::Real(_) => self.put_real(put, value as f64, noted),
            Put::Bit(bit) => self.view.put_bit(*bit, u8::from(value != 0)),
        }
    }

    /// Stores a real.
    #[inline(always)]
    fn put_real(&mut self, put: &Put, value: f64, noted: &mut Mishaps) {
        match put {
            // Stays at the limits of 64 bits, which are beyond those of every word.
            Put::Word { to, low, high } => {
                let limited = integer::within(value as i64, *low, *high, noted);
                self.view.put_word(to.word, limited.max(to.min).min(to.max));
            }
            Put::Real(to) => {
                let (nearest, beyond) = Real::stored(value);
                if beyond {
                    noted.note(Mishap::Overflow);
                }
                self.view.put_word(to.word, nearest.cell().max(to.min).min(to.max));
            }
            Put::Bit(bit) => self.view.put_bit(*bit, u8::from(value != 0.0)),
        }
    }
}

/// The cells that the steps of a formula read.
pub fn reads(steps: &[Step]) -> Reads {
    let reads_bit =
        |step: &&Step| matches!(step.code, Code::Other(Other::LoadBit | Other::LoadMishap));
    let bits = steps.iter().filter(reads_bit).map(|step| step.a);
    let words = steps.iter().flat_map(|step| step.words().into_iter().flatten());
    Reads { bits: bits.collect(), words: words.collect() }
}

/// The cells of its leg, of its formula and its target, and the status bits.
impl Role for Math {
    fn touches(&self, t: &mut Touches) {
        self.leg.touches(t);
        let reads = &t.formulas[self.number as usize];
        t.bits_read.extend(&reads.bits);
        t.words_read.extend(&reads.words);
        match self.put {
            Put::Word { to, .. } | Put::Real(to) => to.touches(t),
            Put::Bit(bit) => bit.touches(t),
        }
        for mishap in Mishap::ALL {
            BitOwn(self.status + mishap.status()).touches(t);
        }
    }
}
