//! The keys of the Modbus clients (`modbus-tcp`, `modbus-rtu`) in a `[[device]]` and its map.

use super::super::scaling::ScalingKeys;
use rungd_io::modbus::number::{ByteOrder, NumberType, WordOrder};
use rungd_io::modbus_client::settings::{ConnectionUse, Parity, Transaction, Writes};
use rungd_language::source::key::{LEAST_1MS, key, words};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::span::{Located, Span};

/// The words for `driver`: the client over TCP, and over a serial line.
pub const NAMES: [&str; 2] = [TCP, RTU];
const TCP: &str = "modbus-tcp";
const RTU: &str = "modbus-rtu";

const UNITS: (i64, i64) = (0, 255);
const REGISTERS: (i64, i64) = (0, 65_535);
/// The limits of `gap`: more registers would exceed the length of a request.
const GAPS: (i64, i64) = (0, 100);
/// The limits of `max-registers` and `max-bits`: those of a read request.
const REGISTERS_MAX: (i64, i64) = (1, 125);
const BITS_MAX: (i64, i64) = (1, 2000);
const BAUDS: (i64, i64) = (50, 4_000_000);

/// The keys of a `[[device]]` for its peer.
#[derive(Clone, Debug, Default)]
pub struct Keys {
    /// The medium to the peer, if the device names a driver.
    pub medium: Option<Medium>,
    /// `address`: IP address and port.
    pub address: Option<Text>,
    /// `connect-timeout`, ms.
    pub connect_timeout_ms: Option<Located<i32>>,
    /// `connection`: the use of a connection.
    pub connection: Option<Text>,
    /// `transaction`: the check of an answer's transaction.
    pub transaction: Option<Text>,
    /// `port`: the serial line's character device, or the address of a serial server.
    pub port: Option<Text>,
    /// `baud`: bits per second.
    pub baud: Option<Located<i64>>,
    /// `parity`.
    pub parity: Option<Text>,
    /// `stop-bits`.
    pub stop_bits: Option<Located<i64>>,
    /// `echo`: whether the adapter sends requests back.
    pub echo: Option<Located<bool>>,
    /// `broadcast-delay`, ms: the pause after a broadcast.
    pub broadcast_delay_ms: Option<Located<i32>>,
    /// `connect-delay`, ms: the time after connecting without requests.
    pub connect_delay_ms: Option<Located<i32>>,
    /// `pause`, ms: the time from an answer to the next request.
    pub pause_ms: Option<Located<i32>>,
    /// `max-registers` of a request.
    pub max_registers: Option<Located<i64>>,
    /// `max-bits` of a request.
    pub max_bits: Option<Located<i64>>,
    /// `unit` of the rows without a `unit` of their own.
    pub unit: Option<Located<i64>>,
    /// `timeout`, ms: the time limit of one answer.
    pub timeout_ms: Option<Located<i32>>,
    /// `write-every`, ms; 0: on change only.
    pub write_every_ms: Option<Located<i32>>,
    /// `writes`: the function codes of writes.
    pub writes: Option<Text>,
    /// `gap`: the most unmapped registers between two points of one read request.
    pub gap: Option<Located<i64>>,
    /// `watchdog`.
    pub watchdog: Option<Watchdog>,
    /// The keys of each row of the map.
    pub rows: Vec<RowKeys>,
}

/// The medium to a peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Medium {
    /// `modbus-tcp`.
    Tcp,
    /// `modbus-rtu`.
    Serial,
}

/// `watchdog`: a register that the client writes a counter to.
#[derive(Clone, Debug)]
pub struct Watchdog {
    /// The place of its table.
    pub span: Span,
    /// `register`.
    pub register: Option<Located<i64>>,
    /// `every`, ms.
    pub every_ms: Option<Located<i32>>,
    /// `unit`; if not given, the device's.
    pub unit: Option<Located<i64>>,
}

/// The keys of a row of the map for its points.
#[derive(Clone, Debug, Default)]
pub struct RowKeys {
    /// `unit`; if not given, the device's.
    pub unit: Option<Located<i64>>,
    /// `type` of a register's number.
    pub kind: Option<Text>,
    /// `word-order` of a number in several registers.
    pub word_order: Option<Text>,
    /// `byte-order` in each register.
    pub byte_order: Option<Text>,
    /// `split`: each number of 64 bits goes with two words.
    pub split: Option<Located<bool>>,
    /// `multiply`, `divide`, `offset`.
    pub scaling: ScalingKeys,
}

impl Keys {
    /// Keys that have not been read yet; without a name, the keys of both media.
    pub fn of(name: Option<&str>) -> Keys {
        let medium = name.map(|name| if name == RTU { Medium::Serial } else { Medium::Tcp });
        Keys { medium, ..Keys::default() }
    }

    pub(super) fn read_device(&mut self, table: &mut Table<'_>) {
        match self.medium {
            Some(Medium::Tcp) => self.read_tcp(table),
            Some(Medium::Serial) => self.read_line(table),
            None => {
                self.read_tcp(table);
                self.read_line(table);
            }
        }
        self.read_connection(table);
        self.read_habits(table);
        self.unit = table.integer(
            key("unit", "Modbus: the unit of rows without `unit`; 1 if not given."),
            UNITS,
        );
        self.timeout_ms = table.duration(
            key("timeout", "Modbus: the time limit for a whole answer; 200ms if not given.")
                .limited(LEAST_1MS),
        );
        self.write_every_ms = table.duration(key(
            "write-every",
            "Modbus: the interval at which all outputs are written; 1s if not given; 0ms: never.",
        ));
        self.writes = table.string(
            key(
                "writes",
                "Modbus: write by functions 5 and 6, by 15 and 16, or by those that fit.",
            )
            .one_of(|| words(&Writes::NAMES)),
        );
        self.gap = table.integer(
            key(
                "gap",
                "Modbus: the most unmapped registers read between two points; 0 if not given.",
            ),
            GAPS,
        );
        self.watchdog = table
            .table(
                key("watchdog", "Modbus: a holding register to which a counter is written."),
                "a watchdog",
            )
            .map(Watchdog::read);
    }

    fn read_tcp(&mut self, table: &mut Table<'_>) {
        self.address = table.string(key(
            "address",
            "`modbus-tcp`: the peer's IP address and port; port 502 if not given.",
        ));
        self.transaction = table.string(
            key("transaction", "`modbus-tcp`: `ignore` for wrong transactions in answers.")
                .one_of(|| words(&Transaction::NAMES)),
        );
    }

    fn read_line(&mut self, table: &mut Table<'_>) {
        self.port = table.string(key(
            "port",
            "`modbus-rtu`: its serial line's character device, or `tcp://ADDRESS:PORT`.",
        ));
        self.baud =
            table.integer(key("baud", "`modbus-rtu`: bits a second; 19200 if not given."), BAUDS);
        self.parity = table.string(
            key("parity", "`modbus-rtu`: its parity bit; `even` if not given.")
                .one_of(|| words(&Parity::NAMES)),
        );
        self.stop_bits = table.integer(
            key("stop-bits", "`modbus-rtu`: stop bits; 1 if not given, 2 without parity."),
            (1, 2),
        );
        self.echo = table.boolean(key(
            "echo",
            "`modbus-rtu`: its adapter sends requests back; false if not given.",
        ));
        self.broadcast_delay_ms = table.duration(key(
            "broadcast-delay",
            "`modbus-rtu`: the pause after a write to unit 0, which is all units; 100ms if not \
             given.",
        ));
    }

    fn read_connection(&mut self, table: &mut Table<'_>) {
        self.connect_timeout_ms = table.duration(
            key("connect-timeout", "By TCP: the time limit for connecting; 1s if not given.")
                .limited(LEAST_1MS),
        );
        self.connection = table.string(
            key("connection", "By TCP: `per-request` opens a new connection for each request.")
                .one_of(|| words(&ConnectionUse::NAMES)),
        );
    }

    fn read_habits(&mut self, table: &mut Table<'_>) {
        self.connect_delay_ms = table.duration(key(
            "connect-delay",
            "Modbus: the wait from connecting (opening the port) to a request; 0ms if not given.",
        ));
        self.pause_ms = table.duration(key(
            "pause",
            "Modbus: the least time from an answer to the next request; 0ms if not given.",
        ));
        self.max_registers = table.integer(
            key("max-registers", "Modbus: the most registers of a request; 125 if not given."),
            REGISTERS_MAX,
        );
        self.max_bits = table.integer(
            key("max-bits", "Modbus: the most bits of a request; 2000 if not given."),
            BITS_MAX,
        );
    }
}

impl Watchdog {
    fn read(mut table: Table<'_>) -> Watchdog {
        table.require("register", "100");
        let watchdog = Watchdog {
            span: table.span(),
            register: table
                .integer(key("register", "The register's protocol address, from 0."), REGISTERS),
            every_ms: table.duration(
                key("every", "The interval at which it is written; 500ms if not given.")
                    .limited(LEAST_1MS),
            ),
            unit: table
                .integer(key("unit", "The register's unit; the device's if not given."), UNITS),
        };
        table.finish();
        watchdog
    }
}

impl RowKeys {
    pub(super) fn read(row: &mut Table<'_>) -> RowKeys {
        RowKeys {
            unit: row.integer(
                key("unit", "Modbus: its points' unit; the device's if not given."),
                UNITS,
            ),
            kind: row.string(
                key(
                    "type",
                    "Modbus: the number type of one, two or four registers; `u16` if not given.",
                )
                .one_of(|| words(&NumberType::NAMES)),
            ),
            word_order: row.string(
                key("word-order", "Modbus: the register of a number that has the highest 16 bits.")
                    .one_of(|| words(&WordOrder::NAMES)),
            ),
            byte_order: row.string(
                key("byte-order", "Modbus: the byte of each register that comes first.")
                    .one_of(|| words(&ByteOrder::NAMES)),
            ),
            split: row.boolean(key(
                "split",
                "Modbus: a number of 64 bits goes with two words, the higher 32 bits first.",
            )),
            scaling: ScalingKeys::read(row),
        }
    }
}
