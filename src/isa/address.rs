//! Addresses: what every bit, word and structure is called, what it holds, who may write it.
//!
//! Stage bits and the `.Running` and `.Done` bits of blocks are addresses too, but their names
//! belong to a program: the resolver makes those. Nothing here knows where in memory an address
//! lies: that is the engine's layout. How a text becomes an address is `address_text`.

use std::fmt;

use super::status;

/// A block (Program or Task), numbered in file order over all ladder files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockId(pub u32);

/// A Stage, numbered in file order over all Programs of all ladder files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StageId(pub u32);

/// A field device, numbered in the order of the controller file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DeviceId(pub u32);

/// A bit that says how a field device is (`docs/devices.md`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Health {
    /// Its last exchange succeeded.
    Ok,
    /// Its last good exchange, or else the start, is longer ago than its `loss-after`.
    Stale,
}

/// The spaces of plain bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BitSpace {
    /// Inputs.
    X,
    /// Outputs.
    Y,
    /// Internal bits.
    C,
    /// Coils that a Modbus client reads and writes; from 1.
    Mc,
    /// Discrete inputs that a Modbus client reads; from 1.
    Mi,
    /// Status bits, read-only.
    St,
}

/// The spaces of plain words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum WordSpace {
    /// Unsigned 16-bit data.
    V,
    /// Signed 32-bit data.
    D,
    /// Holding registers, u16; from 1.
    Mhr,
    /// Input registers, u16; from 1.
    Mir,
    /// Status words, i32, read-only.
    Dst,
}

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
    /// How a field device is.
    Device(DeviceId, Health),
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

/// Anything that an address can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)]
pub enum Address {
    Bit(Bit),
    Word(Word),
    Structure(Structure),
}

/// How many elements each space has.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct MemorySizes {
    pub x: u32,
    pub y: u32,
    pub c: u32,
    pub mc: u32,
    pub mi: u32,
    pub v: u32,
    pub d: u32,
    pub mhr: u32,
    pub mir: u32,
    pub ct: u32,
    pub t: u32,
    /// Field devices: each has the bits of [`Health`].
    pub devices: u32,
}

impl Default for MemorySizes {
    /// The sizes of `docs/semantics.md`, section 7.
    fn default() -> Self {
        MemorySizes {
            x: 2048,
            y: 2048,
            c: 2048,
            mc: 1024,
            mi: 1024,
            v: 4096,
            d: 4096,
            mhr: 2048,
            mir: 2048,
            ct: 256,
            t: 256,
            devices: 0,
        }
    }
}

/// How many Sensaphone counters there are: `N0`..`N63`.
pub const SENSAPHONE_COUNT: u32 = 64;

impl BitSpace {
    /// The space's prefix as written.
    pub fn name(self) -> &'static str {
        match self {
            BitSpace::X => "X",
            BitSpace::Y => "Y",
            BitSpace::C => "C",
            BitSpace::Mc => "MC",
            BitSpace::Mi => "MI",
            BitSpace::St => "ST",
        }
    }

    /// The first number: 1 in the Modbus spaces, else 0.
    pub fn first(self) -> u32 {
        u32::from(matches!(self, BitSpace::Mc | BitSpace::Mi))
    }

    /// How many elements the space has.
    pub fn count(self, sizes: &MemorySizes) -> u32 {
        match self {
            BitSpace::X => sizes.x,
            BitSpace::Y => sizes.y,
            BitSpace::C => sizes.c,
            BitSpace::Mc => sizes.mc,
            BitSpace::Mi => sizes.mi,
            BitSpace::St => status::ST_COUNT,
        }
    }
}

impl WordSpace {
    /// The space's prefix as written.
    pub fn name(self) -> &'static str {
        match self {
            WordSpace::V => "V",
            WordSpace::D => "D",
            WordSpace::Mhr => "MHR",
            WordSpace::Mir => "MIR",
            WordSpace::Dst => "DST",
        }
    }

    /// The first number: 1 in the Modbus spaces, else 0.
    pub fn first(self) -> u32 {
        u32::from(matches!(self, WordSpace::Mhr | WordSpace::Mir))
    }

    /// How many elements the space has.
    pub fn count(self, sizes: &MemorySizes) -> u32 {
        match self {
            WordSpace::V => sizes.v,
            WordSpace::D => sizes.d,
            WordSpace::Mhr => sizes.mhr,
            WordSpace::Mir => sizes.mir,
            WordSpace::Dst => status::DST_COUNT,
        }
    }

    /// The values an element can hold.
    pub fn range(self) -> (i32, i32) {
        match self {
            WordSpace::V | WordSpace::Mhr | WordSpace::Mir => (0, 65_535),
            WordSpace::D | WordSpace::Dst => (i32::MIN, i32::MAX),
        }
    }
}

impl Structure {
    /// The prefix as written.
    pub fn space_name(self) -> &'static str {
        match self {
            Structure::Counter(_) => "CT",
            Structure::Timer(_) => "T",
            Structure::Sensaphone(_) => "N",
        }
    }

    /// The number.
    pub fn number(self) -> u32 {
        match self {
            Structure::Counter(n) | Structure::Timer(n) | Structure::Sensaphone(n) => n,
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

    /// The member of a name in [`Structure::members`].
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
    const NAMES: [(&'static str, Flag); 10] = [
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

    /// The flag's name as written behind the dot.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }
}

impl Health {
    /// All, in the order of their cells.
    pub const ALL: [Health; 2] = [Health::Ok, Health::Stale];

    /// The name as written behind the dot.
    pub fn name(self) -> &'static str {
        match self {
            Health::Ok => "Ok",
            Health::Stale => "Stale",
        }
    }

    /// The bit of a name as written.
    pub fn from_name(name: &str) -> Option<Health> {
        Health::ALL.into_iter().find(|health| health.name() == name)
    }
}

impl Bit {
    /// Whether a program's instruction may write it: Y, C, MC and MI.
    pub fn writable_by_ladder(self) -> bool {
        matches!(self, Bit::Space(BitSpace::Y | BitSpace::C | BitSpace::Mc | BitSpace::Mi, _))
    }

    /// Whether a write from outside may change it: what a program may write, and the status bits of
    /// a Sensaphone counter (seed S3: "can be viewed or changed"; `docs/semantics.md`, section 5).
    pub fn writable_from_outside(self) -> bool {
        self.writable_by_ladder() || matches!(self, Bit::Flag(Structure::Sensaphone(_), _))
    }
}

impl Word {
    /// Whether a program's instruction, or a queued write, may write it: all but the status words.
    pub fn writable(self) -> bool {
        !matches!(self, Word::Space(WordSpace::Dst, _))
    }

    /// The values it can hold.
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
        write!(f, "{}{}", self.space_name(), self.number())
    }
}

impl fmt::Display for Bit {
    /// The address as written; bits of Stages, blocks and devices, which have no address, by
    /// their number.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Bit::Space(space, n) => write!(f, "{}{n}", space.name()),
            Bit::Flag(structure, flag) => write!(f, "{structure}.{}", flag.name()),
            Bit::Stage(id) => write!(f, "stage {}", id.0),
            Bit::Running(id) => write!(f, "block {}.Running", id.0),
            Bit::Done(id) => write!(f, "block {}.Done", id.0),
            Bit::Device(id, health) => write!(f, "device {}.{}", id.0, health.name()),
        }
    }
}

impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Word::Space(space, n) => write!(f, "{}{n}", space.name()),
            Word::Acc(s @ Structure::Sensaphone(_)) => write!(f, "{s}.ACC"),
            Word::Acc(structure) => write!(f, "{structure}.Acc"),
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
