//! The types of parameters, and the places that accept a parameter of each type.

use crate::source::record::Records;
use crate::source::tag::TYPE_NAMES;
use rungd_engine::isa::OperandKind;

/// The type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum ParameterKind {
    Contact,
    Bit,
    Int,
    Real,
    Duration,
    Output,
    IntOut,
    RealOut,
    Timer,
    Counter,
    Sensaphone,
    Array,
    /// A record; the parameter's `type` is its name.
    Record,
}

/// The values of `type`, but for records.
pub const KINDS: [(&str, ParameterKind); 12] = [
    ("contact", ParameterKind::Contact),
    ("bit", ParameterKind::Bit),
    ("int", ParameterKind::Int),
    ("real", ParameterKind::Real),
    ("duration", ParameterKind::Duration),
    ("output", ParameterKind::Output),
    ("int-out", ParameterKind::IntOut),
    ("real-out", ParameterKind::RealOut),
    ("timer", ParameterKind::Timer),
    ("counter", ParameterKind::Counter),
    ("sensaphone", ParameterKind::Sensaphone),
    ("array", ParameterKind::Array),
];

/// The kind of operand that a place requires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum WantedOperand {
    /// A bit, to read.
    Bit,
    WrittenBit,
    /// A number, to read.
    Number,
    Whole,
    Real,
    WrittenWord,
    WrittenWhole,
    WrittenReal,
    /// The target of MATH.
    Target,
    /// An operand of MATH.
    Operand,
    Timer,
    Counter,
    Sensaphone,
    Array,
    /// A whole array, or a record of the same type.
    Copied,
    Record,
    /// A Program or Task.
    Block,
    /// Not known: the instruction has a mistake.
    Any,
}

/// Whether tags or parameters have this type, which is no record.
pub fn is_type_name(name: &str) -> bool {
    TYPE_NAMES.contains(&name) || ParameterKind::from_name(name).is_some()
}

impl ParameterKind {
    /// The type with this name, which is no record.
    pub fn from_name(name: &str) -> Option<ParameterKind> {
        KINDS.iter().find(|(kind_name, _)| *kind_name == name).map(|(_, kind)| *kind)
    }

    /// The type with this name, which may be a record's.
    pub fn of(name: &str, records: &Records) -> Option<ParameterKind> {
        let record = || records.contains_key(name).then_some(ParameterKind::Record);
        ParameterKind::from_name(name).or_else(record)
    }

    /// The type that a parameter for a field of a record would have: everything in a record is
    /// writable. `name`: the field's type.
    pub fn of_field(name: &str) -> Option<ParameterKind> {
        Some(match name {
            "bit" => ParameterKind::Output,
            "int" | "word" => ParameterKind::IntOut,
            "real" => ParameterKind::RealOut,
            "timer" => ParameterKind::Timer,
            "counter" => ParameterKind::Counter,
            "sensaphone" => ParameterKind::Sensaphone,
            _ => return None,
        })
    }

    /// A field for which a parameter would have this type, in words: `a bit`.
    pub fn field_words(self) -> &'static str {
        match self {
            ParameterKind::Output => "a bit",
            ParameterKind::IntOut => "an integer word",
            ParameterKind::RealOut => "a real",
            ParameterKind::Contact
            | ParameterKind::Bit
            | ParameterKind::Int
            | ParameterKind::Real
            | ParameterKind::Duration
            | ParameterKind::Timer
            | ParameterKind::Counter
            | ParameterKind::Sensaphone
            | ParameterKind::Array
            | ParameterKind::Record => self.words(),
        }
    }

    /// In words: `a bit`.
    pub fn words(self) -> &'static str {
        match self {
            ParameterKind::Contact => "contacts",
            ParameterKind::Bit => "a bit to read",
            ParameterKind::Int => "a whole number to read",
            ParameterKind::Real => "a real to read",
            ParameterKind::Duration => "a duration to read",
            ParameterKind::Output => "an output bit",
            ParameterKind::IntOut => "an integer word to write",
            ParameterKind::RealOut => "an R word to write",
            ParameterKind::Timer => "a timer",
            ParameterKind::Counter => "a counter",
            ParameterKind::Sensaphone => "a Sensaphone counter",
            ParameterKind::Array => "an array",
            ParameterKind::Record => "a record",
        }
    }

    /// An example of an argument, for a help.
    pub fn example(self) -> &'static str {
        match self {
            ParameterKind::Contact => "auto & !stop",
            ParameterKind::Bit => "X0",
            ParameterKind::Int => "12",
            ParameterKind::Real => "1.5",
            ParameterKind::Duration => "3s",
            ParameterKind::Output => "Y0",
            ParameterKind::IntOut => "D0",
            ParameterKind::RealOut => "R0",
            ParameterKind::Timer => "T0",
            ParameterKind::Counter => "CT0",
            ParameterKind::Sensaphone => "N0",
            ParameterKind::Array => "recipe",
            ParameterKind::Record => "recipe[2]",
        }
    }

    /// The type of a tag that is a valid argument; `None` if there is no such type, and for a
    /// record, whose name is the type.
    pub fn trial_type(self) -> Option<&'static str> {
        Some(match self {
            ParameterKind::Contact | ParameterKind::Bit | ParameterKind::Output => "bit",
            ParameterKind::Int | ParameterKind::Duration | ParameterKind::IntOut => "int",
            ParameterKind::Real | ParameterKind::RealOut => "real",
            ParameterKind::Timer => "timer",
            ParameterKind::Counter => "counter",
            ParameterKind::Sensaphone => "sensaphone",
            ParameterKind::Array | ParameterKind::Record => return None,
        })
    }

    /// The kind of operand that an argument for it must be.
    pub fn wanted(self) -> WantedOperand {
        match self {
            ParameterKind::Contact | ParameterKind::Bit => WantedOperand::Bit,
            ParameterKind::Int | ParameterKind::Duration => WantedOperand::Whole,
            ParameterKind::Real => WantedOperand::Real,
            ParameterKind::Output => WantedOperand::WrittenBit,
            ParameterKind::IntOut => WantedOperand::WrittenWhole,
            ParameterKind::RealOut => WantedOperand::WrittenReal,
            ParameterKind::Timer => WantedOperand::Timer,
            ParameterKind::Counter => WantedOperand::Counter,
            ParameterKind::Sensaphone => WantedOperand::Sensaphone,
            ParameterKind::Array => WantedOperand::Array,
            ParameterKind::Record => WantedOperand::Record,
        }
    }

    /// Whether such a place accepts a bit of the parameter, which is a word.
    pub fn fits_bit(self, wanted: WantedOperand) -> bool {
        let reads = matches!(
            wanted,
            WantedOperand::Bit
                | WantedOperand::Number
                | WantedOperand::Operand
                | WantedOperand::Any
        );
        let writes = matches!(wanted, WantedOperand::WrittenBit | WantedOperand::Target);
        match self {
            ParameterKind::Int | ParameterKind::Duration => reads,
            ParameterKind::IntOut => reads || writes,
            ParameterKind::Contact
            | ParameterKind::Bit
            | ParameterKind::Output
            | ParameterKind::Real
            | ParameterKind::RealOut
            | ParameterKind::Timer
            | ParameterKind::Counter
            | ParameterKind::Sensaphone
            | ParameterKind::Array
            | ParameterKind::Record => false,
        }
    }

    /// Whether such a place accepts the parameter; `member` is whether the parameter has a member
    /// behind it.
    pub fn fits(self, wanted: WantedOperand, member: bool) -> bool {
        let any = wanted == WantedOperand::Any;
        let reads_bit = matches!(wanted, WantedOperand::Bit | WantedOperand::Operand);
        let reads = matches!(wanted, WantedOperand::Number | WantedOperand::Operand);
        let writes = matches!(wanted, WantedOperand::WrittenWord | WantedOperand::Target);
        let own = match self {
            ParameterKind::Contact => return false,
            ParameterKind::Bit => reads_bit,
            ParameterKind::Output => {
                reads_bit || matches!(wanted, WantedOperand::WrittenBit | WantedOperand::Target)
            }
            ParameterKind::Int | ParameterKind::Duration => reads || wanted == WantedOperand::Whole,
            ParameterKind::Real => reads || wanted == WantedOperand::Real,
            ParameterKind::IntOut => {
                reads
                    || writes
                    || matches!(wanted, WantedOperand::Whole | WantedOperand::WrittenWhole)
            }
            ParameterKind::RealOut => {
                reads
                    || writes
                    || matches!(wanted, WantedOperand::Real | WantedOperand::WrittenReal)
            }
            ParameterKind::Timer | ParameterKind::Counter | ParameterKind::Sensaphone if member => {
                use WantedOperand::{Array, Block, Copied, Record};
                !matches!(wanted, Block | Array | Copied | Record)
            }
            ParameterKind::Timer => wanted == WantedOperand::Timer,
            ParameterKind::Counter => wanted == WantedOperand::Counter,
            ParameterKind::Sensaphone => wanted == WantedOperand::Sensaphone,
            ParameterKind::Array => {
                matches!(wanted, WantedOperand::Array | WantedOperand::Copied)
            }
            ParameterKind::Record => {
                matches!(wanted, WantedOperand::Record | WantedOperand::Copied)
            }
        };
        let has_members = matches!(
            self,
            ParameterKind::Timer | ParameterKind::Counter | ParameterKind::Sensaphone
        );
        (own || any) && (has_members || !member)
    }
}

impl WantedOperand {
    /// The kind of an instruction's operand; `None` for a Stage, which cannot be a parameter.
    pub fn of(kind: OperandKind) -> Option<WantedOperand> {
        Some(match kind {
            OperandKind::WritableBit => WantedOperand::WrittenBit,
            OperandKind::WritableWord => WantedOperand::WrittenWord,
            OperandKind::Target => WantedOperand::Target,
            OperandKind::Array | OperandKind::WritableArray => WantedOperand::Copied,
            OperandKind::Bits | OperandKind::WritableBits | OperandKind::Shifted => {
                WantedOperand::Array
            }
            OperandKind::Filling => WantedOperand::Operand,
            OperandKind::Counter => WantedOperand::Counter,
            OperandKind::Timer => WantedOperand::Timer,
            OperandKind::Sensaphone => WantedOperand::Sensaphone,
            OperandKind::Number
            | OperandKind::Value(..)
            | OperandKind::Duration
            | OperandKind::Interval => WantedOperand::Number,
            OperandKind::Program
            | OperandKind::Block
            | OperandKind::Task
            | OperandKind::Subroutine => WantedOperand::Block,
            OperandKind::Stage | OperandKind::Stages => return None,
        })
    }

    /// In words: `a bit`.
    pub fn words(self) -> &'static str {
        match self {
            WantedOperand::Bit => "a bit",
            WantedOperand::WrittenBit => "a bit to write",
            WantedOperand::Number | WantedOperand::Any => "a number",
            WantedOperand::Whole => "a whole number",
            WantedOperand::Real => "a real",
            WantedOperand::WrittenWord => "a word to write",
            WantedOperand::WrittenWhole => "an integer word to write",
            WantedOperand::WrittenReal => "an R word to write",
            WantedOperand::Target => "a word or bit to write",
            WantedOperand::Operand => "a value",
            WantedOperand::Timer => "a timer",
            WantedOperand::Counter => "a counter",
            WantedOperand::Sensaphone => "a Sensaphone counter",
            WantedOperand::Array | WantedOperand::Copied => "an array",
            WantedOperand::Record => "a record",
            WantedOperand::Block => "a program or task",
        }
    }

    /// The type of a parameter that such a place accepts, for a help.
    pub fn type_name(self) -> Option<&'static str> {
        Some(match self {
            WantedOperand::Bit => "bit",
            WantedOperand::WrittenBit | WantedOperand::Target => "output",
            WantedOperand::Number | WantedOperand::Whole | WantedOperand::Operand => "int",
            WantedOperand::Real => "real",
            WantedOperand::WrittenWord | WantedOperand::WrittenWhole => "int-out",
            WantedOperand::WrittenReal => "real-out",
            WantedOperand::Timer => "timer",
            WantedOperand::Counter => "counter",
            WantedOperand::Sensaphone => "sensaphone",
            WantedOperand::Array | WantedOperand::Copied => "array",
            WantedOperand::Record | WantedOperand::Block | WantedOperand::Any => return None,
        })
    }
}
