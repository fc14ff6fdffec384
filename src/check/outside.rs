//! The devices and Modbus clients that write bits and words of a ladder.
//!
//! `controller` makes an [`Outside`] of its settings. Without a controller file only the ladder is
//! known ([`may_be_moved`]). Called by `writers`, which adds what the ladder says.

use crate::isa::{Address, Bit, BitSpace, NumberSet, Word, WordSpace};
use crate::resolve::operands::Operands;
use crate::resolve::range::Range;
use crate::source::span::Span;

/// The bits and words that a controller file lets others write.
#[derive(Debug, Default)]
pub struct Outside {
    /// The addresses that devices and rules of simulated devices move.
    pub(crate) moved: NumberSet<Address>,
    /// The operands that Modbus clients may write.
    pub(crate) listed: Vec<Operands>,
    /// The ranges that Modbus clients write by the image: coils, and the inputs that follow them.
    pub(crate) image: Vec<Range>,
    /// The place of the first device that moves an X.
    pub(crate) wired: Option<Span>,
    /// What devices, simulated inputs and Modbus clients read by the controller file.
    pub(crate) reads: Vec<Read>,
}

/// A part of a controller file that reads bits or words of the ladder.
#[derive(Debug)]
pub(crate) struct Read {
    /// What it reads, in order.
    pub addresses: Vec<Address>,
    /// Its place.
    pub span: Span,
    /// What it does with them: `device line1 takes`.
    pub reader: String,
}

impl Read {
    pub(crate) fn new(addresses: Vec<Address>, span: Span, reader: String) -> Read {
        Read { addresses, span, reader }
    }
}

impl Outside {
    /// Whether a device or a Modbus client may write an address.
    pub(super) fn writes(&self, address: Address) -> bool {
        self.moved.contains(&address)
            || self.listed.iter().any(|listed| listed.hold(address))
            || self.image.iter().any(|range| range.holds(address))
    }
}

/// Whether a controller file that is not known may let something write an address. X, MC and MHR
/// are there for that; a device moves other memory only if the ladder names `devices`.
pub(super) fn may_be_moved(address: Address, has_devices: bool) -> bool {
    match address {
        Address::Bit(Bit::Space(space, _)) => match space {
            BitSpace::X | BitSpace::Mc => true,
            BitSpace::C | BitSpace::Mi => has_devices,
            BitSpace::Y | BitSpace::St => false,
        },
        Address::Word(Word::Space(space, _)) => match space {
            WordSpace::Mhr => true,
            WordSpace::V | WordSpace::D | WordSpace::R | WordSpace::Mir => has_devices,
            WordSpace::Dst => false,
        },
        Address::Bit(
            Bit::Flag(..) | Bit::Stage(_) | Bit::Running(_) | Bit::Done(_) | Bit::Device(..),
        )
        | Address::Word(Word::Acc(_) | Word::Pre(_))
        | Address::Structure(_) => false,
    }
}
