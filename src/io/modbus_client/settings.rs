//! The settings of a Modbus client: the way to its peer, and the points to read and write. Made by
//! `controller` from a controller file. They contain no places in the file, because those change
//! with every edit.

use std::net::SocketAddr;

use crate::io::modbus::number::{NumberType, WordOrder};
pub use crate::io::modbus::settings::Table;
use crate::io::scaling::Scaling;

/// A Modbus client's settings.
#[derive(Clone, Debug, PartialEq)]
pub struct ClientSettings {
    /// The way to its peer.
    pub link: Link,
    /// The time limit for a whole answer, ms.
    pub timeout_ms: u32,
    /// The interval at which all outputs are written even if none has changed, ms; 0: never.
    pub write_every_ms: u32,
    /// The functions that write.
    pub writes: Writes,
    /// The most unused registers, or 16 times as many bits, between two points of one read request.
    pub gap: u16,
    /// A register that a counter is written to.
    pub watchdog: Option<Watchdog>,
    /// The points that are read.
    pub inputs: Vec<ModbusPoint>,
    /// The points that are written.
    pub outputs: Vec<ModbusPoint>,
}

/// The way to a peer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Link {
    /// By Modbus TCP.
    Tcp {
        /// The peer's address.
        address: SocketAddr,
        /// The time limit for connecting, ms.
        connect_timeout_ms: u32,
    },
    /// By Modbus RTU.
    Serial(Serial),
}

/// A serial line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Serial {
    /// Its character device.
    pub port: String,
    /// Bits per second.
    pub baud: u32,
    /// The parity bit.
    pub parity: Parity,
    /// The number of stop bits.
    pub stop_bits: u8,
    /// Whether each request comes back before its answer.
    pub echo: bool,
}

/// The parity bit of a character.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Parity {
    None,
    Even,
    Odd,
}

impl Parity {
    /// All values with their names.
    pub(crate) const NAMES: [(&'static str, Parity); 3] =
        [("none", Parity::None), ("even", Parity::Even), ("odd", Parity::Odd)];
}

/// The functions that write.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Writes {
    /// 5 and 6 for one element, 15 and 16 for several.
    #[default]
    Fitting,
    /// Only 5 and 6.
    Single,
    /// Only 15 and 16.
    Multiple,
}

impl Writes {
    /// All values with their names.
    pub(crate) const NAMES: [(&'static str, Writes); 3] =
        [("fitting", Writes::Fitting), ("single", Writes::Single), ("multiple", Writes::Multiple)];
}

/// A holding register that a counter is written to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Watchdog {
    /// The unit.
    pub unit: u8,
    /// Its protocol address.
    pub register: u16,
    /// The interval of the writes, ms.
    pub every_ms: u32,
}

/// A point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ModbusPoint {
    /// The unit.
    pub unit: u8,
    /// The table.
    pub table: Table,
    /// The protocol address of its bit, or of its first register.
    pub at: u16,
    /// The form of its value.
    pub form: PointForm,
}

/// The form of a point's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointForm {
    /// A coil or a discrete input.
    Bit,
    /// A bit of a register; 0 is the lowest.
    RegisterBit(u8),
    /// A number.
    Number(Number),
}

/// A number in a register or a pair of registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Number {
    /// Its type.
    pub kind: NumberType,
    /// The register of a pair that has the higher 16 bits.
    pub order: WordOrder,
    /// The scaling from the number to memory.
    pub scaling: Scaling,
}

impl ModbusPoint {
    /// Points in the order of their places, each with its number in the order of the map.
    pub(super) fn by_place(points: &[ModbusPoint]) -> Vec<(usize, ModbusPoint)> {
        let mut sorted: Vec<(usize, ModbusPoint)> = points.iter().copied().enumerate().collect();
        sorted.sort_by_key(|(at, point)| (point.unit, point.table, point.at, *at));
        sorted
    }

    /// The number of elements of its table that it occupies.
    pub(crate) fn width(&self) -> u16 {
        match self.form {
            PointForm::Number(number) => number.kind.registers(),
            PointForm::Bit | PointForm::RegisterBit(_) => 1,
        }
    }
}
