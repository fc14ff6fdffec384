//! The keys of a Modbus client, resolved: its points and the way to its peer.
//!
//! Called by [`super`], which has resolved the addresses of memory. `points` reads texts like
//! `coil 0..7`; `peers` finds devices of one peer that conflict with each other.

pub(crate) mod keys;
mod peers;
mod points;

use std::net::{IpAddr, SocketAddr};

use super::driver::{
    DriverKeys, ResolvedRow, ResolvedRows, RowDirection, WrittenDevice, at_least_one, one_word,
};
use super::settings::DriverSettings;
use crate::io::modbus::number::{NumberType, WordOrder};
use crate::io::modbus_client::settings::{
    ClientSettings, Link, ModbusPoint, Number, Parity, PointForm, Serial, Watchdog, Writes,
};
use crate::source::finding::{Code, Finding};
use crate::source::reader::Table;
use crate::source::span::{Located, Span};

use keys::{Keys, Medium, RowKeys, Watchdog as WrittenWatchdog};
pub(super) use peers::at_odds;
use points::Stretch;

/// The port of Modbus.
const PORT: u16 = 502;

impl DriverKeys for Keys {
    fn read_row(&mut self, row: &mut Table<'_>) {
        self.rows.push(RowKeys::read(row));
    }

    fn read(&mut self, table: &mut Table<'_>) {
        self.read_device(table);
    }

    fn is_point(&self, text: &str) -> bool {
        points::is_point(text)
    }

    fn example(&self) -> &'static str {
        "coil 0"
    }

    fn resolve(
        &self,
        device: &WrittenDevice,
        rows: ResolvedRows<'_>,
        findings: &mut Vec<Finding>,
    ) -> Option<DriverSettings> {
        client(self, device, rows, findings).map(DriverSettings::Modbus)
    }

    fn other_output(&self) -> Option<Span> {
        self.watchdog.as_ref().map(|watchdog| watchdog.span)
    }
}

fn client(
    keys: &Keys,
    device: &WrittenDevice,
    rows: ResolvedRows<'_>,
    findings: &mut Vec<Finding>,
) -> Option<ClientSettings> {
    let link = match keys.medium? {
        Medium::Tcp => tcp(keys, device, findings),
        Medium::Serial => serial(keys, device, findings),
    };
    let mut reader = ModbusReader { keys, device, findings };
    let unit = reader.unit(keys.unit.as_ref(), 1);
    let writes = one_word("writes", keys.writes.as_ref(), &Writes::NAMES, reader.findings)
        .unwrap_or_default();
    let watchdog = keys.watchdog.as_ref().and_then(|watchdog| reader.watchdog(watchdog, unit));
    let mut points = [Vec::new(), Vec::new()];
    for row in rows.each() {
        let row_unit = reader.unit(keys.rows[row.at].unit.as_ref(), unit);
        let Some(found) = reader.row(row, row_unit) else { continue };
        let is_wide = found.first().is_some_and(|point| point.width() == 2);
        if row.direction == RowDirection::Out && is_wide && writes == Writes::Single {
            let message = "two registers cannot be written as one value with `writes = \"single\"`";
            reader.findings.push(row.find(message.to_owned()));
        }
        points[row.direction as usize].extend(found);
    }
    let [inputs, outputs] = points;
    let timeout_ms = at_least_one("timeout", keys.timeout_ms.as_ref(), 200, findings);
    let write_every_ms = keys.write_every_ms.as_ref().map_or(1000, |ms| ms.value).unsigned_abs();
    let gap = keys.gap.as_ref().map_or(0, |gap| gap.value as u16);
    let link = link?;
    Some(ClientSettings {
        link,
        timeout_ms,
        write_every_ms,
        writes,
        gap,
        watchdog,
        inputs,
        outputs,
    })
}

fn missing(device: &WrittenDevice, key: &str, example: &str) -> Finding {
    let message = format!("a device has no `{key}`");
    let help = format!("give it one: `{key} = \"{example}\"`");
    Finding::new(Code::MissingKey, device.span, message).help(help)
}

fn tcp(keys: &Keys, device: &WrittenDevice, findings: &mut Vec<Finding>) -> Option<Link> {
    let timeout = keys.connect_timeout_ms.as_ref();
    let connect_timeout_ms = at_least_one("connect-timeout", timeout, 1000, findings);
    let Some(text) = &keys.address else {
        findings.push(missing(device, "address", "192.168.1.20:502"));
        return None;
    };
    let alone = || text.text.parse::<IpAddr>().map(|ip| SocketAddr::new(ip, PORT));
    let address = text.text.parse::<SocketAddr>().or_else(|_| alone());
    let Some(address) = address.ok().filter(|address| address.port() != 0) else {
        let message = format!("`{}` is no IP address with a port", text.text);
        let help = "write it as `192.168.1.20:502`, or `[fd00::20]:502`; names are not looked up";
        findings.push(Finding::new(Code::Controller, text.span, message).help(help));
        return None;
    };
    Some(Link::Tcp { address, connect_timeout_ms })
}

fn serial(keys: &Keys, device: &WrittenDevice, findings: &mut Vec<Finding>) -> Option<Link> {
    let baud = keys.baud.as_ref().map_or(19_200, |baud| baud.value as u32);
    let parity =
        one_word("parity", keys.parity.as_ref(), &Parity::NAMES, findings).unwrap_or(Parity::Even);
    // The specification requires eleven bits per character.
    let usual = if parity == Parity::None { 2 } else { 1 };
    let stop_bits = keys.stop_bits.as_ref().map_or(usual, |bits| bits.value as u8);
    let Some(port) = &keys.port else {
        findings.push(missing(device, "port", "/dev/ttyUSB0"));
        return None;
    };
    if !port.text.starts_with('/') {
        let message = format!("`{}` is no path of a serial line", port.text);
        let help = "write it as `/dev/ttyUSB0`, or as `/dev/serial/by-id/…`, which never changes";
        findings.push(Finding::new(Code::Controller, port.span, message).help(help));
        return None;
    }
    let echo = keys.echo.as_ref().is_some_and(|echo| echo.value);
    Some(Link::Serial(Serial { port: port.text.clone(), baud, parity, stop_bits, echo }))
}

/// The reader of one device's keys and rows.
struct ModbusReader<'a> {
    keys: &'a Keys,
    device: &'a WrittenDevice,
    findings: &'a mut Vec<Finding>,
}

impl ModbusReader<'_> {
    fn unit(&mut self, unit: Option<&Located<i64>>, default: u8) -> u8 {
        let Some(unit) = unit else { return default };
        let is_serial = self.keys.medium == Some(Medium::Serial);
        if is_serial && !(1..=247).contains(&unit.value) {
            let message = format!("no unit of a serial line is {}", unit.value);
            let finding = Finding::new(Code::Controller, unit.span, message);
            self.findings.push(finding.help("units are 1 to 247"));
        }
        unit.value as u8
    }

    fn watchdog(&mut self, watchdog: &WrittenWatchdog, unit: u8) -> Option<Watchdog> {
        let unit = self.unit(watchdog.unit.as_ref(), unit);
        let every_ms = at_least_one("every", watchdog.every_ms.as_ref(), 500, self.findings);
        let poll_ms = self.device.poll_ms.as_ref().map_or(20, |ms| ms.value.unsigned_abs());
        if every_ms < poll_ms {
            let span = watchdog.every_ms.as_ref().map_or(watchdog.span, |every| every.span);
            let message =
                format!("the watchdog is written at exchanges, and `poll` is {poll_ms}ms");
            let help = format!("write `every = \"{poll_ms}ms\"`, or more");
            self.findings.push(Finding::new(Code::Controller, span, message).help(help));
        }
        let register = watchdog.register.as_ref()?.value as u16;
        Some(Watchdog { unit, register, every_ms })
    }

    /// The points of a row, one for each address.
    fn row(&mut self, row: &ResolvedRow<'_>, unit: u8) -> Option<Vec<ModbusPoint>> {
        let stretch = points::parse(row.points).map_err(|finding| self.findings.push(finding));
        let stretch = stretch.ok()?;
        let is_bits = stretch.table.is_bits() || stretch.is_bits_of_registers;
        if let Some(finding) = mismatch(row, &stretch, is_bits) {
            self.findings.push(finding);
            return None;
        }
        let number = self.number(&self.keys.rows[row.at], row.is_real(), is_bits)?;
        let width = if is_bits { 1 } else { u32::from(number.kind.registers()) };
        let (wanted, count) = (row.addresses.len() as u32 * width, stretch.count);
        if wanted != count {
            self.findings.push(wrong_count(row, &stretch, width));
            return None;
        }
        let point = |at: u32| {
            let (at, form) = match (is_bits, stretch.is_bits_of_registers) {
                (_, true) => (at / 16, PointForm::RegisterBit((at % 16) as u8)),
                (true, _) => (at, PointForm::Bit),
                (false, _) => (at, PointForm::Number(number)),
            };
            ModbusPoint { unit, table: stretch.table, at: at as u16, form }
        };
        let last = stretch.first + count;
        Some((stretch.first..last).step_by(width as usize).map(point).collect())
    }

    /// The form of the numbers in a row's registers, according to the row's keys.
    fn number(&mut self, keys: &RowKeys, real: bool, is_bits: bool) -> Option<Number> {
        let before = self.findings.len();
        let places = [&keys.kind, &keys.word_order].map(|text| text.as_ref().map(|t| t.span));
        for (name, place) in ["type", "word-order"].iter().zip(places) {
            if let (true, Some(span)) = (is_bits, place) {
                let message = format!("a bit has no `{name}`");
                self.findings.push(Finding::new(Code::Controller, span, message));
            }
        }
        if is_bits {
            keys.scaling.refuse(self.findings);
        }
        let kind = match &keys.kind {
            Some(text) => one_word("type", Some(text), &NumberType::NAMES, self.findings),
            None => Some(NumberType::U16),
        };
        let order =
            one_word("word-order", keys.word_order.as_ref(), &WordOrder::NAMES, self.findings);
        let is_one = kind.is_some_and(|kind| kind.registers() == 1);
        if let (Some(text), true, false) = (&keys.word_order, is_one, is_bits) {
            let message = "a single register has no word order";
            let finding = Finding::new(Code::Controller, text.span, message);
            self.findings.push(finding.help("only `u32`, `i32` and `f32` have a `word-order`"));
        }
        let scaling = keys.scaling.resolve(real, self.findings);
        let kind = kind.filter(|_| self.findings.len() == before)?;
        Some(Number { kind, order: order.unwrap_or_default(), scaling })
    }
}

/// A finding about the points of a row.
fn of_points(row: &ResolvedRow<'_>, message: String) -> Finding {
    Finding::new(Code::Controller, row.points.span, message)
}

fn mismatch(row: &ResolvedRow<'_>, stretch: &Stretch, is_bits: bool) -> Option<Finding> {
    let name = stretch.table.name();
    if row.direction == RowDirection::Out && !stretch.table.is_writable() {
        let message = format!("`{}` can only be read", row.points.text);
        return Some(of_points(row, message).help("outputs go to `coil` and `holding`"));
    }
    let memory = &row.text.text;
    match (is_bits, row.is_words()) {
        (true, true) => {
            let message = format!("`{}` names bits, and `{memory}` names words", row.points.text);
            Some(of_points(row, message).help("words go with `holding` and `input`"))
        }
        (false, false) => {
            let message = format!("`{}` names words, and `{memory}` names bits", row.points.text);
            let help = format!("a register's lowest bit is written `{name} {}.0`", stretch.first);
            Some(of_points(row, message).help(help))
        }
        _ => None,
    }
}

fn wrong_count(row: &ResolvedRow<'_>, stretch: &Stretch, width: u32) -> Finding {
    let (count, addresses) = (stretch.count, row.addresses.len() as u32);
    let (memory, name) = (&row.text.text, stretch.table.name());
    let points = match (width, count) {
        (2, 1) => "register",
        (2, _) => "registers",
        (_, 1) => "point",
        _ => "points",
    };
    let needed = addresses * width;
    let message = format!("{count} {points} for `{memory}`, which needs {needed}");
    let (first, last) = (stretch.first, stretch.first + addresses * width - 1);
    let end = if stretch.is_bits_of_registers { ELEMENTS * 16 } else { ELEMENTS };
    if last >= end {
        return of_points(row, message).help(no_room(name, width, addresses, end));
    }
    let show = |at: u32| match stretch.is_bits_of_registers {
        true => format!("{}.{}", at / 16, at % 16),
        false => at.to_string(),
    };
    let help = match last == first {
        true => format!("write `{name} {}`", show(first)),
        false => format!("write `{name} {}..{}`", show(first), show(last)),
    };
    of_points(row, message).help(help)
}

/// The number of elements of a table.
const ELEMENTS: u32 = 65_536;

/// The help for points that do not fit between the first point and the end of the table: it names
/// the last stretch that fits. `end` is the number of elements in the table, or of bits for bits of
/// registers.
fn no_room(name: &str, width: u32, addresses: u32, end: u32) -> String {
    let what = match (width, addresses) {
        (2, 1) => "a number of this type takes two registers".to_owned(),
        (2, _) => format!("{addresses} numbers of this type take two registers each"),
        _ => format!("{addresses} points take as many addresses"),
    };
    let wanted = addresses * width;
    if wanted > end {
        return format!("{what}, and a table has 65536");
    }
    let first = end - wanted;
    let (first, last) = match end > ELEMENTS {
        true => (format!("{}.{}", first / 16, first % 16), "65535.15".to_owned()),
        false => (first.to_string(), "65535".to_owned()),
    };
    format!("{what}: the last that fit are `{name} {first}..{last}`")
}
