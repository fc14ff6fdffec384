//! What a name stands for, as far as an operand asks: a bit, a word, a structure, and whether a
//! ladder may write it; and which of them a place wants.
//!
//! Made of the declarations as written: of a mistake it knows nothing, and offers the name.

use crate::editor::file::EditorFile;
use crate::editor::names::Declared;
use crate::editor::outline::KeyPair;
use crate::editor::slots::DeclaredKind;
use crate::isa::address_text;
use crate::isa::{Address, MemorySizes, OperandKind, Structure};

/// What may be done with a bit or word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Reach {
    None,
    Read,
    Write,
}

/// What a name stands for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nature {
    /// The name as a bit.
    pub bit: Reach,
    /// The name as a word or constant.
    pub word: Reach,
    /// Bits behind its dot or index.
    pub bits_inside: Reach,
    /// Words behind its dot or index.
    pub words_inside: Reach,
    /// The structure that it is, of any number.
    pub structure: Option<Structure>,
    /// Whether it is an array.
    pub is_array: bool,
    /// Whether anything may stand behind its dot, or it is not known what it is.
    pub is_open: bool,
}

/// What a place wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wish {
    /// A contact: a bit, or the first word of a compare.
    Contact,
    /// A contact of a test, whose compares may have sums of bits.
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
    Anything,
}

impl Nature {
    const NOTHING: Nature = Nature {
        bit: Reach::None,
        word: Reach::None,
        bits_inside: Reach::None,
        words_inside: Reach::None,
        structure: None,
        is_array: false,
        is_open: false,
    };
    /// A constant.
    pub const CONSTANT: Nature = Nature { word: Reach::Read, ..Nature::NOTHING };
    /// Blocks and devices have bits behind their dots.
    pub const BITS_INSIDE: Nature = Nature { bits_inside: Reach::Read, ..Nature::NOTHING };
    /// What has names of its own behind its dot, and what is not known.
    pub const OPEN: Nature = Nature { is_open: true, ..Nature::NOTHING };
    /// Timers, counters.
    const STRUCTURE: Nature =
        Nature { bits_inside: Reach::Read, words_inside: Reach::Write, ..Nature::NOTHING };

    fn bit(bit: Reach) -> Nature {
        Nature { bit, ..Nature::NOTHING }
    }

    fn word(word: Reach) -> Nature {
        Nature { word, ..Nature::NOTHING }
    }

    /// Of an address.
    pub fn of_address(address: Address) -> Nature {
        match address {
            Address::Bit(bit) if bit.writable_by_ladder() => Nature::bit(Reach::Write),
            Address::Bit(_) => Nature::bit(Reach::Read),
            Address::Word(word) if word.writable() => Nature::word(Reach::Write),
            Address::Word(_) => Nature::word(Reach::Read),
            Address::Structure(structure) => {
                Nature { structure: Some(structure.numbered(0)), ..Nature::STRUCTURE }
            }
        }
    }

    /// As an array of it.
    fn array(self) -> Nature {
        let Nature { bit, word, .. } = self;
        Nature { bits_inside: bit, words_inside: word, is_array: true, ..Nature::NOTHING }
    }

    /// Of a name of a type, of a tag or a parameter.
    fn of_type(name: &str) -> Nature {
        let structure = |of| Nature::of_address(Address::Structure(of));
        match name {
            "bit" | "output" => Nature::bit(Reach::Write),
            "int" | "word" | "real" | "int-out" | "real-out" => Nature::word(Reach::Write),
            "contact" => Nature::bit(Reach::Read),
            "duration" => Nature::word(Reach::Read),
            "timer" => structure(Structure::Timer(0)),
            "counter" => structure(Structure::Counter(0)),
            "sensaphone" => structure(Structure::Sensaphone(0)),
            "array" => Nature {
                bits_inside: Reach::Write,
                words_inside: Reach::Write,
                is_array: true,
                ..Nature::NOTHING
            },
            _ => Nature::OPEN,
        }
    }

    /// Of a parameter's type: those that are read cannot be written.
    fn of_parameter(name: &str) -> Nature {
        let of = Nature::of_type(name);
        match name {
            "bit" | "int" | "real" => {
                Nature { bit: of.bit.min(Reach::Read), word: of.word.min(Reach::Read), ..of }
            }
            _ => of,
        }
    }

    /// Of a declaration.
    pub fn of(declared: &Declared, file: &EditorFile) -> Nature {
        match declared.kind {
            DeclaredKind::Tag | DeclaredKind::OwnTag => Nature::of_tag(&facts(declared, file)),
            DeclaredKind::Parameter => {
                let facts = facts(declared, file);
                facts.text("type").map_or(Nature::OPEN, Nature::of_parameter)
            }
            DeclaredKind::Use => Nature::OPEN,
            DeclaredKind::Program if declared.template.is_some() => Nature::OPEN,
            DeclaredKind::Program | DeclaredKind::Task | DeclaredKind::Device => {
                Nature::BITS_INSIDE
            }
            DeclaredKind::Stage => Nature::bit(Reach::Read),
            DeclaredKind::Rung | DeclaredKind::Template | DeclaredKind::Test => Nature::NOTHING,
        }
    }

    fn of_tag(facts: &TagFacts) -> Nature {
        let one = match (facts.text("at"), facts.text("type")) {
            (Some(at), _) => match address_text::parse(at, &MemorySizes::default()) {
                Ok(address) => Nature::of_address(address),
                Err(_) => Nature::OPEN,
            },
            (None, Some(kind)) => Nature::of_type(kind),
            (None, None) if facts.text("value").is_some() => Nature::CONSTANT,
            (None, None) => Nature::OPEN,
        };
        if facts.text("count").is_some() && !one.is_open { one.array() } else { one }
    }
}

impl Wish {
    /// Of an operand of an instruction; `None`: a block or stage.
    pub fn of(kind: OperandKind) -> Option<Wish> {
        Some(match kind {
            OperandKind::WritableBit => Wish::WrittenBit,
            OperandKind::WritableWord => Wish::WrittenWord,
            OperandKind::Target => Wish::Target,
            OperandKind::Array | OperandKind::WritableArray | OperandKind::Shifted => Wish::Array,
            OperandKind::Filling => Wish::Value,
            OperandKind::Counter => Wish::Structure(Structure::Counter(0)),
            OperandKind::Timer => Wish::Structure(Structure::Timer(0)),
            OperandKind::Sensaphone => Wish::Structure(Structure::Sensaphone(0)),
            OperandKind::Number
            | OperandKind::Value(..)
            | OperandKind::Duration
            | OperandKind::Interval => Wish::Number,
            OperandKind::Program
            | OperandKind::Block
            | OperandKind::Task
            | OperandKind::Stage
            | OperandKind::Stages => return None,
        })
    }

    /// Of an argument for a parameter of a type.
    pub fn of_parameter(name: &str) -> Wish {
        match name {
            "contact" => Wish::Contact,
            "bit" => Wish::Bit,
            "int" | "real" | "duration" => Wish::Number,
            "output" => Wish::WrittenBit,
            "int-out" | "real-out" => Wish::WrittenWord,
            "timer" => Wish::Structure(Structure::Timer(0)),
            "counter" => Wish::Structure(Structure::Counter(0)),
            "sensaphone" => Wish::Structure(Structure::Sensaphone(0)),
            "array" => Wish::Array,
            _ => Wish::Anything,
        }
    }

    /// How far behind the best a name stands that may be meant here: 0 is the best; `None`: it
    /// cannot be meant.
    pub fn distance(self, of: &Nature) -> Option<u8> {
        let reads = |reach: Reach| reach >= Reach::Read;
        let writes = |reach: Reach| reach == Reach::Write;
        let bits = |can: &dyn Fn(Reach) -> bool| (can(of.bit), can(of.bits_inside));
        let words = |can: &dyn Fn(Reach) -> bool| (can(of.word), can(of.words_inside));
        let either = |(a, b): (bool, bool), (c, d): (bool, bool)| (a || c, b || d);
        let (itself, inside) = match self {
            Wish::Contact | Wish::Condition => {
                let (bit, inside) = bits(&reads);
                (bit, inside || words(&reads) != (false, false))
            }
            Wish::Bit => bits(&reads),
            Wish::Number => words(&reads),
            Wish::Value => either(bits(&reads), words(&reads)),
            Wish::WrittenBit => bits(&writes),
            Wish::WrittenWord => words(&writes),
            Wish::Target => either(bits(&writes), words(&writes)),
            Wish::Array => (of.is_array, reads(of.bit) || reads(of.word)),
            Wish::Structure(wanted) => (of.structure == Some(wanted), false),
            Wish::Anything => return Some(0),
        };
        match (itself, inside || of.is_open) {
            (true, _) => Some(0),
            (false, true) => Some(1),
            (false, false) => None,
        }
    }
}

/// The keys of a tag or parameter, with their values as written.
pub(super) struct TagFacts<'f>(Vec<(&'f str, &'f str)>);

impl<'f> TagFacts<'f> {
    /// The value of a key, without quotes.
    pub fn text(&self, key: &str) -> Option<&'f str> {
        self.0.iter().find(|(of, _)| *of == key).map(|(_, text)| *text)
    }
}

/// The keys of a declared tag or parameter: of the pairs that follow its own.
pub(super) fn facts<'f>(declared: &Declared, file: &'f EditorFile) -> TagFacts<'f> {
    let outline = &file.outline;
    let own = &outline.pairs[declared.pair];
    let length = own.keys.iter().position(|key| key.span.start == declared.span.start);
    let length = length.map_or(own.keys.len(), |at| at + 1);
    let is_same = |pair: &&KeyPair| {
        let mut both = pair.keys.iter().zip(&own.keys).take(length);
        pair.object == own.object
            && pair.keys.len() >= length
            && both.all(|(a, b)| a.text == b.text)
    };
    let numbers = declared.pair..outline.pairs.len();
    let of = outline.pairs[numbers.clone()].iter().take_while(is_same).zip(numbers);
    let fact = |(pair, number): (&'f KeyPair, usize)| {
        let key = pair.keys.get(length)?;
        let text = outline.value_of[number]
            .map_or("", |value| file.slice(outline.values[value].inner.clone()));
        Some((key.text.as_str(), text))
    };
    TagFacts(of.filter_map(fact).collect())
}
