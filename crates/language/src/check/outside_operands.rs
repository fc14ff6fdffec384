//! The devices and Modbus clients that write bits and words of a ladder.
//!
//! `controller` makes an [`OutsideOperands`] from its settings. Without a controller file, the
//! writers are guessed from the ladder ([`may_be_moved`]). Called by `writers`, which adds the
//! settings of the ladder.

use crate::resolve::operands::numbers;
use crate::resolve::range::Range;
use crate::source::span::Span;
use rungd_engine::isa::{Address, Bit, BitSpace, NumberRanges, NumberSet, Word, WordSpace};

/// The bits and words that devices and Modbus clients write or read, by the controller file.
#[derive(Debug, Default)]
pub struct OutsideOperands {
    /// The addresses that devices and rules of simulated devices move.
    pub moved: NumberSet<Address>,
    /// The numbers of the operands that Modbus clients may write, by their kinds ([`numbers`]).
    pub listed: NumberRanges<Address>,
    /// The ranges that Modbus clients write through the image: coils, and the inputs that follow
    /// them.
    pub image: Vec<Range>,
    /// The place of the first device that moves an X.
    pub wired: Option<Span>,
    /// The parts of the controller file that read addresses: rows of maps, simulated inputs and
    /// others.
    pub reads: Vec<OutsideRead>,
}

/// A part of a controller file that reads consecutive bits or words of the ladder.
#[derive(Debug)]
pub struct OutsideRead {
    /// The first address.
    pub first: Address,
    /// The number of addresses; at least 1.
    pub count: u32,
    /// Its place.
    pub span: Span,
    /// The part and its action, as text: `device line1 takes`.
    pub reader: String,
}

impl OutsideRead {
    /// A read of `count` elements from `first` on.
    pub fn new(first: Address, count: u32, span: Span, reader: String) -> OutsideRead {
        OutsideRead { first, count, span, reader }
    }

    /// Whether it reads an address.
    pub fn holds(&self, address: Address) -> bool {
        let mut read = NumberRanges::default();
        read.add(numbers(self.first, self.count), 0);
        read.first_in(numbers(address, 1)).is_some()
    }
}

impl OutsideOperands {
    /// Whether a device writes an address.
    pub(super) fn moves(&self, address: Address) -> bool {
        self.moved.contains(&address)
    }

    /// Whether a device or a Modbus client may write an address.
    pub(super) fn writes(&self, address: Address) -> bool {
        self.moved.contains(&address)
            || self.listed.first_in(numbers(address, 1)).is_some()
            || self.image.iter().any(|range| range.holds(address))
    }
}

/// Whether something may write an address if the controller file is unknown. X, MC and MHR are made
/// for writes from outside; a device moves other memory only if the ladder names `devices`.
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
        Address::Bit(Bit::InWord(bit)) => may_be_moved(Address::Word(bit.word), has_devices),
        Address::Bit(
            Bit::Flag(..) | Bit::Stage(_) | Bit::Running(_) | Bit::Done(_) | Bit::Device(..),
        )
        | Address::Word(Word::Acc(_) | Word::Pre(_))
        | Address::Structure(_) => false,
    }
}
