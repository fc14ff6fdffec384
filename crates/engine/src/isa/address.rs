//! Addresses: the names, value ranges and write permissions of every bit, word and structure.
//!
//! Stage bits and the `.Running` and `.Done` bits of blocks are addresses too, but their names
//! belong to a program; the resolver handles these. The place of an address in memory is in the
//! engine's layout. `address_text` turns a text into an address.

use std::fmt;

pub use super::own_bits::{BlockBit, DeviceBit};
use super::real::Real;
use super::space::{BitSpace, Space, WordSpace};
pub use rungd_base::variants::all_variants;

/// A block (Program or Task), numbered in file order over all ladder files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockId(pub u32);

/// A Stage, numbered in file order over all Programs of all ladder files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StageId(pub u32);

/// A part of a program that executes and terminates as a whole: a block's own rungs, or a Stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ElementId {
    /// The block.
    pub block: BlockId,
    /// The Stage; `None`: the block's own rungs.
    pub stage: Option<StageId>,
}

/// A field device, numbered in the order of the controller file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DeviceId(pub u32);

/// A structure: a counter `CTn`, a timer `Tn` or a Sensaphone counter `Nn`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Structure {
    /// `CTn`, owned by one CNT, CNTDN, UDC or UDCG.
    Counter(u32),
    /// `Tn`, owned by one timer instruction.
    Timer(u32),
    /// `Nn`, shared by one CTU and one CTD.
    Sensaphone(u32),
}

/// A bit member of a structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)]
pub enum Flag {
    Done,
    Reset,
    Zero,
    DnDone,
    Timing,
    Cu,
    Cd,
    Dn,
    Ov,
    Un,
}

/// One bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Bit {
    /// A plain bit: space and number as written.
    Space(BitSpace, u32),
    /// A flag of a structure.
    Flag(Structure, Flag),
    /// Whether a Stage is ON.
    Stage(StageId),
    /// `.Running` of a block.
    Running(BlockId),
    /// `.Done` of a Task.
    Done(BlockId),
    /// A status bit of a field device.
    Device(DeviceId, DeviceBit),
    /// A bit of an integer word.
    InWord(WordBit),
}

/// A bit of an integer word: `D0.3`. It has no cell of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WordBit {
    /// The word.
    pub word: Word,
    /// The number of the bit, from 0, the lowest.
    pub number: u8,
}

/// One word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Word {
    /// A plain word: space and number as written.
    Space(WordSpace, u32),
    /// `.Acc` (`.ACC`) of a structure.
    Acc(Structure),
    /// `.PRE` of a Sensaphone counter.
    Pre(u32),
}

/// A bit, word or structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)]
pub enum Address {
    Bit(Bit),
    Word(Word),
    Structure(Structure),
}

impl Space {
    /// The address with number `n` in this space.
    pub fn address(self, n: u32) -> Address {
        match self {
            Space::Bit(space) => Address::Bit(Bit::Space(space, n)),
            Space::Word(space) => Address::Word(Word::Space(space, n)),
            Space::Counter => Address::Structure(Structure::Counter(n)),
            Space::Timer => Address::Structure(Structure::Timer(n)),
            Space::Sensaphone => Address::Structure(Structure::Sensaphone(n)),
        }
    }

    /// The space and number of an address. `None` for members, and for bits of Stages, blocks and
    /// devices.
    pub fn of(address: Address) -> Option<(Space, u32)> {
        match address {
            Address::Bit(Bit::Space(space, n)) => Some((Space::Bit(space), n)),
            Address::Word(Word::Space(space, n)) => Some((Space::Word(space), n)),
            Address::Structure(structure) => Some((structure.space(), structure.number())),
            Address::Bit(
                Bit::Flag(..)
                | Bit::Stage(_)
                | Bit::Running(_)
                | Bit::Done(_)
                | Bit::Device(..)
                | Bit::InWord(_),
            )
            | Address::Word(Word::Acc(_) | Word::Pre(_)) => None,
        }
    }

    /// The space and number of an address; for a member, those of its structure, and for a bit of a
    /// word, those of the word. `None` for bits of Stages, blocks and devices.
    pub fn with_members(address: Address) -> Option<(Space, u32)> {
        let address = address.without_bit();
        Space::of(address.structure().map_or(address, Address::Structure))
    }
}

impl Address {
    /// For a bit of a word, the word; else itself.
    pub fn without_bit(self) -> Address {
        match self {
            Address::Bit(Bit::InWord(bit)) => Address::Word(bit.word),
            Address::Bit(_) | Address::Word(_) | Address::Structure(_) => self,
        }
    }

    /// The member's name, if it is a member of a structure.
    pub fn member(self) -> Option<&'static str> {
        match self {
            Address::Bit(Bit::Flag(_, flag)) => Some(flag.name()),
            Address::Word(Word::Acc(structure)) => Some(structure.acc_name()),
            Address::Word(Word::Pre(_)) => Some("PRE"),
            Address::Bit(
                Bit::Space(..)
                | Bit::Stage(_)
                | Bit::Running(_)
                | Bit::Done(_)
                | Bit::Device(..)
                | Bit::InWord(_),
            )
            | Address::Word(Word::Space(..))
            | Address::Structure(_) => None,
        }
    }

    /// The structure that it is, or is a member of, or a bit of a member.
    pub fn structure(self) -> Option<Structure> {
        match self {
            Address::Bit(Bit::InWord(bit)) => Address::Word(bit.word).structure(),
            Address::Structure(structure)
            | Address::Bit(Bit::Flag(structure, _))
            | Address::Word(Word::Acc(structure)) => Some(structure),
            Address::Word(Word::Pre(number)) => Some(Structure::Sensaphone(number)),
            Address::Bit(
                Bit::Space(..) | Bit::Stage(_) | Bit::Running(_) | Bit::Done(_) | Bit::Device(..),
            )
            | Address::Word(Word::Space(..)) => None,
        }
    }

    /// Its bits and words: itself, or all members of a structure.
    pub fn operands(self) -> Vec<Address> {
        match self {
            Address::Structure(structure) => structure.member_addresses().collect(),
            Address::Bit(_) | Address::Word(_) => vec![self],
        }
    }

    /// Its bits and words with their names, if it is called `name`: a member is `name.Member`.
    pub fn named_operands(self, name: &str) -> impl Iterator<Item = (String, Address)> {
        let is_structure = matches!(self, Address::Structure(_));
        self.operands().into_iter().map(move |operand| match operand.member() {
            Some(member) if is_structure => (format!("{name}.{member}"), operand),
            Some(_) | None => (name.to_owned(), operand),
        })
    }
}

impl Structure {
    /// Its kind, for a sentence.
    pub fn kind_name(self) -> &'static str {
        match self {
            Structure::Counter(_) => "counter",
            Structure::Timer(_) => "timer",
            Structure::Sensaphone(_) => "Sensaphone counter",
        }
    }

    /// Its space.
    pub fn space(self) -> Space {
        match self {
            Structure::Counter(_) => Space::Counter,
            Structure::Timer(_) => Space::Timer,
            Structure::Sensaphone(_) => Space::Sensaphone,
        }
    }

    /// Its number.
    pub fn number(self) -> u32 {
        match self {
            Structure::Counter(n) | Structure::Timer(n) | Structure::Sensaphone(n) => n,
        }
    }

    /// The structure with number `n` in the same space.
    pub fn numbered(self, n: u32) -> Structure {
        match self {
            Structure::Counter(_) => Structure::Counter(n),
            Structure::Timer(_) => Structure::Timer(n),
            Structure::Sensaphone(_) => Structure::Sensaphone(n),
        }
    }

    /// The name of the member that counts.
    pub fn acc_name(self) -> &'static str {
        match self {
            Structure::Counter(_) | Structure::Timer(_) => "Acc",
            Structure::Sensaphone(_) => "ACC",
        }
    }

    /// The name of the flag that shows the preset is reached.
    pub fn done_name(self) -> &'static str {
        match self {
            Structure::Counter(_) | Structure::Timer(_) => "Done",
            Structure::Sensaphone(_) => "DN",
        }
    }

    /// The members' names, in the order of the texts; for `N`, by element number.
    pub fn members(self) -> &'static [&'static str] {
        match self {
            Structure::Counter(_) => &["Acc", "Done", "Reset", "Zero", "DnDone"],
            Structure::Timer(_) => &["Acc", "Done", "Reset", "Zero", "Timing"],
            Structure::Sensaphone(_) => &["CU", "CD", "DN", "OV", "UN", "PRE", "ACC"],
        }
    }

    /// The member with this name, one of [`Structure::members`].
    pub fn member(self, name: &str) -> Option<Address> {
        let flag = |flag| Some(Address::Bit(Bit::Flag(self, flag)));
        let sensaphone = matches!(self, Structure::Sensaphone(_));
        if !self.members().contains(&name) {
            return None;
        }
        match name {
            "Acc" | "ACC" => Some(Address::Word(Word::Acc(self))),
            "PRE" if sensaphone => Some(Address::Word(Word::Pre(self.number()))),
            _ => flag(Flag::from_name(name)?),
        }
    }

    /// All members, as addresses.
    pub fn member_addresses(self) -> impl Iterator<Item = Address> {
        self.members().iter().filter_map(move |name| self.member(name))
    }
}

impl Flag {
    const NAMES: [(&'static str, Flag); 10] = all_variants![
        ("Done", Flag::Done),
        ("Reset", Flag::Reset),
        ("Zero", Flag::Zero),
        ("DnDone", Flag::DnDone),
        ("Timing", Flag::Timing),
        ("CU", Flag::Cu),
        ("CD", Flag::Cd),
        ("DN", Flag::Dn),
        ("OV", Flag::Ov),
        ("UN", Flag::Un),
    ];

    fn from_name(name: &str) -> Option<Flag> {
        Self::NAMES.iter().find(|(n, _)| *n == name).map(|(_, flag)| *flag)
    }

    /// The flag's name, as written after the dot.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }
}

impl BlockBit {
    /// The bit of a certain block.
    pub fn bit_of(self, block: BlockId) -> Bit {
        match self {
            BlockBit::Running => Bit::Running(block),
            BlockBit::Done => Bit::Done(block),
        }
    }
}

impl Bit {
    /// Whether an instruction may write the bit: of Y, C, MC and MI, and the bits of words that an
    /// instruction may write.
    pub fn writable_by_ladder(self) -> bool {
        match self {
            Bit::Space(space, _) => {
                matches!(space, BitSpace::Y | BitSpace::C | BitSpace::Mc | BitSpace::Mi)
            }
            Bit::InWord(bit) => bit.word.writable(),
            Bit::Flag(..) | Bit::Stage(_) | Bit::Running(_) | Bit::Done(_) | Bit::Device(..) => {
                false
            }
        }
    }

    /// Whether a write from outside may change the bit: all bits that an instruction may write, and
    /// the status bits of a Sensaphone counter (seed S3: "can be viewed or changed";
    /// `docs/semantics.md`, section 5).
    pub fn writable_from_outside(self) -> bool {
        self.writable_by_ladder() || matches!(self, Bit::Flag(Structure::Sensaphone(_), _))
    }

    /// Whether the bit may be forced. Flags of structures and status bits of devices may be forced;
    /// STn and the bits of blocks, Stages and words may not (a word is forced as a whole).
    pub fn forcible(self) -> bool {
        match self {
            Bit::Space(space, _) => space != BitSpace::St,
            Bit::Flag(..) | Bit::Device(..) => true,
            Bit::Stage(_) | Bit::Running(_) | Bit::Done(_) | Bit::InWord(_) => false,
        }
    }

    /// The word that it is a bit of.
    pub fn of_word(self) -> Option<WordBit> {
        match self {
            Bit::InWord(bit) => Some(bit),
            Bit::Space(..)
            | Bit::Flag(..)
            | Bit::Stage(_)
            | Bit::Running(_)
            | Bit::Done(_)
            | Bit::Device(..) => None,
        }
    }
}

impl Word {
    /// The number of its bits that have names: none of a real.
    pub fn bit_count(self) -> u8 {
        match self.range() {
            _ if self.is_real() => 0,
            (i32::MIN, i32::MAX) => 32,
            _ => 16,
        }
    }

    /// A bit of it; `None` if it has no bit with this number.
    pub fn bit(self, number: u8) -> Option<Bit> {
        (number < self.bit_count()).then_some(Bit::InWord(WordBit { word: self, number }))
    }

    /// Whether an instruction or a queued write may write the word: all but the status words.
    pub fn writable(self) -> bool {
        !matches!(self, Word::Space(WordSpace::Dst, _))
    }

    /// Whether it holds a real; all others hold integers.
    pub fn is_real(self) -> bool {
        matches!(self, Word::Space(WordSpace::R, _))
    }

    /// The text of its value, from the content of its cell.
    pub fn text(self, cell: i32) -> String {
        if self.is_real() { Real::of_cell(cell).to_string() } else { cell.to_string() }
    }

    /// The value, from the content of its cell. A binary64 holds every integer and real exactly.
    pub fn number(self, cell: i32) -> f64 {
        if self.is_real() { Real::of_cell(cell).into() } else { cell.into() }
    }

    /// The least and greatest value.
    pub fn numbers(self) -> (f64, f64) {
        let (least, most) = self.range();
        (self.number(least), self.number(most))
    }

    /// The least and greatest content of its cell.
    pub fn range(self) -> (i32, i32) {
        match self {
            Word::Space(space, _) => space.range(),
            Word::Acc(Structure::Sensaphone(_)) | Word::Pre(_) => {
                (i32::from(i16::MIN), i32::from(i16::MAX))
            }
            Word::Acc(_) => (i32::MIN, i32::MAX),
        }
    }
}

impl fmt::Display for Structure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.space().name())?;
        write!(f, "{}", self.number())
    }
}

impl fmt::Display for Bit {
    /// The address as written. Bits of Stages, blocks and devices have no written address: their
    /// number.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Bit::Space(space, n) => {
                f.write_str(space.name())?;
                write!(f, "{n}")
            }
            Bit::Flag(structure, flag) => {
                structure.fmt(f)?;
                f.write_str(".")?;
                f.write_str(flag.name())
            }
            Bit::Stage(id) => write!(f, "stage {}", id.0),
            Bit::Running(id) => write!(f, "block {}.Running", id.0),
            Bit::Done(id) => write!(f, "block {}.Done", id.0),
            Bit::Device(id, health) => write!(f, "device {}.{}", id.0, health.name()),
            Bit::InWord(bit) => write!(f, "{}.{}", bit.word, bit.number),
        }
    }
}

impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Word::Space(space, n) => {
                f.write_str(space.name())?;
                write!(f, "{n}")
            }
            Word::Acc(structure) => {
                structure.fmt(f)?;
                f.write_str(".")?;
                f.write_str(structure.acc_name())
            }
            Word::Pre(n) => write!(f, "N{n}.PRE"),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Address::Bit(bit) => bit.fmt(f),
            Address::Word(word) => word.fmt(f),
            Address::Structure(structure) => structure.fmt(f),
        }
    }
}
