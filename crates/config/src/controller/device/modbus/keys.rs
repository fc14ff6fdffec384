//! The keys of the Modbus clients (`modbus-tcp`, `modbus-rtu`) in a `[[device]]` and its map.

use std::ops::RangeInclusive;

use super::super::scaling::ScalingKeys;
use super::link::{self, Medium, SOME_TIME};
use rungd_io::modbus::number::{ByteOrder, RegisterNumberType, WordOrder};
use rungd_io::modbus_client::settings::{LinkSettings, PeerHabits, WriteFunctions};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::{Key, key};
use rungd_language::source::reader::Table;
use rungd_language::source::span::{Located, Span};
use rungd_language::source::value_kind::{KeyWords, Millis};

/// The words for `driver`: the client over TCP, and over a serial line.
pub const NAMES: [&str; 2] = [TCP, RTU];
const TCP: &str = "modbus-tcp";
const RTU: &str = "modbus-rtu";

const UNITS: RangeInclusive<i64> = 0..=255;
const REGISTERS: RangeInclusive<i64> = 0..=65_535;
/// The limits of `gap`. With 100, the two points beside it still fit into one request.
const GAPS: RangeInclusive<i64> = 0..=100;
/// The limits of `max-registers` and `max-bits`: those of a read request.
const REGISTERS_MAX: RangeInclusive<i64> = 1..=125;
const BITS_MAX: RangeInclusive<i64> = 1..=2000;

const TIMEOUT_MS: u32 = 200;
const WRITE_EVERY_MS: u32 = 1000;
const WATCHDOG_MS: u32 = 500;

/// The keys of a `[[device]]` for its peer.
#[derive(Clone, Debug, Default)]
pub struct ModbusKeys {
    /// The medium to the peer, if the device names a driver.
    pub medium: Option<Medium>,
    /// The way to the peer; `None` after a finding.
    pub link: Option<LinkSettings>,
    /// The habits of the peer.
    pub habits: PeerHabits,
    /// The place of `pause`.
    pub pause_at: Option<Span>,
    /// `unit` of the rows without a `unit` of their own.
    pub unit: u8,
    /// `timeout`, ms: the time limit of one answer.
    pub timeout_ms: u32,
    /// `write-every`, ms; 0: on change only.
    pub write_every_ms: u32,
    /// `writes`: the function codes of writes.
    pub writes: WriteFunctions,
    /// `gap`: the most unmapped registers between two points of one read request.
    pub gap: u16,
    /// `watchdog`.
    pub watchdog: Option<WrittenWatchdog>,
    /// The keys of each row of the map.
    pub rows: Vec<ModbusRowKeys>,
}

/// `watchdog`: a register that the client writes a counter to.
#[derive(Clone, Debug)]
pub struct WrittenWatchdog {
    /// The place of its table.
    pub span: Span,
    /// `register`.
    pub register: Option<Located<u16>>,
    /// `every`, ms, and its place.
    pub every_ms: u32,
    pub every_at: Span,
    /// `unit`; if not given, the device's.
    pub unit: Option<u8>,
}

/// The keys of a row of the map for its points.
#[derive(Clone, Debug, Default)]
pub struct ModbusRowKeys {
    /// `unit`; if not given, the device's.
    pub unit: Option<u8>,
    /// `type` of a register's number.
    pub kind: Option<Located<RegisterNumberType>>,
    /// `word-order` of a number in several registers.
    pub word_order: Option<Located<WordOrder>>,
    /// `byte-order` in each register.
    pub byte_order: Option<Located<ByteOrder>>,
    /// Whether `type` has a wrong word.
    pub has_wrong_type: bool,
    /// Whether `word-order` or `byte-order` has a wrong word.
    pub has_wrong_order: bool,
    /// `split`: each number of 64 bits goes with two words.
    pub split: Option<Located<bool>>,
    /// `multiply`, `divide`, `offset`.
    pub scaling: ScalingKeys,
}

impl ModbusKeys {
    /// Keys that have not been read yet; without a name, the keys of both media.
    pub fn of(name: Option<&str>) -> ModbusKeys {
        let medium = name.map(|name| if name == RTU { Medium::Serial } else { Medium::Tcp });
        ModbusKeys { medium, ..ModbusKeys::default() }
    }

    pub(super) fn read_device(&mut self, table: &mut Table<'_>) {
        let (link, broadcast_delay_ms) = link::read(table, self.medium);
        (self.link, self.habits.broadcast_delay_ms) = (link, broadcast_delay_ms);
        self.read_habits(table);
        let explained = key("unit", "Modbus: the unit of rows without `unit`; 1 if not given.");
        self.unit = self.read_unit(table, explained).unwrap_or(1);
        let explained =
            key("timeout", "Modbus: the time limit for a whole answer; 200ms if not given.");
        self.timeout_ms = table.value_of(explained, &SOME_TIME).unwrap_or(TIMEOUT_MS);
        let explained = key(
            "write-every",
            "Modbus: the interval at which all outputs are written; 1s if not given; 0ms: never.",
        );
        self.write_every_ms = table.value_of(explained, &Millis::ANY).unwrap_or(WRITE_EVERY_MS);
        let explained = key(
            "writes",
            "Modbus: write by functions 5 and 6, by 15 and 16, or by those that fit.",
        );
        self.writes =
            table.value_of(explained, &KeyWords::new(&WriteFunctions::NAMES)).unwrap_or_default();
        let explained = key(
            "gap",
            "Modbus: the most unmapped registers read between two points; 0 if not given.",
        );
        self.gap = table.whole(explained, GAPS).map_or(0, |gap| gap.value);
        let explained =
            key("watchdog", "Modbus: a holding register to which a counter is written.");
        let watchdog = table.table(explained, "a watchdog");
        self.watchdog = watchdog.map(|table| self.read_watchdog(table));
    }

    fn read_habits(&mut self, table: &mut Table<'_>) {
        let explained = key(
            "connect-delay",
            "Modbus: the wait from connecting (opening the port) to a request; 0ms if not given.",
        );
        let connect_delay_ms = table.value_of(explained, &Millis::at_most_s(60));
        let explained = key(
            "pause",
            "Modbus: the least time from an answer to the next request; 0ms if not given.",
        );
        let pause = table.value(explained, &Millis::at_most_s(10));
        let explained =
            key("max-registers", "Modbus: the most registers of a request; 125 if not given.");
        let registers = table.whole(explained, REGISTERS_MAX);
        let explained = key("max-bits", "Modbus: the most bits of a request; 2000 if not given.");
        let bits = table.whole(explained, BITS_MAX);
        self.pause_at = pause.as_ref().map(|pause| pause.span);
        let usual = self.habits;
        self.habits = PeerHabits {
            connect_delay_ms: connect_delay_ms.unwrap_or(usual.connect_delay_ms),
            pause_ms: pause.map_or(usual.pause_ms, |pause| pause.value),
            registers_max: registers.map_or(usual.registers_max, |most| most.value),
            bits_max: bits.map_or(usual.bits_max, |most| most.value),
            ..usual
        };
    }

    fn read_watchdog(&self, mut table: Table<'_>) -> WrittenWatchdog {
        table.require("register", "100");
        let span = table.span();
        let register =
            table.whole(key("register", "The register's protocol address, from 0."), REGISTERS);
        let explained = key("every", "The interval at which it is written; 500ms if not given.");
        let every = table.value(explained, &SOME_TIME);
        let explained = key("unit", "The register's unit; the device's if not given.");
        let unit = self.read_unit(&mut table, explained);
        table.finish();
        let every = every.unwrap_or(Located { value: WATCHDOG_MS, span });
        WrittenWatchdog { span, register, every_ms: every.value, every_at: every.span, unit }
    }

    /// The number of a unit.
    fn read_unit(&self, table: &mut Table<'_>, explained: Key) -> Option<u8> {
        let Located { value: unit, span } = table.whole(explained, UNITS)?;
        if self.medium == Some(Medium::Serial) && unit > 247 {
            let message = format!("no unit of a serial line is {unit}");
            let finding = Finding::new(Code::Controller, span, message);
            table.find(finding.help("units are 1 to 247; 0 writes to all of them"));
        }
        Some(unit)
    }

    pub(super) fn read_row_keys(&mut self, row: &mut Table<'_>) {
        let explained = key("unit", "Modbus: its points' unit; the device's if not given.");
        let unit = self.read_unit(row, explained);
        let explained = key(
            "type",
            "Modbus: the number type of one, two or four registers; `u16` if not given.",
        );
        let kind = row.value(explained, &KeyWords::new(&RegisterNumberType::NAMES));
        let explained =
            key("word-order", "Modbus: the register of a number that has the highest 16 bits.");
        let word_order = row.value(explained, &KeyWords::new(&WordOrder::NAMES));
        let explained = key("byte-order", "Modbus: the byte of each register that comes first.");
        let byte_order = row.value(explained, &KeyWords::new(&ByteOrder::NAMES));
        let explained = key(
            "split",
            "Modbus: a number of 64 bits goes with two words, the higher 32 bits first.",
        );
        let split = row.boolean(explained);
        let has_wrong_type = row.has("type") && kind.is_none();
        let has_wrong_order = (row.has("word-order") && word_order.is_none())
            || (row.has("byte-order") && byte_order.is_none());
        let scaling = ScalingKeys::read(row);
        let keys = ModbusRowKeys {
            unit,
            kind,
            word_order,
            byte_order,
            has_wrong_type,
            has_wrong_order,
            split,
            scaling,
        };
        self.rows.push(keys);
    }
}
