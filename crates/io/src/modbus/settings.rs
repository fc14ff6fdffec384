//! The settings of the Modbus server: its map, the write permissions, and the limits of clients.
//! Made by `controller` from a controller file.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use super::clients::Network;
use super::number::{RegisterNumberType, WordOrder};
use rungd_base::variants::all_variants;
use rungd_language::resolve::operands::Operands;
use rungd_language::resolve::range::Range;
use rungd_language::source::span::Span;

/// A Modbus server.
#[derive(Clone, Debug)]
pub struct ModbusServerSettings {
    /// The address at which it listens.
    pub listen: SocketAddr,
    /// The unit identifiers that are answered; `None`: all.
    pub units: Option<Vec<u8>>,
    /// Whether MC, MI, MHR and MIR have their standard places.
    pub standard_map: bool,
    /// The operands with further places; no two share a place.
    pub entries: Vec<MappedOperands>,
    /// The write lists; at most [`LISTS_MAX`]. The first is `writable`, for every client.
    pub lists: Vec<WriteList>,
    /// Coils copied to inputs: (MC, X), of the same length.
    pub inputs: Option<(Range, Range)>,
    /// Outputs copied to discrete inputs: (Y, MI), of the same length.
    pub outputs: Option<(Range, Range)>,
    /// The most connections at a time.
    pub connections: u32,
    /// The time limit for a whole request, from its first byte, ms.
    pub frame_timeout_ms: u32,
    /// A connection without requests ends after this time, ms.
    pub idle_timeout_ms: u32,
}

/// The four tables of Modbus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ModbusTable {
    /// Bits, read and written: `coil`.
    Coils,
    /// Bits, read: `discrete`.
    DiscreteInputs,
    /// Words, read and written: `holding`.
    HoldingRegisters,
    /// Words, read: `input`.
    InputRegisters,
}

/// Operands at further places: consecutive addresses of one table.
#[derive(Clone, Debug)]
pub struct MappedOperands {
    /// The operands.
    pub operands: Operands,
    /// The table.
    pub table: ModbusTable,
    /// The protocol address of the first element.
    pub address: u16,
    /// For words: the number type of their registers.
    pub kind: Option<RegisterNumberType>,
    /// The register of a pair that has the higher 16 bits.
    pub order: WordOrder,
    /// The only unit identifier that shows it; `None`: all.
    pub unit: Option<u8>,
    /// The place of its table in the file.
    pub span: Span,
}

/// The operands that certain clients may write.
#[derive(Clone, Debug)]
pub struct WriteList {
    /// The operands.
    pub ranges: Vec<Operands>,
    /// The clients; `None`: every client.
    pub clients: Option<Vec<Network>>,
}

/// The most write lists, including `writable`: the server keeps one bit for each.
pub const LISTS_MAX: usize = 64;

impl MappedOperands {
    /// Whether it is the same row as another one, wherever both stand.
    pub fn is_like(&self, other: &MappedOperands) -> bool {
        let place = |operands: &MappedOperands| {
            (operands.table, operands.address, operands.kind, operands.order, operands.unit)
        };
        place(self) == place(other) && is_like(&self.operands, &other.operands)
    }
}

impl WriteList {
    /// Whether it has the operands and clients of another one, wherever both stand.
    pub fn is_like(&self, other: &WriteList) -> bool {
        let mut pairs = self.ranges.iter().zip(&other.ranges);
        self.clients == other.clients
            && self.ranges.len() == other.ranges.len()
            && pairs.all(|(a, b)| is_like(a, b))
    }
}

/// Whether two texts name the same operands. A tag with a `type` may have a new place.
fn is_like(a: &Operands, b: &Operands) -> bool {
    a.text == b.text && a.count == b.count && (a.is_placed || a.first == b.first)
}

impl Default for ModbusServerSettings {
    /// A server on loopback, at a port that needs no privilege, unlike 502.
    fn default() -> ModbusServerSettings {
        ModbusServerSettings {
            listen: SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 1502),
            units: None,
            standard_map: true,
            entries: Vec::new(),
            lists: Vec::new(),
            inputs: None,
            outputs: None,
            connections: 8,
            frame_timeout_ms: 2_000,
            idle_timeout_ms: 60_000,
        }
    }
}

impl ModbusServerSettings {
    /// These settings without write lists, map entries and image: a server that has only reads of
    /// the standard map.
    pub fn bare(self) -> ModbusServerSettings {
        let none = WriteList { ranges: Vec::new(), clients: None };
        ModbusServerSettings {
            lists: vec![none],
            entries: Vec::new(),
            inputs: None,
            outputs: None,
            ..self
        }
    }
}

impl ModbusTable {
    /// All tables with their names in a controller file.
    pub const NAMES: [(&'static str, ModbusTable); 4] = all_variants![
        ("coil", ModbusTable::Coils),
        ("discrete", ModbusTable::DiscreteInputs),
        ("holding", ModbusTable::HoldingRegisters),
        ("input", ModbusTable::InputRegisters),
    ];

    /// Whether its elements are bits.
    pub fn is_bits(self) -> bool {
        matches!(self, ModbusTable::Coils | ModbusTable::DiscreteInputs)
    }

    /// Whether a client can write it.
    pub fn is_writable(self) -> bool {
        matches!(self, ModbusTable::Coils | ModbusTable::HoldingRegisters)
    }

    /// Its name in a controller file.
    pub fn name(self) -> &'static str {
        ModbusTable::NAMES[self as usize].0
    }

    /// The prefix of its elements in the standard map.
    pub fn prefix(self) -> &'static str {
        match self {
            ModbusTable::Coils => "MC",
            ModbusTable::DiscreteInputs => "MI",
            ModbusTable::HoldingRegisters => "MHR",
            ModbusTable::InputRegisters => "MIR",
        }
    }
}

impl MappedOperands {
    /// The number of its addresses.
    pub fn length(&self) -> u32 {
        self.operands.count * u32::from(self.kind.map_or(1, RegisterNumberType::registers))
    }
}
