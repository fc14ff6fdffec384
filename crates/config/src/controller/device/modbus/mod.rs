//! The keys of a Modbus client, resolved: its points and the way to its peer.
//!
//! Called by [`super`], which has resolved the addresses of memory. `points` reads texts like
//! `coil 0..7`, `manuals` those of manuals and other programs; `peers` finds devices of one peer
//! that conflict with each other.

pub(crate) mod keys;
mod link;
mod manuals;
mod numbers;
mod peers;
pub(super) mod points;
mod stretch;

use super::driver::{DriverKeys, ResolvedRow, ResolvedRows, RowDirection, WrittenDevice};
use super::settings::DriverSettings;
use rungd_io::modbus_client::settings::{
    ClientSettings, ModbusPoint, PointForm, Watchdog, WriteFunctions,
};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Help, advise, pair, possible, propose, proposed};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::span::Span;

use keys::{ModbusKeys, WrittenWatchdog};
use link::Medium;
pub(super) use peers::at_odds;
use stretch::ElementStretch;

impl DriverKeys for ModbusKeys {
    fn read_row(&mut self, row: &mut Table<'_>) {
        self.read_row_keys(row);
    }

    fn read(&mut self, table: &mut Table<'_>) {
        self.read_device(table);
    }

    fn is_point(&self, text: &str, _device: &str) -> bool {
        points::is_point(text)
    }

    fn other_notation(&self, text: &Text) -> Option<Finding> {
        points::other_notation(text)
    }

    fn example(&self, _device: &str) -> String {
        "coil 0".to_owned()
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
    keys: &ModbusKeys,
    device: &WrittenDevice,
    rows: ResolvedRows<'_>,
    findings: &mut Vec<Finding>,
) -> Option<ClientSettings> {
    let mut reader = ModbusReader { keys, device, findings };
    reader.pause_in_time();
    let watchdog = keys.watchdog.as_ref().and_then(|watchdog| reader.watchdog(watchdog));
    let mut points = [Vec::new(), Vec::new()];
    for row in rows.each() {
        let unit = keys.rows[row.at].unit.unwrap_or(keys.unit);
        let Some(found) = reader.row(row, unit) else { continue };
        let is_wide = found.first().is_some_and(|point| point.width() > 1);
        if row.direction == RowDirection::Out && is_wide && keys.writes == WriteFunctions::Single {
            let message =
                "several registers cannot be written as one value with `writes = \"single\"`";
            reader.findings.push(row.find(message.to_owned()));
        }
        points[row.direction as usize].extend(found);
    }
    let [inputs, outputs] = points;
    Some(ClientSettings {
        link: keys.link.clone()?,
        timeout_ms: keys.timeout_ms,
        habits: keys.habits,
        write_every_ms: keys.write_every_ms,
        writes: keys.writes,
        gap: keys.gap,
        watchdog,
        inputs,
        outputs,
    })
}

/// The reader of one device's keys and rows.
struct ModbusReader<'a> {
    keys: &'a ModbusKeys,
    device: &'a WrittenDevice,
    findings: &'a mut Vec<Finding>,
}

impl ModbusReader<'_> {
    /// A finding for a pause in which the device would be lost.
    fn pause_in_time(&mut self) {
        let (pause_ms, loss_after_ms) = (self.keys.habits.pause_ms, self.device.loss_after_ms());
        let Some(span) = self.keys.pause_at.filter(|_| pause_ms >= loss_after_ms) else { return };
        let message = format!("the device is lost after {loss_after_ms} ms, in one `pause`");
        let loss_after = format!("loss-after = \"{}ms\"", u64::from(pause_ms) * 3);
        let help = propose(pair(loss_after))
            .and(", or more: an exchange has a pause for each of its requests");
        self.findings.push(Finding::new(Code::Controller, span, message).help(help));
    }

    fn watchdog(&mut self, watchdog: &WrittenWatchdog) -> Option<Watchdog> {
        let (every_ms, poll_ms) = (watchdog.every_ms, self.device.poll_ms());
        if every_ms < poll_ms {
            let message =
                format!("the watchdog is written at exchanges, and `poll` is {poll_ms}ms");
            let help = propose(pair(format!("every = \"{poll_ms}ms\""))).and(", or more");
            let finding = Finding::new(Code::Controller, watchdog.every_at, message);
            self.findings.push(finding.help(help));
        }
        let register = watchdog.register.as_ref()?;
        self.findings.extend(points::doubt_of_watchdog(register));
        let unit = watchdog.unit.unwrap_or(self.keys.unit);
        Some(Watchdog { unit, register: register.value, every_ms })
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
        if row.direction == RowDirection::In
            && unit == 0
            && self.keys.medium == Some(Medium::Serial)
        {
            let message = "unit 0 is all units of the line, and none of them answers".to_owned();
            let help = "read from a unit of its own, 1 to 247; only outputs may go to unit 0";
            let own_unit = pair("unit = 1").possible();
            self.findings.push(of_points(row, message).help(help).fix(own_unit));
            return None;
        }
        let number = self.number(&self.keys.rows[row.at], row, is_bits)?;
        let number_width = u32::from(number.kind.registers());
        if let Some(finding) = self.too_wide(row, number_width).filter(|_| !is_bits) {
            self.findings.push(finding);
            return None;
        }
        let parts = number.parts();
        // Of a number that is split, each word has its share of the registers.
        let width = if is_bits { 1 } else { number_width / parts.len() as u32 };
        let (wanted, count) = (row.addresses.len() as u32 * width, stretch.count);
        if wanted != count {
            self.findings.push(wrong_count(row, &stretch, width));
            return None;
        }
        if let Some(finding) = odd_words(row, parts.len()) {
            self.findings.push(finding);
            return None;
        }
        let point = |at: u32, part| {
            let (at, form) = match (is_bits, stretch.is_bits_of_registers) {
                (_, true) => (at / 16, PointForm::RegisterBit((at % 16) as u8)),
                (true, _) => (at, PointForm::Bit),
                (false, _) => (at, PointForm::Number(number.part(part))),
            };
            ModbusPoint { unit, table: stretch.table, at: at as u16, form }
        };
        let last = stretch.first + count;
        let places = (stretch.first..last).step_by(width as usize * parts.len());
        let is_output = row.direction == RowDirection::Out;
        self.findings.extend(points::doubt(row.points, &stretch, is_output));
        Some(places.flat_map(|at| parts.iter().map(move |part| point(at, *part))).collect())
    }

    /// The finding for a number that no request of this device can have.
    fn too_wide(&self, row: &ResolvedRow<'_>, width: u32) -> Option<Finding> {
        let most = self.keys.habits.registers_max;
        if width <= u32::from(most) {
            return None;
        }
        let message = format!("a number of {width} registers, and `max-registers` is {most}");
        let help = propose(pair(format!("max-registers = {width}")))
            .and(&format!(", or read {width} numbers of one register"));
        Some(of_points(row, message).help(help))
    }
}

/// A finding about the points of a row.
fn of_points(row: &ResolvedRow<'_>, message: String) -> Finding {
    Finding::new(Code::Controller, row.points.span, message)
}

fn mismatch(row: &ResolvedRow<'_>, stretch: &ElementStretch, is_bits: bool) -> Option<Finding> {
    let name = stretch.table.name();
    if row.direction == RowDirection::Out && !stretch.table.is_writable() {
        let message = format!("`{}` can only be read", row.points.text);
        let writable = if stretch.table.is_bits() { "coil" } else { "holding" };
        let right = possible(row.points.text.replacen(name, writable, 1));
        return Some(of_points(row, message).help("outputs go to `coil` and `holding`").fix(right));
    }
    let memory = &row.text.text;
    match (is_bits, row.is_words()) {
        (true, true) => {
            let message = format!("`{}` names bits, and `{memory}` names words", row.points.text);
            let right = possible(row.points.text.replacen(name, "holding", 1));
            Some(of_points(row, message).help("words go with `holding` and `input`").fix(right))
        }
        (false, false) => {
            let message = format!("`{}` names words, and `{memory}` names bits", row.points.text);
            let bit = [proposed(format!("{name} {}.0", stretch.first))];
            let help = advise("a register's lowest bit is written `{}`", bit);
            Some(of_points(row, message).help(help))
        }
        _ => None,
    }
}

fn wrong_count(row: &ResolvedRow<'_>, stretch: &ElementStretch, width: u32) -> Finding {
    let (count, addresses) = (stretch.count, row.addresses.len() as u32);
    let (memory, name) = (&row.text.text, stretch.table.name());
    let points = match (width, count) {
        (2.., 1) => "register",
        (2.., _) => "registers",
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
    of_points(row, message).propose(match last == first {
        true => format!("{name} {}", show(first)),
        false => format!("{name} {}..{}", show(first), show(last)),
    })
}

fn count_word(registers: u32) -> &'static str {
    if registers == 2 { "two" } else { "four" }
}

/// The finding for a number that is split, but has only one word in the row.
fn odd_words(row: &ResolvedRow<'_>, parts: usize) -> Option<Finding> {
    let words = row.addresses.len();
    if words.is_multiple_of(parts) {
        return None;
    }
    let message = format!("a number that is split has two words, and this row has {words}");
    let finding = of_points(row, message).help("give each number two words: `to = \"D0..D1\"`");
    let one = row.text.text.trim_start_matches(|c: char| c.is_ascii_alphabetic()).parse::<u32>();
    Some(match one {
        Ok(first) => {
            let block = row.text.text.trim_end_matches(|c: char| c.is_ascii_digit());
            let two = format!("{block}{first}..{block}{}", first.saturating_add(1));
            finding.fix(possible(two).at(row.text.span))
        }
        Err(_) => finding,
    })
}

/// The number of elements of a table.
const ELEMENTS: u32 = 65_536;

/// The help for points that do not fit between the first point and the end of the table: it names
/// the last stretch that fits. `end` is the number of elements in the table, or of bits for bits of
/// registers.
fn no_room(name: &str, width: u32, addresses: u32, end: u32) -> Help {
    let what = match (width, addresses) {
        (2.., 1) => format!("a number of this type takes {} registers", count_word(width)),
        (2.., _) => {
            format!("{addresses} numbers of this type take {} registers each", count_word(width))
        }
        _ => format!("{addresses} points take as many addresses"),
    };
    let wanted = addresses * width;
    if wanted > end {
        return format!("{what}, and a table has 65536").into();
    }
    let first = end - wanted;
    let (first, last) = match end > ELEMENTS {
        true => (format!("{}.{}", first / 16, first % 16), "65535.15".to_owned()),
        false => (first.to_string(), "65535".to_owned()),
    };
    let last = proposed(format!("{name} {first}..{last}"));
    advise(&format!("{what}: the last that fit are `{{}}`"), [last])
}
