//! How a Modbus client reaches its peer, and what it reads and writes there: a driver's settings,
//! as `controller` makes them of a controller file. No places: these move with every edit.

use std::net::SocketAddr;

use crate::io::modbus::number::{NumberType, WordOrder};
pub use crate::io::modbus::settings::Table;

/// A Modbus client's settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Client {
    /// How its peer is reached.
    pub link: Link,
    /// An answer must be whole by then, ms.
    pub timeout_ms: u32,
    /// From one write of all outputs to the next though none changed, ms; 0: never.
    pub write_every_ms: u32,
    /// The functions that write.
    pub writes: Writes,
    /// The number of registers (of bits: 16 times as many) between two points that are read with
    /// them.
    pub gap: u16,
    /// A register that is fed.
    pub watchdog: Option<Watchdog>,
    /// What is read, point by point.
    pub inputs: Vec<Point>,
    /// What is written, point by point.
    pub outputs: Vec<Point>,
}

/// How a peer is reached.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Link {
    /// By Modbus TCP.
    Tcp {
        /// Where.
        address: SocketAddr,
        /// A connection must be made by then, ms.
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
    /// Bits a second.
    pub baud: u32,
    /// The parity bit.
    pub parity: Parity,
    /// How many stop bits.
    pub stop_bits: u8,
    /// Requests come back first, before their answers.
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
    /// All by name.
    pub const NAMES: [(&'static str, Parity); 3] =
        [("none", Parity::None), ("even", Parity::Even), ("odd", Parity::Odd)];
}

/// The functions that write.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Writes {
    /// 5 and 6 where one point is written, 15 and 16 where several are.
    #[default]
    Fitting,
    /// 5 and 6 alone.
    Single,
    /// 15 and 16 alone.
    Multiple,
}

impl Writes {
    /// All by name.
    pub const NAMES: [(&'static str, Writes); 3] =
        [("fitting", Writes::Fitting), ("single", Writes::Single), ("multiple", Writes::Multiple)];
}

/// A holding register to which a counter is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Watchdog {
    /// The unit.
    pub unit: u8,
    /// Its protocol address.
    pub register: u16,
    /// How often, ms.
    pub every_ms: u32,
}

/// A point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Point {
    /// The unit.
    pub unit: u8,
    /// In which table.
    pub table: Table,
    /// The protocol address of its bit, or of its first register.
    pub at: u16,
    /// What stands there.
    pub form: PointForm,
}

/// What stands at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointForm {
    /// A coil, a discrete input.
    Bit,
    /// A bit of a register; 0 is the lowest.
    RegisterBit(u8),
    /// A number.
    Number(Number),
}

/// A number in one register, or two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Number {
    /// Its type.
    pub kind: NumberType,
    /// Which of two registers has the higher 16 bits.
    pub order: WordOrder,
    /// Never 0. A value of memory is the number, times this,
    pub multiply: i32,
    /// divided by this, which is at least 1,
    pub divide: i32,
    /// plus this.
    pub offset: i32,
}

impl Point {
    /// How many elements of its table it takes.
    pub fn width(&self) -> u16 {
        match self.form {
            PointForm::Number(number) => number.kind.registers(),
            PointForm::Bit | PointForm::RegisterBit(_) => 1,
        }
    }
}
