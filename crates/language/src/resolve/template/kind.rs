//! The types of parameters, and the places that accept a parameter of each type.

use rungd_engine::isa::OperandKind;

/// The type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Kind {
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
}

/// The values of `type`.
pub const KINDS: [(&str, Kind); 12] = [
    ("contact", Kind::Contact),
    ("bit", Kind::Bit),
    ("int", Kind::Int),
    ("real", Kind::Real),
    ("duration", Kind::Duration),
    ("output", Kind::Output),
    ("int-out", Kind::IntOut),
    ("real-out", Kind::RealOut),
    ("timer", Kind::Timer),
    ("counter", Kind::Counter),
    ("sensaphone", Kind::Sensaphone),
    ("array", Kind::Array),
];

/// The kind of operand that a place requires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Wanted {
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
    /// A Program or Task.
    Block,
    /// Not known: the instruction has a mistake.
    Any,
}

impl Kind {
    /// The type with this name.
    pub fn from_name(name: &str) -> Option<Kind> {
        KINDS.iter().find(|(of, _)| *of == name).map(|(_, kind)| *kind)
    }

    /// In words: `a bit`.
    pub fn words(self) -> &'static str {
        match self {
            Kind::Contact => "contacts",
            Kind::Bit => "a bit to read",
            Kind::Int => "a whole number to read",
            Kind::Real => "a real to read",
            Kind::Duration => "a duration to read",
            Kind::Output => "an output bit",
            Kind::IntOut => "an integer word to write",
            Kind::RealOut => "an R word to write",
            Kind::Timer => "a timer",
            Kind::Counter => "a counter",
            Kind::Sensaphone => "a Sensaphone counter",
            Kind::Array => "an array",
        }
    }

    /// An example of an argument, for a help.
    pub fn example(self) -> &'static str {
        match self {
            Kind::Contact => "auto & !stop",
            Kind::Bit => "X0",
            Kind::Int => "12",
            Kind::Real => "1.5",
            Kind::Duration => "3s",
            Kind::Output => "Y0",
            Kind::IntOut => "D0",
            Kind::RealOut => "R0",
            Kind::Timer => "T0",
            Kind::Counter => "CT0",
            Kind::Sensaphone => "N0",
            Kind::Array => "recipe",
        }
    }

    /// The type of a tag that is a valid argument; `None` if there is no such type.
    pub fn trial_type(self) -> Option<&'static str> {
        Some(match self {
            Kind::Contact | Kind::Bit | Kind::Output => "bit",
            Kind::Int | Kind::Duration | Kind::IntOut => "int",
            Kind::Real | Kind::RealOut => "real",
            Kind::Timer => "timer",
            Kind::Counter => "counter",
            Kind::Sensaphone => "sensaphone",
            Kind::Array => return None,
        })
    }

    /// The kind of operand that an argument for it must be.
    pub fn wanted(self) -> Wanted {
        match self {
            Kind::Contact | Kind::Bit => Wanted::Bit,
            Kind::Int | Kind::Duration => Wanted::Whole,
            Kind::Real => Wanted::Real,
            Kind::Output => Wanted::WrittenBit,
            Kind::IntOut => Wanted::WrittenWhole,
            Kind::RealOut => Wanted::WrittenReal,
            Kind::Timer => Wanted::Timer,
            Kind::Counter => Wanted::Counter,
            Kind::Sensaphone => Wanted::Sensaphone,
            Kind::Array => Wanted::Array,
        }
    }

    /// Whether such a place accepts the parameter; `member` is whether the parameter has a member
    /// behind it.
    pub fn fits(self, wanted: Wanted, member: bool) -> bool {
        let any = wanted == Wanted::Any;
        let reads_bit = matches!(wanted, Wanted::Bit | Wanted::Operand);
        let reads = matches!(wanted, Wanted::Number | Wanted::Operand);
        let writes = matches!(wanted, Wanted::WrittenWord | Wanted::Target);
        let own = match self {
            Kind::Contact => return false,
            Kind::Bit => reads_bit,
            Kind::Output => reads_bit || matches!(wanted, Wanted::WrittenBit | Wanted::Target),
            Kind::Int | Kind::Duration => reads || wanted == Wanted::Whole,
            Kind::Real => reads || wanted == Wanted::Real,
            Kind::IntOut => {
                reads || writes || matches!(wanted, Wanted::Whole | Wanted::WrittenWhole)
            }
            Kind::RealOut => {
                reads || writes || matches!(wanted, Wanted::Real | Wanted::WrittenReal)
            }
            Kind::Timer | Kind::Counter | Kind::Sensaphone if member => {
                !matches!(wanted, Wanted::Block | Wanted::Array)
            }
            Kind::Timer => wanted == Wanted::Timer,
            Kind::Counter => wanted == Wanted::Counter,
            Kind::Sensaphone => wanted == Wanted::Sensaphone,
            Kind::Array => wanted == Wanted::Array,
        };
        let has_members = matches!(self, Kind::Timer | Kind::Counter | Kind::Sensaphone);
        (own || any) && (has_members || !member)
    }
}

impl Wanted {
    /// The kind of an instruction's operand; `None` for a Stage, which cannot be a parameter.
    pub fn of(kind: OperandKind) -> Option<Wanted> {
        Some(match kind {
            OperandKind::WritableBit => Wanted::WrittenBit,
            OperandKind::WritableWord => Wanted::WrittenWord,
            OperandKind::Target => Wanted::Target,
            OperandKind::Array | OperandKind::WritableArray | OperandKind::Shifted => Wanted::Array,
            OperandKind::Filling => Wanted::Operand,
            OperandKind::Counter => Wanted::Counter,
            OperandKind::Timer => Wanted::Timer,
            OperandKind::Sensaphone => Wanted::Sensaphone,
            OperandKind::Number
            | OperandKind::Value(..)
            | OperandKind::Duration
            | OperandKind::Interval => Wanted::Number,
            OperandKind::Program | OperandKind::Block | OperandKind::Task => Wanted::Block,
            OperandKind::Stage | OperandKind::Stages => return None,
        })
    }

    /// In words: `a bit`.
    pub fn words(self) -> &'static str {
        match self {
            Wanted::Bit => "a bit",
            Wanted::WrittenBit => "a bit to write",
            Wanted::Number | Wanted::Any => "a number",
            Wanted::Whole => "a whole number",
            Wanted::Real => "a real",
            Wanted::WrittenWord => "a word to write",
            Wanted::WrittenWhole => "an integer word to write",
            Wanted::WrittenReal => "an R word to write",
            Wanted::Target => "a word or bit to write",
            Wanted::Operand => "a value",
            Wanted::Timer => "a timer",
            Wanted::Counter => "a counter",
            Wanted::Sensaphone => "a Sensaphone counter",
            Wanted::Array => "an array",
            Wanted::Block => "a program or task",
        }
    }

    /// The type of a parameter that such a place accepts, for a help.
    pub fn type_name(self) -> Option<&'static str> {
        Some(match self {
            Wanted::Bit => "bit",
            Wanted::WrittenBit | Wanted::Target => "output",
            Wanted::Number | Wanted::Whole | Wanted::Operand => "int",
            Wanted::Real => "real",
            Wanted::WrittenWord | Wanted::WrittenWhole => "int-out",
            Wanted::WrittenReal => "real-out",
            Wanted::Timer => "timer",
            Wanted::Counter => "counter",
            Wanted::Sensaphone => "sensaphone",
            Wanted::Array => "array",
            Wanted::Block | Wanted::Any => return None,
        })
    }
}
