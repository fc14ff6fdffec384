//! The settings of a Modbus client: the way to its peer, and the points to read and write. Made by
//! `controller` from a controller file. They contain no places in the file, because those change
//! with every edit.

use std::net::SocketAddr;

use crate::modbus::number::{NumberOrder, RegisterNumberType, WordOrder};
use crate::modbus::pdu::{READ_BITS_MAX, READ_WORDS_MAX};
pub use crate::modbus::settings::ModbusTable;
use crate::scaling::Scaling;

/// A Modbus client's settings.
#[derive(Clone, Debug, PartialEq)]
pub struct ClientSettings {
    /// The way to its peer.
    pub link: LinkSettings,
    /// The time limit for a whole answer, ms.
    pub timeout_ms: u32,
    /// The peer's limits and pauses.
    pub habits: PeerHabits,
    /// The interval at which all outputs are written even if none has changed, ms; 0: never.
    pub write_every_ms: u32,
    /// The functions that write.
    pub writes: WriteFunctions,
    /// The most unused registers, or 16 times as many bits, between two points of one read request.
    pub gap: u16,
    /// A register that a counter is written to.
    pub watchdog: Option<Watchdog>,
    /// The points that are read.
    pub inputs: Vec<ModbusPoint>,
    /// The points that are written.
    pub outputs: Vec<ModbusPoint>,
}

/// The way to a peer: the frames, and what carries them. [`PeerHabits`] are the same for every way.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkSettings {
    /// Frames of Modbus TCP over TCP.
    Tcp(TcpLink),
    /// Frames of Modbus RTU over a line.
    Rtu(RtuLine),
}

/// The way by Modbus TCP.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TcpLink {
    /// The peer.
    pub peer: TcpPeer,
    /// The check of an answer's transaction.
    pub transaction: Transaction,
}

/// A peer that is reached over TCP, whatever its frames are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TcpPeer {
    /// Its address.
    pub address: SocketAddr,
    /// The time limit for connecting, ms.
    pub connect_timeout_ms: u32,
    /// The use of a connection.
    pub connection: ConnectionUse,
}

/// A line with frames of Modbus RTU, which several devices may share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RtuLine {
    /// What carries the frames.
    pub port: RtuPort,
    /// Whether each request comes back before its answer.
    pub echo: bool,
}

/// What carries the frames of Modbus RTU.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RtuPort {
    /// A serial line of this machine.
    Serial(SerialSettings),
    /// TCP, to a serial server that passes on all bytes.
    Tcp(TcpPeer),
}

/// A serial line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SerialSettings {
    /// Its character device.
    pub path: String,
    /// Bits per second.
    pub baud: u32,
    /// The parity bit.
    pub parity: Parity,
    /// The number of stop bits.
    pub stop_bits: u8,
}

/// The use of a connection over TCP.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ConnectionUse {
    /// It is kept for all requests.
    #[default]
    Kept,
    /// Each request has a new one.
    PerRequest,
}

/// The check of the transaction in an answer by Modbus TCP.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Transaction {
    /// It must be the request's.
    #[default]
    Check,
    /// Any is accepted; an answer that is late ends the connection.
    Ignore,
}

/// The habits of a peer that its requests respect, by any link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PeerHabits {
    /// The time after connecting, or opening the port, in which nothing is sent, ms.
    pub connect_delay_ms: u32,
    /// The least time from an answer to the next request, ms.
    pub pause_ms: u32,
    /// The time after a broadcast in which nothing is sent, ms.
    pub broadcast_delay_ms: u32,
    /// The most registers of a request.
    pub registers_max: u16,
    /// The most bits of a request.
    pub bits_max: u16,
}

impl RtuPort {
    /// Its name for people, and in comparisons of devices: a path, or `tcp://ADDRESS`.
    pub fn name(&self) -> String {
        match self {
            RtuPort::Serial(serial) => serial.path.clone(),
            RtuPort::Tcp(peer) => format!("tcp://{}", peer.address),
        }
    }
}

impl ConnectionUse {
    /// All values with their names.
    pub const NAMES: [(&'static str, ConnectionUse); 2] =
        [("kept", ConnectionUse::Kept), ("per-request", ConnectionUse::PerRequest)];
}

impl Transaction {
    /// All values with their names.
    pub const NAMES: [(&'static str, Transaction); 2] =
        [("check", Transaction::Check), ("ignore", Transaction::Ignore)];
}

impl PeerHabits {
    /// The time after a broadcast if no key gives one: the specification's 100 to 200 ms.
    pub const BROADCAST_DELAY_MS: u32 = 100;

    /// The most elements of a table in one request, within the protocol's `most`.
    pub(super) fn elements_max(&self, table: ModbusTable, most: u16) -> u16 {
        most.min(if table.is_bits() { self.bits_max } else { self.registers_max })
    }
}

impl Default for PeerHabits {
    /// Those of a peer that does everything that the specification allows.
    fn default() -> PeerHabits {
        PeerHabits {
            connect_delay_ms: 0,
            pause_ms: 0,
            broadcast_delay_ms: Self::BROADCAST_DELAY_MS,
            registers_max: READ_WORDS_MAX,
            bits_max: READ_BITS_MAX,
        }
    }
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
    pub const NAMES: [(&'static str, Parity); 3] =
        [("none", Parity::None), ("even", Parity::Even), ("odd", Parity::Odd)];
}

/// The functions that write.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WriteFunctions {
    /// 5 and 6 for one element, 15 and 16 for several.
    #[default]
    Fitting,
    /// Only 5 and 6.
    Single,
    /// Only 15 and 16.
    Multiple,
}

impl WriteFunctions {
    /// All values with their names.
    pub const NAMES: [(&'static str, WriteFunctions); 3] = [
        ("fitting", WriteFunctions::Fitting),
        ("single", WriteFunctions::Single),
        ("multiple", WriteFunctions::Multiple),
    ];
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
    pub table: ModbusTable,
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
    Number(RegisterNumber),
}

/// A number in one, two or four registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RegisterNumber {
    /// Its type.
    pub kind: RegisterNumberType,
    /// The order of its bytes.
    pub order: NumberOrder,
    /// What the point has of it.
    pub part: NumberPart,
    /// The scaling from the number to memory.
    pub scaling: Scaling,
}

/// What a point has of its number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NumberPart {
    /// All of it.
    #[default]
    Whole,
    /// The higher 32 of its 64 bits.
    High,
    /// The lower 32 of its 64 bits.
    Low,
}

impl ModbusPoint {
    /// Points in the order of their places, each with its number in the order of the map.
    pub(super) fn by_place(points: &[ModbusPoint]) -> Vec<(usize, ModbusPoint)> {
        let mut sorted: Vec<(usize, ModbusPoint)> = points.iter().copied().enumerate().collect();
        sorted.sort_by_key(|(at, point)| (point.unit, point.table, point.at, *at));
        sorted
    }

    /// The number of elements of its table that it occupies.
    pub fn width(&self) -> u16 {
        match self.form {
            PointForm::Number(number) => number.kind.registers(),
            PointForm::Bit | PointForm::RegisterBit(_) => 1,
        }
    }

    /// The elements that it writes, as an output: those of its half, if it has half a number.
    pub fn written(&self) -> std::ops::Range<u32> {
        let (at, width) = (u32::from(self.at), u32::from(self.width()));
        let PointForm::Number(RegisterNumber { part, order, .. }) = self.form else {
            return at..at + width;
        };
        let is_first = (part == NumberPart::High) == (order.words == WordOrder::HighFirst);
        match (part, is_first) {
            (NumberPart::Whole, _) => at..at + width,
            (NumberPart::High | NumberPart::Low, true) => at..at + width / 2,
            (NumberPart::High | NumberPart::Low, false) => at + width / 2..at + width,
        }
    }
}
