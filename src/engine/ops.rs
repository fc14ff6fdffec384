//! The operations: one small struct a kind, a table a kind, and what each reads and writes.
//!
//! Contacts become [`And2`]..[`And4`] (an OR is an AND of opposites, read as its opposite), edges
//! and compares, each writing a private *power* cell; an instruction reads each of its legs as two
//! powers ANDed. How an operation runs stands beside its siblings, in `logic`,
//! `counters`, `timers`, `sensaphone` and `control`.

use std::ops::Range;

use super::memory::{RECORD, View};
use super::reach::Reach;

/// A bit to be read as it is or as its opposite: twice the cell, plus 1 for the opposite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Power(pub u32);

impl Power {
    /// The bit as it is.
    pub fn of(cell: u32) -> Power {
        Power(cell << 1)
    }

    /// Its opposite.
    pub fn opposite(self) -> Power {
        Power(self.0 ^ 1)
    }

    /// The cell it reads.
    pub fn cell(self) -> u32 {
        self.0 >> 1
    }

    /// Whether it reads the opposite.
    pub fn is_opposite(self) -> bool {
        self.0 & 1 == 1
    }
}

/// What an instruction reads of a leg: two powers, both ON where the leg is; of a leg that comes
/// down to one power, that one twice. So the last AND of a leg is no operation of its own.
pub type Leg = Powers<2>;

impl Leg {
    /// The leg that is just this power.
    pub fn of(power: Power) -> Leg {
        Powers::new([power, power])
    }
}

/// Powers to be ANDed, as a loop reads them: cells, and apart from them which are opposites.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Powers<const N: usize> {
    pub(super) cells: [u32; N],
    /// 1 where the opposite is meant.
    pub(super) opposites: [u8; N],
}

impl<const N: usize> Powers<N> {
    /// These powers.
    pub fn new(powers: [Power; N]) -> Powers<N> {
        Powers {
            cells: powers.map(Power::cell),
            opposites: powers.map(|p| u8::from(p.is_opposite())),
        }
    }

    /// Each of them.
    pub fn each(self) -> [Power; N] {
        std::array::from_fn(|at| Power(self.cells[at] << 1 | u32::from(self.opposites[at])))
    }
}

/// What an operation reads and writes, by cell: what the scheduler must keep in order.
#[derive(Clone, Debug, Default)]
pub struct Touches {
    /// Bits read.
    pub bits_read: Vec<u32>,
    /// Bits written, always or sometimes.
    pub bits_written: Vec<u32>,
    /// Words read.
    pub words_read: Vec<u32>,
    /// Words written, always or sometimes.
    pub words_written: Vec<u32>,
}

impl Touches {
    /// Forgets everything.
    pub fn clear(&mut self) {
        self.bits_read.clear();
        self.bits_written.clear();
        self.words_read.clear();
        self.words_written.clear();
    }

    pub(super) fn cells(&mut self, cells: &[u32]) -> &mut Touches {
        self.bits_read.extend(cells);
        self
    }

    pub(super) fn legs(&mut self, legs: &[Leg]) -> &mut Touches {
        for leg in legs {
            self.cells(&leg.cells);
        }
        self
    }

    pub(super) fn reads(&mut self, words: &[u32]) -> &mut Touches {
        self.words_read.extend(words);
        self
    }

    pub(super) fn writes_bits(&mut self, bits: &[u32]) -> &mut Touches {
        self.bits_written.extend(bits);
        self
    }

    pub(super) fn writes_words(&mut self, words: &[u32]) -> &mut Touches {
        self.words_written.extend(words);
        self
    }

    /// The four flags of a counter or timer.
    pub(super) fn writes_flags(&mut self, record: u32) -> &mut Touches {
        let first = record * RECORD as u32;
        self.bits_written.extend(first..first + 4);
        self
    }
}

/// An operation that works on memory alone.
pub(super) trait Operation {
    /// Executes it.
    fn run<R: Reach>(&self, view: &mut View<R>);
    /// Adds what it reads and writes.
    fn touches(&self, t: &mut Touches);
}

macro_rules! kinds {
    ($($kind:ident $table:ident, $doc:literal;)*) => {
        /// The kinds of operations, but control.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Kind { $(#[doc = $doc] $kind,)* /// Blocks and Stages; never in a batch of two.
            Control }

        /// Any operation.
        #[derive(Clone, Debug)]
        pub enum Op { $(#[doc = $doc] $kind($kind),)* /// Blocks and Stages.
            Control(Control) }

        /// All operations of a program, a table a kind, in the order of execution.
        #[derive(Clone, Debug, Default)]
        #[allow(missing_docs)]
        pub struct OpTables { $(pub $table: Vec<$kind>,)* pub control: Vec<Control> }

        impl Op {
            /// Its kind.
            pub fn kind(&self) -> Kind {
                match self { $(Op::$kind(_) => Kind::$kind,)* Op::Control(_) => Kind::Control }
            }

            /// Adds what it reads and writes. Control touches what no list says: nothing may
            /// pass it.
            pub fn touches(&self, t: &mut Touches) {
                match self { $(Op::$kind(op) => op.touches(t),)* Op::Control(_) => {} }
            }
        }

        impl OpTables {
            /// Appends an operation to the table of its kind; gives its place there.
            pub fn push(&mut self, op: Op) -> u32 {
                match op {
                    $(Op::$kind(op) => { self.$table.push(op); self.$table.len() as u32 - 1 })*
                    Op::Control(op) => {
                        self.control.push(op);
                        self.control.len() as u32 - 1
                    }
                }
            }

            /// Executes a batch of one kind; not for control.
            pub(super) fn run<R: Reach>(&self, kind: Kind, at: Range<usize>, view: View<R>) {
                match kind {
                    $(Kind::$kind => run_all::<R, $kind>(&self.$table[at], view),)*
                    Kind::Control => unreachable!("control is executed by the blocks"),
                }
            }
        }
    };
}

/// A function of its own, so that the loop's pointers have all registers to themselves.
#[inline(never)]
fn run_all<R: Reach, O: Operation>(ops: &[O], mut view: View<R>) {
    for op in ops {
        op.run(&mut view);
    }
}

kinds! {
    And2 and2, "ANDs two powers.";
    And3 and3, "ANDs three powers.";
    And4 and4, "ANDs four powers.";
    Rise rise, "An OFF-to-ON edge of a bit.";
    Fall fall, "An ON-to-OFF edge of a bit.";
    Equal equal, "Whether two words are equal.";
    Less less, "Whether one word is less than another.";
    Out out, "OUT.";
    OutOne out_one, "OUT of one power.";
    Set set, "SET.";
    Rst rst, "RST.";
    Pd pd, "PD.";
    Nd nd, "ND.";
    Ponoff ponoff, "PONOFF.";
    Cnt cnt, "CNT.";
    Cntdn cntdn, "CNTDN.";
    Udc udc, "UDC and UDCG.";
    Rstct rstct, "RSTCT.";
    Ondtmr ondtmr, "ONDTMR.";
    Offdtmr offdtmr, "OFFDTMR.";
    Tmr tmr, "TMR.";
    Tmrdown tmrdown, "TMRDOWN.";
    Tmra tmra, "TMRA and TMRAG.";
    Tmradown tmradown, "TMRADOWN.";
    Rstt rstt, "RSTT.";
    Ctu ctu, "CTU.";
    Ctd ctd, "CTD.";
    Res res, "RES.";
    Move mov, "MOVE.";
    Add add, "ADD.";
    Sub sub, "SUB.";
}

pub use super::control::{Control, ControlKind, RestartState, StageList};
pub use super::counters::{Cnt, Cntdn, Counter, CounterRule, Rstct, Udc, UdcPresets};
pub use super::logic::{
    Add, And2, And3, And4, Equal, Fall, Less, Move, Nd, Out, OutOne, Pd, Ponoff, Rise, Rst, Set,
    Sub, Target,
};
pub use super::sensaphone::{Ctd, Ctu, Res, Sensaphone};
pub use super::timers::{Offdtmr, Ondtmr, Rstt, Timer, TimerRule, Tmr, Tmra, Tmradown, Tmrdown};
