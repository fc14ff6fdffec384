//! The spaces of numbered addresses: their prefixes, their first numbers and their sizes.
//!
//! A leaf module: `address` builds addresses from the spaces, the controller file sets their sizes.

use super::real::Real;
use super::status;
pub use rungd_base::variants::all_variants;

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
    /// Reals, binary32; `Real` gives the content of their cells.
    R,
    /// Holding registers, u16; from 1.
    Mhr,
    /// Input registers, u16; from 1.
    Mir,
    /// Status words, i32, read-only.
    Dst,
}

/// Every space of numbered addresses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Space {
    /// Plain bits.
    Bit(BitSpace),
    /// Plain words.
    Word(WordSpace),
    /// `CT`.
    Counter,
    /// `T`.
    Timer,
    /// `N`.
    Sensaphone,
}

/// The number of elements of each space.
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
    pub r: u32,
    pub mhr: u32,
    pub mir: u32,
    pub ct: u32,
    pub t: u32,
    /// Number of field devices; each has the bits of `DeviceBit`.
    pub devices: u32,
}

impl Default for MemorySizes {
    /// The default sizes of `docs/semantics.md`, section 7.
    fn default() -> Self {
        MemorySizes {
            x: 2048,
            y: 2048,
            c: 2048,
            mc: 1024,
            mi: 1024,
            v: 4096,
            d: 4096,
            r: 1024,
            mhr: 2048,
            mir: 2048,
            ct: 256,
            t: 256,
            devices: 0,
        }
    }
}

/// Number of Sensaphone counters: `N0`..`N63`.
pub const SENSAPHONE_COUNT: u32 = 64;

impl Space {
    /// All spaces, the bits first.
    pub const ALL: [Space; 15] = all_variants![
        Space::Bit(BitSpace::X),
        Space::Bit(BitSpace::Y),
        Space::Bit(BitSpace::C),
        Space::Bit(BitSpace::Mc),
        Space::Bit(BitSpace::Mi),
        Space::Bit(BitSpace::St),
        Space::Word(WordSpace::V),
        Space::Word(WordSpace::D),
        Space::Word(WordSpace::R),
        Space::Word(WordSpace::Mhr),
        Space::Word(WordSpace::Mir),
        Space::Word(WordSpace::Dst),
        Space::Counter,
        Space::Timer,
        Space::Sensaphone,
    ];

    /// The spaces that may survive a restart: bits and words that only programs and clients write,
    /// and structures.
    pub const RETAINABLE: [Space; 11] = [
        Space::Bit(BitSpace::C),
        Space::Bit(BitSpace::Mc),
        Space::Bit(BitSpace::Mi),
        Space::Word(WordSpace::V),
        Space::Word(WordSpace::D),
        Space::Word(WordSpace::R),
        Space::Word(WordSpace::Mhr),
        Space::Word(WordSpace::Mir),
        Space::Counter,
        Space::Timer,
        Space::Sensaphone,
    ];

    /// The prefix as written.
    pub fn name(self) -> &'static str {
        match self {
            Space::Bit(space) => space.name(),
            Space::Word(space) => space.name(),
            Space::Counter => "CT",
            Space::Timer => "T",
            Space::Sensaphone => "N",
        }
    }

    /// The space with this prefix.
    pub(crate) fn from_name(name: &str) -> Option<Space> {
        Space::ALL.into_iter().find(|space| space.name() == name)
    }

    /// The first number: 1 in the Modbus spaces, else 0.
    pub fn first(self) -> u32 {
        match self {
            Space::Bit(space) => space.first(),
            Space::Word(space) => space.first(),
            Space::Counter | Space::Timer | Space::Sensaphone => 0,
        }
    }

    /// The number of elements of the space.
    pub fn count(self, sizes: &MemorySizes) -> u32 {
        match self {
            Space::Bit(space) => space.count(sizes),
            Space::Word(space) => space.count(sizes),
            Space::Counter => sizes.ct,
            Space::Timer => sizes.t,
            Space::Sensaphone => SENSAPHONE_COUNT,
        }
    }

    /// The sizes with `count` elements in this space; unchanged if the size of the space is fixed.
    pub fn sized(self, sizes: &MemorySizes, count: u32) -> MemorySizes {
        let mut sizes = sizes.clone();
        let size = match self {
            Space::Bit(BitSpace::X) => &mut sizes.x,
            Space::Bit(BitSpace::Y) => &mut sizes.y,
            Space::Bit(BitSpace::C) => &mut sizes.c,
            Space::Bit(BitSpace::Mc) => &mut sizes.mc,
            Space::Bit(BitSpace::Mi) => &mut sizes.mi,
            Space::Word(WordSpace::V) => &mut sizes.v,
            Space::Word(WordSpace::D) => &mut sizes.d,
            Space::Word(WordSpace::R) => &mut sizes.r,
            Space::Word(WordSpace::Mhr) => &mut sizes.mhr,
            Space::Word(WordSpace::Mir) => &mut sizes.mir,
            Space::Counter => &mut sizes.ct,
            Space::Timer => &mut sizes.t,
            Space::Bit(BitSpace::St) | Space::Word(WordSpace::Dst) | Space::Sensaphone => {
                return sizes;
            }
        };
        *size = count;
        sizes
    }
}

impl BitSpace {
    /// The spaces with a size that can be set: all but the status bits.
    pub(crate) const SIZED: [BitSpace; 5] =
        [BitSpace::X, BitSpace::Y, BitSpace::C, BitSpace::Mc, BitSpace::Mi];

    /// The space's prefix as written.
    pub(crate) fn name(self) -> &'static str {
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

    /// The number of elements of the space.
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
    /// The spaces with a size that can be set: all but the status words.
    pub const SIZED: [WordSpace; 5] =
        [WordSpace::V, WordSpace::D, WordSpace::R, WordSpace::Mhr, WordSpace::Mir];

    /// The space's prefix as written.
    pub(crate) fn name(self) -> &'static str {
        match self {
            WordSpace::V => "V",
            WordSpace::D => "D",
            WordSpace::R => "R",
            WordSpace::Mhr => "MHR",
            WordSpace::Mir => "MIR",
            WordSpace::Dst => "DST",
        }
    }

    /// The first number: 1 in the Modbus spaces, else 0.
    pub fn first(self) -> u32 {
        u32::from(matches!(self, WordSpace::Mhr | WordSpace::Mir))
    }

    /// The number of elements of the space.
    pub fn count(self, sizes: &MemorySizes) -> u32 {
        match self {
            WordSpace::V => sizes.v,
            WordSpace::D => sizes.d,
            WordSpace::R => sizes.r,
            WordSpace::Mhr => sizes.mhr,
            WordSpace::Mir => sizes.mir,
            WordSpace::Dst => status::DST_COUNT,
        }
    }

    /// The least and greatest content of an element's cell. The cells of reals sort as the reals.
    pub fn range(self) -> (i32, i32) {
        match self {
            WordSpace::V | WordSpace::Mhr | WordSpace::Mir => (0, 65_535),
            WordSpace::D | WordSpace::Dst => (i32::MIN, i32::MAX),
            WordSpace::R => (Real::MIN.cell(), Real::MAX.cell()),
        }
    }
}
