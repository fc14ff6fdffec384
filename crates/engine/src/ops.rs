//! The operations: one row for each kind, from which a macro makes its struct, its table and its
//! list of touched cells.
//!
//! Contacts become [`And2`]..[`And4`] (an OR is the opposite of an AND of opposites), edges and
//! compares; each writes a private *power* cell. An instruction reads each of its legs as two
//! powers ANDed. The type of a row's field gives its role: an operation can read and write only the
//! cells of its fields. `logic`, `counters`, `timers` and `sensaphone` implement the operations;
//! `blocks` executes control.

use std::ops::Range;

pub use super::array_places::{ArrayLimits, ArrayTarget, ElementType, ShiftState, WordForm};
pub use super::control::{Control, ControlKind, RestartState, StageList};
pub use super::math::{Math, MathReports, MathTarget};
use super::memory::MemoryView;
pub use super::places::{
    AnyTarget, AnyWord, Counter, CounterRule, Sensaphone, Timer, TimerRule, UdcPresets, WordTarget,
};
pub use super::power::{LegPowers, Power, Powers};
use super::reach::Reach;
use super::role::FieldRole;
pub use super::role::{
    AndedPowers, BitMask, BitOwn, BitRead, BitWritten, BitsRead, BitsWritten, CellRange,
    FormulaReads, Formulas, TouchedCells, WordBitWritten, WordRead, WordWritten, WordsRead,
    WordsWritten,
};
pub use super::step_reads::reads;
pub use super::steps::{
    Accumulator, CodeParts, FormulaStep, OneOperator, OtherStep, PairOperator, StepCode, StepLoad,
    StepOperand, StepSave, StepShape, shapes,
};

/// An operation that works only on memory.
pub(super) trait Operation: Sized {
    /// Executes it.
    fn run<R: Reach>(&self, view: &mut MemoryView<R>);

    /// Executes several, one after the other.
    #[inline(always)]
    fn run_each<R: Reach>(ops: &[Self], view: &mut MemoryView<R>) {
        for op in ops {
            op.run(view);
        }
    }
}

macro_rules! operations {
    ($($(#[$doc:meta])* $kind:ident $table:ident { $($field:ident: $role:ty),* })*) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Copy, Debug)]
            #[allow(missing_docs)]
            pub struct $kind { $(pub $field: $role),* }

            impl FieldRole for $kind {
                fn touches(&self, t: &mut TouchedCells) {
                    $(self.$field.touches(t);)*
                }
            }
        )*

        /// The kinds of operations.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum OpKind { $($(#[$doc])* $kind,)* /// MATH.
            Math, /// MATHs whose formulas differ in their cells alone. No operation has this kind.
            Columns, /// Blocks and Stages; never in a batch of two.
            Control }

        /// Any operation.
        #[derive(Clone, Debug)]
        pub enum Op { $($(#[$doc])* $kind($kind),)* /// MATH.
            Math(Math), /// Blocks and Stages.
            Control(Control) }

        /// All operations of a program, one table for each kind, in order of execution.
        #[derive(Clone, Debug, Default)]
        #[allow(missing_docs)]
        pub struct OpTables {
            $(pub $table: Vec<$kind>,)*
            pub math: Vec<Math>,
            pub control: Vec<Control>,
        }

        impl Op {
            /// Its kind.
            pub fn kind(&self) -> OpKind {
                match self {
                    $(Op::$kind(_) => OpKind::$kind,)*
                    Op::Math(_) => OpKind::Math,
                    Op::Control(_) => OpKind::Control,
                }
            }

            /// Adds the cells that it reads and writes. Control adds none: the scheduler moves
            /// nothing past it.
            pub fn touches(&self, t: &mut TouchedCells) {
                match self {
                    $(Op::$kind(op) => op.touches(t),)*
                    Op::Math(op) => op.touches(t),
                    Op::Control(_) => {}
                }
            }
        }

        impl OpTables {
            /// Appends an operation to the table of its kind; returns its index there.
            pub fn push(&mut self, op: Op) -> u32 {
                match op {
                    $(Op::$kind(op) => { self.$table.push(op); self.$table.len() as u32 - 1 })*
                    Op::Math(op) => {
                        self.math.push(op);
                        self.math.len() as u32 - 1
                    }
                    Op::Control(op) => {
                        self.control.push(op);
                        self.control.len() as u32 - 1
                    }
                }
            }

            /// An operation, by its kind and its index in the table of the kind.
            pub fn op(&self, kind: OpKind, at: usize) -> Op {
                match kind {
                    $(OpKind::$kind => Op::$kind(self.$table[at]),)*
                    OpKind::Math | OpKind::Columns => Op::Math(self.math[at]),
                    OpKind::Control => Op::Control(self.control[at]),
                }
            }

            /// Adds the cells that an operation of a kind touches; none for MATH and control.
            pub(super) fn touches(&self, kind: OpKind, at: usize, t: &mut TouchedCells) {
                match kind {
                    $(OpKind::$kind => self.$table[at].touches(t),)*
                    OpKind::Math | OpKind::Columns | OpKind::Control => {}
                }
            }

            /// Executes a batch of one kind, except MATH and control.
            pub(super) fn run<R: Reach>(
                &self,
                kind: OpKind,
                at: Range<usize>,
                view: MemoryView<R>,
            ) {
                match kind {
                    $(OpKind::$kind => run_all::<R, $kind>(&self.$table[at], view),)*
                    OpKind::Math | OpKind::Columns | OpKind::Control => {
                        unreachable!("the blocks execute MATH and control")
                    }
                }
            }
        }
    };
}

/// Not inlined, so that the loop's pointers can use all registers.
#[inline(never)]
fn run_all<R: Reach, O: Operation>(ops: &[O], mut view: MemoryView<R>) {
    O::run_each(ops, &mut view);
}

operations! {
    /// `cell = a & b`.
    And2 and2 { cell: BitOwn, of: Powers<2> }
    /// `cell = a & b & c`.
    And3 and3 { cell: BitOwn, of: Powers<3> }
    /// `cell = a & b & c & d`.
    And4 and4 { cell: BitOwn, of: Powers<4> }
    /// `cell` = the bit of an array that the index selects; OFF if the index is outside.
    PickBit pick_bit { cell: BitOwn, from: BitsRead, index: WordRead }
    /// `cell` = the word of an array that the index selects; 0 if the index is outside.
    PickWord pick_word { cell: WordWritten, from: WordsRead, index: WordRead }
    /// `cell` = a bit of a word.
    LoadWordBit load_word_bit { cell: BitOwn, word: WordRead, bit: BitMask }
    /// `cell` = the bit was OFF at the last evaluation and is now ON.
    Rise rise { cell: BitOwn, bit: BitRead, history: BitOwn }
    /// `cell` = the bit was ON at the last evaluation and is now OFF.
    Fall fall { cell: BitOwn, bit: BitRead, history: BitOwn }
    /// `cell = a == b`. `!=` is read as its opposite.
    Equal equal { cell: BitOwn, a: WordRead, b: WordRead }
    /// `cell = a < b`. `>` swaps a and b; `>=` and `<=` are read as opposites.
    Less less { cell: BitOwn, a: WordRead, b: WordRead }
    /// `cell = a == b`, for an integer and a real.
    EqualMixed equal_mixed { cell: BitOwn, a: AnyWord, b: AnyWord }
    /// `cell = a < b`, for an integer and a real.
    LessMixed less_mixed { cell: BitOwn, a: AnyWord, b: AnyWord }
    /// OUT: writes the power, ON and OFF.
    Out out { leg: LegPowers, bit: BitWritten }
    /// OUT of a leg that is one power.
    OutOne out_one { leg: Powers<1>, bit: BitWritten }
    /// SET: turns the bit ON while the rung is ON.
    Set set { leg: LegPowers, bit: BitWritten }
    /// RST: turns the bit OFF while the rung is ON.
    Rst rst { leg: LegPowers, bit: BitWritten }
    /// OUT of a bit of a word; stores the result of other operations in one, too.
    OutWordBit out_word_bit { leg: LegPowers, bit: WordBitWritten }
    /// SET of a bit of a word.
    SetWordBit set_word_bit { leg: LegPowers, bit: WordBitWritten }
    /// RST of a bit of a word.
    RstWordBit rst_word_bit { leg: LegPowers, bit: WordBitWritten }
    /// PD: writes ON at the execution in which the rung comes ON, OFF at every other.
    Pd pd { leg: LegPowers, bit: BitWritten, history: BitOwn }
    /// ND: writes ON at the execution in which the rung goes OFF, OFF at every other.
    Nd nd { leg: LegPowers, bit: BitWritten, history: BitOwn }
    /// PONOFF: toggles at the rung's rising edge.
    Ponoff ponoff { leg: LegPowers, bit: BitWritten, history: BitOwn }
    /// CNT.
    Cnt cnt { up: LegPowers, rst: LegPowers, counter: Counter, preset: WordRead }
    /// CNTDN.
    Cntdn cntdn { dn: LegPowers, rst: LegPowers, counter: Counter, preset: WordRead }
    /// UDC; also UDCG, with `$Off` as its RST leg.
    Udc udc { up: LegPowers, dn: LegPowers, rst: LegPowers, counter: Counter, presets: UdcPresets }
    /// RSTCT of a counter, by the rule of the counter's owner.
    Rstct rstct { leg: LegPowers, counter: Counter, rule: CounterRule }
    /// ONDTMR.
    Ondtmr ondtmr { leg: LegPowers, timer: Timer, output: BitWritten }
    /// OFFDTMR.
    Offdtmr offdtmr { leg: LegPowers, timer: Timer, output: BitWritten }
    /// TMR.
    Tmr tmr { leg: LegPowers, timer: Timer }
    /// TMRDOWN.
    Tmrdown tmrdown { leg: LegPowers, timer: Timer }
    /// TMRA; also TMRAG, with `$Off` as its RST leg.
    Tmra tmra { en: LegPowers, rst: LegPowers, timer: Timer }
    /// TMRADOWN.
    Tmradown tmradown { en: LegPowers, rst: LegPowers, timer: Timer }
    /// RSTT of a timer, by the rule of the timer's owner.
    Rstt rstt { leg: LegPowers, timer: Timer, rule: TimerRule }
    /// CTU.
    Ctu ctu { leg: LegPowers, counter: Sensaphone }
    /// CTD.
    Ctd ctd { leg: LegPowers, counter: Sensaphone }
    /// RES.
    Res res { leg: LegPowers, counter: Sensaphone }
    /// MOVE: copies a word while the rung is ON.
    Move mov { leg: LegPowers, a: WordRead, to: WordTarget }
    /// ADD: writes a + b while the rung is ON.
    Add add { leg: LegPowers, a: WordRead, b: WordRead, to: WordTarget }
    /// SUB: writes a - b while the rung is ON.
    Sub sub { leg: LegPowers, a: WordRead, b: WordRead, to: WordTarget }
    /// ADD with a real among its words; also MOVE with a real, as the sum with 0.
    AddMixed add_mixed { leg: LegPowers, a: AnyWord, b: AnyWord, to: AnyTarget }
    /// SUB with a real among its words.
    SubMixed sub_mixed { leg: LegPowers, a: AnyWord, b: AnyWord, to: AnyTarget }
    /// COPY of bits.
    CopyBits copy_bits { leg: LegPowers, from: BitsRead, to: BitsWritten }
    /// COPY of words.
    CopyWords copy_words { leg: LegPowers, from: WordsRead, to: WordsWritten, form: WordForm }
    /// FILL of bits.
    FillBits fill_bits { leg: LegPowers, bit: BitRead, to: BitsWritten }
    /// FILL of words.
    FillWords fill_words { leg: LegPowers, word: WordRead, to: WordsWritten, form: WordForm }
    /// PACK; `last`: the last bit's part of the word, which may be the sign.
    PackBits pack_bits { leg: LegPowers, from: BitsRead, last: BitMask, to: WordTarget }
    /// UNPACK.
    UnpackBits unpack_bits { leg: LegPowers, word: WordRead, to: BitsWritten }
    /// SR.
    Sr sr { data: LegPowers, clk: LegPowers, rst: LegPowers, bits: BitsWritten, shift: ShiftState }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_keep_their_size_in_bytes() {
        assert_eq!(size_of::<Op>(), 56);
        assert_eq!(size_of::<FormulaStep>(), 16);
        assert_eq!(size_of::<And2>(), 16);
        assert_eq!(size_of::<Out>(), 16);
        assert_eq!(size_of::<Cnt>(), 32);
    }

    #[test]
    fn an_operation_touches_exactly_the_cells_of_its_fields() {
        let leg = LegPowers::new([Power::of(1), Power::of(2)]);
        let timer = Timer { at: 10, preset: WordRead(20) };
        let op = Op::Ondtmr(Ondtmr { leg, timer, output: BitWritten(3) });
        let mut touches = TouchedCells::default();
        op.touches(&mut touches);
        assert_eq!(touches.bits_read, [1, 2]);
        assert_eq!(touches.bits_written, [80, 81, 82, 83, 3]);
        assert_eq!((touches.words_read, touches.words_written), (vec![20], vec![10]));
    }
}
