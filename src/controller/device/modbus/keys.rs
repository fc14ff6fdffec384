//! The keys of the Modbus clients (`modbus-tcp`, `modbus-rtu`) in a `[[device]]` and its map.

use super::super::keys::{Kind, belongs};
use crate::source::reader::{Table, Text};
use crate::source::span::{Located, Span};

const DRIVERS: [Kind; 2] = [Kind::ModbusTcp, Kind::ModbusRtu];
const UNITS: (i64, i64) = (0, 255);
const REGISTERS: (i64, i64) = (0, 65_535);
/// More bridged registers than this would make requests longer than they may be.
const GAPS: (i64, i64) = (0, 100);
const BAUDS: (i64, i64) = (50, 4_000_000);
const FACTORS: (i64, i64) = (-1_000_000, 1_000_000);
const DIVISORS: (i64, i64) = (1, 1_000_000);
const OFFSETS: (i64, i64) = (i32::MIN as i64, i32::MAX as i64);

/// What a `[[device]]` says of its line.
#[derive(Clone, Debug, Default)]
pub struct Keys {
    /// `address`: IP address and port.
    pub address: Option<Text>,
    /// `connect-timeout`, ms.
    pub connect_timeout_ms: Option<Located<i32>>,
    /// `port`: the serial line's character device.
    pub port: Option<Text>,
    /// `baud`: bits a second.
    pub baud: Option<Located<i64>>,
    /// `parity`.
    pub parity: Option<Text>,
    /// `stop-bits`.
    pub stop_bits: Option<Located<i64>>,
    /// `echo`: the adapter sends requests back.
    pub echo: Option<Located<bool>>,
    /// `unit` of the rows that name none.
    pub unit: Option<Located<i64>>,
    /// `timeout`, ms: of one answer.
    pub timeout_ms: Option<Located<i32>>,
    /// `write-every`, ms; 0: on change only.
    pub write_every_ms: Option<Located<i32>>,
    /// `writes`: which functions.
    pub writes: Option<Text>,
    /// `gap`: registers that are read though nobody asked.
    pub gap: Option<Located<i64>>,
    /// `watchdog`.
    pub watchdog: Option<Watchdog>,
}

/// `watchdog`: a register that is fed.
#[derive(Clone, Debug)]
pub struct Watchdog {
    /// Its place.
    pub span: Span,
    /// `register`.
    pub register: Option<Located<i64>>,
    /// `every`, ms.
    pub every_ms: Option<Located<i32>>,
    /// `unit`; else the device's.
    pub unit: Option<Located<i64>>,
}

/// What a row of the map says of its points.
#[derive(Clone, Debug, Default)]
pub struct EntryKeys {
    /// `unit`; else the device's.
    pub unit: Option<Located<i64>>,
    /// `type` of a register's number.
    pub kind: Option<Text>,
    /// `word-order` of a number in two registers.
    pub word_order: Option<Text>,
    /// `multiply`.
    pub multiply: Option<Located<i64>>,
    /// `divide`.
    pub divide: Option<Located<i64>>,
    /// `offset`.
    pub offset: Option<Located<i64>>,
}

impl Keys {
    pub(in crate::controller::device) fn read(table: &mut Table<'_>, driver: Option<Kind>) -> Keys {
        let mut keys = Keys::default();
        if belongs(driver, &[Kind::ModbusTcp]) {
            keys.address = table.string("address");
            keys.connect_timeout_ms = table.duration("connect-timeout");
        }
        if belongs(driver, &[Kind::ModbusRtu]) {
            keys.port = table.string("port");
            keys.baud = table.integer("baud", BAUDS);
            keys.parity = table.string("parity");
            keys.stop_bits = table.integer("stop-bits", (1, 2));
            keys.echo = table.boolean("echo");
        }
        if belongs(driver, &DRIVERS) {
            keys.unit = table.integer("unit", UNITS);
            keys.timeout_ms = table.duration("timeout");
            keys.write_every_ms = table.duration("write-every");
            keys.writes = table.string("writes");
            keys.gap = table.integer("gap", GAPS);
            keys.watchdog = table.table("watchdog", "a watchdog").map(Watchdog::read);
        }
        keys
    }
}

impl Watchdog {
    fn read(mut table: Table<'_>) -> Watchdog {
        table.require("register", "100");
        let watchdog = Watchdog {
            span: table.span(),
            register: table.integer("register", REGISTERS),
            every_ms: table.duration("every"),
            unit: table.integer("unit", UNITS),
        };
        table.finish();
        watchdog
    }
}

impl EntryKeys {
    pub(in crate::controller::device) fn read(
        row: &mut Table<'_>,
        driver: Option<Kind>,
    ) -> EntryKeys {
        if !belongs(driver, &DRIVERS) {
            return EntryKeys::default();
        }
        EntryKeys {
            unit: row.integer("unit", UNITS),
            kind: row.string("type"),
            word_order: row.string("word-order"),
            multiply: row.integer("multiply", FACTORS),
            divide: row.integer("divide", DIVISORS),
            offset: row.integer("offset", OFFSETS),
        }
    }
}
