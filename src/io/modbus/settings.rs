//! What the Modbus server has where, who may write it, and how clients are bounded: its settings,
//! as `controller` makes them of a controller file.

use std::net::SocketAddr;

use super::clients::Network;
use super::number::{NumberType, WordOrder};
use crate::resolve::operands::Operands;
use crate::resolve::range::Range;
use crate::source::span::Span;

/// A Modbus server.
#[derive(Clone, Debug)]
pub struct Modbus {
    /// Where it listens.
    pub listen: SocketAddr,
    /// The unit identifiers that are answered; none: all.
    pub units: Option<Vec<u8>>,
    /// Whether MC, MI, MHR and MIR have their places.
    pub standard_map: bool,
    /// What has further places; no two in one place.
    pub entries: Vec<Entry>,
    /// Who may write what; at most [`LISTS_MAX`]. The first is `writable`, for every client.
    pub lists: Vec<WriteList>,
    /// Coils copied to inputs: (MC, X), equally long.
    pub inputs: Option<(Range, Range)>,
    /// Outputs copied to discrete inputs: (Y, MI), equally long.
    pub outputs: Option<(Range, Range)>,
    /// How many connections at a time.
    pub connections: u32,
    /// A request that begins must be whole by then, ms.
    pub frame_timeout_ms: u32,
    /// A connection without requests ends then, ms.
    pub idle_timeout_ms: u32,
}

/// The four tables of Modbus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Table {
    /// Bits, read and written: `coil`.
    Coils,
    /// Bits, read: `discrete`.
    DiscreteInputs,
    /// Words, read and written: `holding`.
    HoldingRegisters,
    /// Words, read: `input`.
    InputRegisters,
}

/// Operands at further places: of the same table, one behind the other.
#[derive(Clone, Debug)]
pub struct Entry {
    /// What.
    pub operands: Operands,
    /// In which table.
    pub table: Table,
    /// The protocol address of the first.
    pub address: u16,
    /// Of words: the type of the number in their registers.
    pub kind: Option<NumberType>,
    /// Which of two registers has the higher 16 bits.
    pub order: WordOrder,
    /// For this unit identifier alone.
    pub unit: Option<u8>,
    /// Its place.
    pub span: Span,
}

/// What some clients may write.
#[derive(Clone, Debug)]
pub struct WriteList {
    /// What.
    pub ranges: Vec<Operands>,
    /// Who; none: every client.
    pub clients: Option<Vec<Network>>,
}

/// The most lists of writes, `writable` with them: the server keeps a bit for each.
pub const LISTS_MAX: usize = 64;

impl Modbus {
    /// The same where nothing is listed, mapped or copied: it serves the standard map's reads.
    pub fn bare(self) -> Modbus {
        let none = WriteList { ranges: Vec::new(), clients: None };
        Modbus { lists: vec![none], entries: Vec::new(), inputs: None, outputs: None, ..self }
    }
}

impl Table {
    /// All tables.
    pub const ALL: [Table; 4] =
        [Table::Coils, Table::DiscreteInputs, Table::HoldingRegisters, Table::InputRegisters];

    /// The table of a name in a controller file.
    pub fn named(text: &str) -> Option<Table> {
        Table::ALL.into_iter().find(|table| table.name() == text)
    }

    /// Whether its elements are bits.
    pub fn is_bits(self) -> bool {
        matches!(self, Table::Coils | Table::DiscreteInputs)
    }

    /// Whether a client can write it.
    pub fn is_writable(self) -> bool {
        matches!(self, Table::Coils | Table::HoldingRegisters)
    }

    /// Its name in a controller file.
    pub fn name(self) -> &'static str {
        match self {
            Table::Coils => "coil",
            Table::DiscreteInputs => "discrete",
            Table::HoldingRegisters => "holding",
            Table::InputRegisters => "input",
        }
    }

    /// The prefix of its elements in the standard map.
    pub fn prefix(self) -> &'static str {
        match self {
            Table::Coils => "MC",
            Table::DiscreteInputs => "MI",
            Table::HoldingRegisters => "MHR",
            Table::InputRegisters => "MIR",
        }
    }
}

impl Entry {
    /// How many addresses it takes.
    pub fn length(&self) -> u32 {
        self.operands.count * u32::from(self.kind.map_or(1, NumberType::registers))
    }
}
