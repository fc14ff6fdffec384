//! The columns of the instruction table: legs, kinds of operands, effects of a termination pass.
//! `role` has the column of roles.
//!
//! Called by the rows in `instruction_table`; other modules use `instruction`. What an instruction
//! does is not here.

use super::role::OperandRole;
use super::space::Space;

/// A leg of a rung: an input of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)]
pub enum LegName {
    /// The single leg, written `when`.
    When,
    Up,
    Dn,
    Rst,
    En,
    Data,
    Clk,
}

impl LegName {
    /// The legs that are written `leg.…`.
    pub const KEYED: [LegName; 6] =
        [LegName::Up, LegName::Dn, LegName::Rst, LegName::En, LegName::Data, LegName::Clk];

    /// The key in the ladder file: `when`, or the name after `leg.`.
    pub fn key(self) -> &'static str {
        match self {
            LegName::When => "when",
            LegName::Up => "up",
            LegName::Dn => "dn",
            LegName::Rst => "rst",
            LegName::En => "en",
            LegName::Data => "data",
            LegName::Clk => "clk",
        }
    }

    /// The leg with this key after `leg.`.
    pub fn from_key(key: &str) -> Option<LegName> {
        LegName::KEYED.into_iter().find(|l| l.key() == key)
    }
}

/// The kind of an operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OperandKind {
    /// A bit that a program may write: Y, C, MC, MI.
    WritableBit,
    /// A word that a program may write.
    WritableWord,
    /// A word or bit that a program may write, and an expression: `target = expression`.
    Target,
    /// An array, slice or range of bits or words.
    Array,
    /// An array, slice or range of bits or words that a program may write.
    WritableArray,
    /// An array, slice or range of bits.
    Bits,
    /// An array, slice or range of bits that a program may write.
    WritableBits,
    /// An array, slice or range of bits that a program may write; a range may run downwards.
    Shifted,
    /// A value, to fill words; a bit or the constant 0 or 1, to fill bits.
    Filling,
    /// A counter structure `CTn`.
    Counter,
    /// A timer structure `Tn`.
    Timer,
    /// A Sensaphone counter `Nn`.
    Sensaphone,
    /// Any constant, or any readable numeric location; reals too.
    Number,
    /// A whole constant within the range, or any readable location of whole numbers.
    Value(i32, i32),
    /// A duration or an integer in ms, 0..=2147483647, or any readable numeric location.
    Duration,
    /// As [`OperandKind::Duration`], but any `i32` constant: `<= 0` means every scan.
    Interval,
    /// A Program.
    Program,
    /// A Program or a Task.
    Block,
    /// A Task.
    Task,
    /// A subroutine.
    Subroutine,
    /// A Stage of the same Program.
    Stage,
    /// One or more Stages of the same Program.
    Stages,
}

/// One operand of an instruction.
#[derive(Clone, Copy, Debug)]
pub struct OperandSpec {
    /// `None`: positional. `Some(key)`: written `key=value`.
    pub key: Option<&'static str>,
    /// Its name in the resolved instruction; for a keyed operand, the key.
    pub name: &'static str,
    /// What an execution does with it.
    pub role: OperandRole,
    /// Its kind.
    pub kind: OperandKind,
    /// Whether it may be left out.
    pub optional: bool,
}

/// The effect of a termination pass on an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Termination {
    /// The bit it drives goes OFF.
    Off,
    /// Its structure is reset.
    Reset,
    /// The values that it wrote are kept.
    Kept,
    /// It has no termination logic.
    Untouched,
    /// As `Untouched`, but the time until its next execution does not count.
    Held,
    /// As `Untouched`, but its enable bit and its edge history go OFF.
    EnableOff,
    /// The same as an execution with its rung OFF.
    RungOff,
}

impl Termination {
    /// Whether the bit goes OFF, or the structure is reset.
    pub fn switches_off(self) -> bool {
        match self {
            Termination::Off | Termination::Reset => true,
            Termination::Kept
            | Termination::Untouched
            | Termination::Held
            | Termination::EnableOff
            | Termination::RungOff => false,
        }
    }
}

impl OperandKind {
    /// Whether it is a structure of this space.
    pub fn is_structure_of(self, space: Space) -> bool {
        match space {
            Space::Counter => self == OperandKind::Counter,
            Space::Timer => self == OperandKind::Timer,
            Space::Sensaphone => self == OperandKind::Sensaphone,
            Space::Bit(_) | Space::Word(_) => false,
        }
    }

    /// Whether it is a Stage, or several.
    pub fn is_stage(self) -> bool {
        matches!(self, OperandKind::Stage | OperandKind::Stages)
    }

    pub(super) fn placeholder(self) -> &'static str {
        match self {
            OperandKind::WritableBit => "b",
            OperandKind::WritableWord => "w",
            OperandKind::Target => "target = expression",
            OperandKind::Array
            | OperandKind::WritableArray
            | OperandKind::Bits
            | OperandKind::WritableBits
            | OperandKind::Shifted => "a",
            OperandKind::Filling => "v",
            OperandKind::Counter => "ct",
            OperandKind::Timer => "t",
            OperandKind::Sensaphone => "n",
            OperandKind::Number | OperandKind::Value(..) => "v",
            OperandKind::Duration | OperandKind::Interval => "d",
            OperandKind::Program => "p",
            OperandKind::Block => "b",
            OperandKind::Task => "t",
            OperandKind::Subroutine | OperandKind::Stage => "s",
            OperandKind::Stages => "s …",
        }
    }
}
