//! The properties of a name that matter for an operand: whether it is a bit, a word or a structure,
//! and whether a ladder may write it. Also the properties that a place wants.
//!
//! They are derived from the declarations as written, without checks: a name with an error in its
//! declaration is still offered.

use crate::file::EditorFile;
use crate::names::Declaration;
use crate::slots::DeclaredKind;
use crate::tag_facts::TagFacts;
use rungd_engine::isa::{Address, OperandKind, Structure};
use rungd_language::resolve::ParameterKind;

/// The access that a ladder has to a bit or word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum OperandAccess {
    None,
    Read,
    Write,
}

/// The properties of a name.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nature {
    /// The access to the name as a bit.
    pub bit: OperandAccess,
    /// The access to the name as a word or constant.
    pub word: OperandAccess,
    /// The access to bits after its dot or index.
    pub bits_inside: OperandAccess,
    /// The access to words after its dot or index.
    pub words_inside: OperandAccess,
    /// Its structure, if it is one; always with the number 0.
    pub structure: Option<Structure>,
    /// Whether it is an array.
    pub is_array: bool,
    /// Whether any name may follow its dot, or its kind is unknown.
    pub is_open: bool,
    /// The declaration of the record that is its type.
    pub record: Option<usize>,
}

/// The kind of name that a place wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WantedName {
    /// A contact: a bit, or the first word of a compare.
    Contact,
    /// A contact of a test.
    Condition,
    /// A bit to read.
    Bit,
    /// A number to read.
    Number,
    /// A bit or number to read.
    Value,
    WrittenBit,
    WrittenWord,
    /// A bit or word to write.
    Target,
    Array,
    Structure(Structure),
    /// A record, by the declaration of its type.
    Record(usize),
    Anything,
}

impl Nature {
    const NOTHING: Nature = Nature {
        bit: OperandAccess::None,
        word: OperandAccess::None,
        bits_inside: OperandAccess::None,
        words_inside: OperandAccess::None,
        structure: None,
        is_array: false,
        is_open: false,
        record: None,
    };
    /// A constant.
    pub const CONSTANT: Nature = Nature { word: OperandAccess::Read, ..Nature::NOTHING };
    /// A block or device: it has bits after its dot.
    pub const BITS_INSIDE: Nature = Nature { bits_inside: OperandAccess::Read, ..Nature::NOTHING };
    /// A name that has names of its own after its dot, or an unknown name.
    pub const OPEN: Nature = Nature { is_open: true, ..Nature::NOTHING };
    /// Timers, counters.
    const STRUCTURE: Nature = Nature {
        bits_inside: OperandAccess::Read,
        words_inside: OperandAccess::Write,
        ..Nature::NOTHING
    };

    fn bit(bit: OperandAccess) -> Nature {
        Nature { bit, ..Nature::NOTHING }
    }

    fn word(word: OperandAccess) -> Nature {
        Nature { word, ..Nature::NOTHING }
    }

    /// The properties of an address.
    pub fn of_address(address: Address) -> Nature {
        match address {
            Address::Bit(bit) if bit.writable_by_ladder() => Nature::bit(OperandAccess::Write),
            Address::Bit(_) => Nature::bit(OperandAccess::Read),
            Address::Word(word) if word.writable() => Nature::word(OperandAccess::Write),
            Address::Word(_) => Nature::word(OperandAccess::Read),
            Address::Structure(structure) => {
                Nature { structure: Some(structure.numbered(0)), ..Nature::STRUCTURE }
            }
        }
    }

    /// The properties of an array of such elements.
    fn array(self) -> Nature {
        let Nature { bit, word, .. } = self;
        Nature { bits_inside: bit, words_inside: word, is_array: true, ..Nature::NOTHING }
    }

    /// The properties of a parameter: what can only be read cannot be written.
    fn of_parameter(facts: &TagFacts) -> Nature {
        let kind = facts.text("type").and_then(ParameterKind::from_name);
        let nature = facts.element().map_or(Nature::OPEN, Nature::of_address);
        let Some(kind) = kind else { return nature };
        match kind {
            ParameterKind::Array => {
                Nature { word: OperandAccess::Write, ..Nature::bit(OperandAccess::Write) }.array()
            }
            ParameterKind::Contact
            | ParameterKind::Bit
            | ParameterKind::Int
            | ParameterKind::Real
            | ParameterKind::Duration => Nature {
                bit: nature.bit.min(OperandAccess::Read),
                word: nature.word.min(OperandAccess::Read),
                ..nature
            },
            ParameterKind::Output
            | ParameterKind::IntOut
            | ParameterKind::RealOut
            | ParameterKind::Timer
            | ParameterKind::Counter
            | ParameterKind::Sensaphone
            | ParameterKind::Record => nature,
        }
    }

    /// The properties of a declaration.
    pub fn of(declared: &Declaration, file: &EditorFile) -> Nature {
        match declared.kind {
            DeclaredKind::Tag | DeclaredKind::OwnTag | DeclaredKind::Field => {
                Nature::of_tag(&TagFacts::of(declared, file))
            }
            DeclaredKind::Parameter => Nature::of_parameter(&TagFacts::of(declared, file)),
            DeclaredKind::Use => Nature::OPEN,
            DeclaredKind::Program if declared.template.is_some() => Nature::OPEN,
            DeclaredKind::Program | DeclaredKind::Task | DeclaredKind::Device => {
                Nature::BITS_INSIDE
            }
            DeclaredKind::Stage => Nature::bit(OperandAccess::Read),
            DeclaredKind::Subroutine
            | DeclaredKind::Rung
            | DeclaredKind::Template
            | DeclaredKind::Record
            | DeclaredKind::Test => Nature::NOTHING,
        }
    }

    fn of_tag(facts: &TagFacts) -> Nature {
        let is_constant = facts.text("type").is_none() && facts.text("value").is_some();
        let one = match facts.element() {
            Some(address) => Nature::of_address(address),
            None if is_constant && facts.text("at").is_none() => Nature::CONSTANT,
            None => Nature::OPEN,
        };
        if facts.text("count").is_some() && !one.is_open { one.array() } else { one }
    }
}

impl WantedName {
    /// Whether the place writes the name, or owns its structure.
    pub fn is_written(self) -> bool {
        use WantedName::{Structure, Target, WrittenBit, WrittenWord};
        matches!(self, WrittenBit | WrittenWord | Target | Structure(_))
    }

    /// The wish of an operand of an instruction; `None` for a block or Stage.
    pub fn of(kind: OperandKind) -> Option<WantedName> {
        Some(match kind {
            OperandKind::WritableBit => WantedName::WrittenBit,
            OperandKind::WritableWord => WantedName::WrittenWord,
            OperandKind::Target => WantedName::Target,
            OperandKind::Array
            | OperandKind::WritableArray
            | OperandKind::Bits
            | OperandKind::WritableBits
            | OperandKind::Shifted => WantedName::Array,
            OperandKind::Filling => WantedName::Value,
            OperandKind::Counter => WantedName::Structure(Structure::Counter(0)),
            OperandKind::Timer => WantedName::Structure(Structure::Timer(0)),
            OperandKind::Sensaphone => WantedName::Structure(Structure::Sensaphone(0)),
            OperandKind::Number
            | OperandKind::Value(..)
            | OperandKind::Duration
            | OperandKind::Interval => WantedName::Number,
            OperandKind::Program
            | OperandKind::Block
            | OperandKind::Task
            | OperandKind::Subroutine
            | OperandKind::Stage
            | OperandKind::Stages => return None,
        })
    }

    /// The wish of an argument for a parameter with a type.
    pub fn of_parameter(name: &str) -> WantedName {
        match ParameterKind::from_name(name) {
            Some(ParameterKind::Contact) => WantedName::Contact,
            Some(ParameterKind::Bit) => WantedName::Bit,
            Some(ParameterKind::Int | ParameterKind::Real | ParameterKind::Duration) => {
                WantedName::Number
            }
            Some(ParameterKind::Output) => WantedName::WrittenBit,
            Some(ParameterKind::IntOut | ParameterKind::RealOut) => WantedName::WrittenWord,
            Some(ParameterKind::Timer) => WantedName::Structure(Structure::Timer(0)),
            Some(ParameterKind::Counter) => WantedName::Structure(Structure::Counter(0)),
            Some(ParameterKind::Sensaphone) => WantedName::Structure(Structure::Sensaphone(0)),
            Some(ParameterKind::Array) => WantedName::Array,
            Some(ParameterKind::Record) | None => WantedName::Anything,
        }
    }

    /// The distance of a name from this wish: 0 if the name itself fits, 1 if something after its
    /// dot or index may fit; `None` if the name cannot be meant.
    pub fn distance(self, nature: &Nature) -> Option<u8> {
        let reads = |reach: OperandAccess| reach >= OperandAccess::Read;
        let writes = |reach: OperandAccess| reach == OperandAccess::Write;
        let bits = |can: &dyn Fn(OperandAccess) -> bool| (can(nature.bit), can(nature.bits_inside));
        let words =
            |can: &dyn Fn(OperandAccess) -> bool| (can(nature.word), can(nature.words_inside));
        let either = |(a, b): (bool, bool), (c, d): (bool, bool)| (a || c, b || d);
        let (itself, inside) = match self {
            WantedName::Contact | WantedName::Condition => {
                let (bit, inside) = bits(&reads);
                (bit, inside || words(&reads) != (false, false))
            }
            WantedName::Bit => bits(&reads),
            WantedName::Number => words(&reads),
            WantedName::Value => either(bits(&reads), words(&reads)),
            WantedName::WrittenBit => bits(&writes),
            WantedName::WrittenWord => words(&writes),
            WantedName::Target => either(bits(&writes), words(&writes)),
            WantedName::Array => (nature.is_array, reads(nature.bit) || reads(nature.word)),
            WantedName::Structure(wanted) => (nature.structure == Some(wanted), false),
            // No record contains another one.
            WantedName::Record(wanted) if nature.record.is_some() => {
                return (nature.record == Some(wanted)).then_some(0);
            }
            WantedName::Record(_) => (false, false),
            WantedName::Anything => return Some(0),
        };
        match (itself, inside || nature.is_open) {
            (true, _) => Some(0),
            (false, true) => Some(1),
            (false, false) => None,
        }
    }
}
