//! Conflicts at a Modbus peer: two outputs (of one device or of two) write the same place, a
//! broadcast and a unit's output write the same element, two devices have different settings for
//! one serial line, or two devices use the same unit of a line.
//!
//! Two outputs in one place would overwrite each other's value at every write; a watchdog's
//! register is an output too. Bits of one register may be outputs side by side within one device:
//! they are written together. An answer on a serial line does not identify its request, so only
//! one device may use a unit.
//!
//! ```toml
//! # passes
//! map = [{ from = "Y0", to = "coil 0" }, { from = "Y1", to = "holding 5.0" }]
//! # fails: coil 1 twice
//! map = [{ from = "Y0..Y1", to = "coil 0..1" }, { from = "Y2", to = "coil 1" }]
//! ```

use std::collections::{BTreeSet, HashMap, HashSet};

use super::super::driver::WrittenDevice;
use super::super::settings::{Device, DriverSettings};
use rungd_base::progress::Progress;
use rungd_engine::isa::DeviceId;
use rungd_io::modbus_client::settings::{
    ClientSettings, LinkSettings, ModbusPoint, ModbusTable, PointForm, RtuLine, RtuPort,
};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::span::Span;

/// The number of the unit that is all units of a line.
const BROADCAST: u8 = 0;

/// A coil or register of a peer's unit.
#[derive(Clone, PartialEq, Eq, Hash)]
struct PeerElement {
    /// The number of the peer.
    peer: usize,
    unit: u8,
    table: ModbusTable,
    at: u16,
}

/// An output that is written to an element.
struct ElementWriter {
    device: DeviceId,
    /// The bits of the element that it writes.
    bits: u16,
    /// The place of its row.
    span: Span,
}

/// The outputs that are written to an element. There may be thousands; only those are kept with
/// which a further output is compared.
#[derive(Default)]
struct ElementWriters {
    /// Those of the first device, with different bits.
    of_first: Vec<ElementWriter>,
    /// The first of a different device.
    other: Option<ElementWriter>,
}

impl ElementWriters {
    /// The output with which a further one conflicts. Two devices cannot share the bits of a
    /// register: each would write the whole register.
    fn conflict(&self, with: &ElementWriter) -> Option<&ElementWriter> {
        let first = self.of_first.first()?;
        if first.device != with.device {
            return Some(first);
        }
        let mut own = self.of_first.iter();
        own.find(|own| own.bits & with.bits != 0).or(self.other.as_ref())
    }

    fn add(&mut self, writer: ElementWriter) {
        match self.of_first.first() {
            Some(first) if first.device != writer.device => {
                self.other.get_or_insert(writer);
            }
            Some(_) if self.of_first.iter().any(|own| own.bits & writer.bits != 0) => {}
            Some(_) | None => self.of_first.push(writer),
        }
    }
}

/// The outputs of the lines that have broadcasts. A broadcast writes the same element in all units,
/// so each of these elements is an output of a broadcast, or of units, not of both.
struct Broadcasts {
    /// The names of the ports with broadcasts.
    ports: HashSet<String>,
    /// The first output of each element, by port, and whether it is a broadcast's.
    first: HashMap<(usize, ModbusTable, u16), (Span, bool)>,
}

impl Broadcasts {
    fn of(devices: &[Device]) -> Broadcasts {
        let is_one = |client: &ClientSettings| {
            let watched = client.watchdog.map(|watchdog| watchdog.unit);
            let mut units = client.outputs.iter().map(|point| point.unit).chain(watched);
            units.any(|unit| unit == BROADCAST)
        };
        let with = lines(devices).into_iter().filter(|line| is_one(line.client));
        Broadcasts { ports: with.map(|line| line.port).collect(), first: HashMap::new() }
    }

    /// Enters an output; the finding if a broadcast and a unit's output meet.
    fn enter(
        &mut self,
        element: &PeerElement,
        client: &ClientSettings,
        writer: &ElementWriter,
        told: &mut HashSet<Span>,
    ) -> Option<Finding> {
        if self.ports.is_empty() || !self.ports.contains(&peer(client)) {
            return None;
        }
        let PeerElement { peer, unit, table, at } = *element;
        let is_broadcast = unit == BROADCAST;
        let first = self.first.entry((peer, table, at));
        let (span, other) = *first.or_insert((writer.span, is_broadcast));
        if other == is_broadcast || !told.insert(writer.span) {
            return None;
        }
        let message = format!("`{} {at}` is written by a broadcast and in a unit", table.name());
        let finding = Finding::new(Code::Controller, writer.span, message);
        let finding = finding.related(span, "the other one is here");
        let help = "unit 0 writes to all units of the line: take one of the two out";
        Some(finding.help(help).or_delete_row())
    }
}

/// A finding for every output whose place already has an output, for every serial line with
/// different settings, and for every unit of a serial line that two devices use.
pub(in crate::controller::device) fn at_odds(
    devices: &[Device],
    written: &[WrittenDevice],
    progress: &Progress,
) -> Vec<Finding> {
    let mut writers: HashMap<PeerElement, ElementWriters> = HashMap::new();
    let mut findings = two_ways(devices, progress);
    findings.extend(asked_twice(devices, progress));
    let mut told: HashSet<Span> = findings.iter().map(|finding| finding.span).collect();
    let names = written.iter().filter_map(|device| Some((device.name.as_ref()?.span, device)));
    let written: HashMap<Span, &WrittenDevice> = names.collect();
    let mut peers: HashMap<String, usize> = HashMap::new();
    let mut spread = Broadcasts::of(devices);
    for (device, client) in progress.during(clients(devices)) {
        let next = peers.len();
        let peer = *peers.entry(peer(client)).or_insert(next);
        let watchdog = written
            .get(&device.span)
            .and_then(|written_device| written_device.driver.as_ref()?.other_output());
        let outputs = outputs(device, client, peer, watchdog.unwrap_or(device.span));
        for (element, writer) in progress.during(outputs) {
            findings.extend(spread.enter(&element, client, &writer, &mut told));
            let PeerElement { unit, table, at, .. } = element;
            let taken = writers.entry(element).or_default();
            if let Some(first) = taken.conflict(&writer)
                && told.insert(writer.span)
            {
                let message = format!("`{} {at}` of unit {unit} is written twice", table.name());
                let finding = Finding::new(Code::Controller, writer.span, message);
                findings.push(finding.related(first.span, "it is written here").or_delete_row());
            }
            taken.add(writer);
        }
    }
    findings
}

/// The peer of a device, as a text.
fn peer(client: &ClientSettings) -> String {
    match &client.link {
        LinkSettings::Tcp(tcp) => tcp.peer.address.to_string(),
        LinkSettings::Rtu(line) => line.port.name(),
    }
}

fn clients(devices: &[Device]) -> impl Iterator<Item = (&Device, &ClientSettings)> {
    devices.iter().filter_map(|device| {
        let DriverSettings::Modbus(client) = &device.driver else { return None };
        Some((device, client))
    })
}

/// The outputs of a device. `peer`: the number of its peer; `watchdog_at`: the place of its
/// watchdog.
fn outputs(
    device: &Device,
    client: &ClientSettings,
    peer: usize,
    watchdog_at: Span,
) -> Vec<(PeerElement, ElementWriter)> {
    let mut outputs = Vec::new();
    for (point, output) in client.outputs.iter().zip(&device.outputs) {
        for at in point.written() {
            let (unit, table, at) = (point.unit, point.table, at as u16);
            let element = PeerElement { peer, unit, table, at };
            let writer = ElementWriter { device: device.id, bits: bits(point), span: output.span };
            outputs.push((element, writer));
        }
    }
    if let Some(watchdog) = client.watchdog {
        let (unit, at) = (watchdog.unit, watchdog.register);
        let element = PeerElement { peer, unit, table: ModbusTable::HoldingRegisters, at };
        let writer = ElementWriter { device: device.id, bits: u16::MAX, span: watchdog_at };
        outputs.push((element, writer));
    }
    outputs
}

fn bits(point: &ModbusPoint) -> u16 {
    match point.form {
        PointForm::RegisterBit(bit) => 1 << bit,
        PointForm::Bit | PointForm::Number(_) => u16::MAX,
    }
}

/// A device on a line with frames of Modbus RTU.
struct OnLine<'a> {
    device: &'a Device,
    client: &'a ClientSettings,
    line: &'a RtuLine,
    /// The name of the line's port.
    port: String,
}

fn lines(devices: &[Device]) -> Vec<OnLine<'_>> {
    let mut lines = Vec::new();
    for (device, client) in clients(devices) {
        if let LinkSettings::Rtu(line) = &client.link {
            lines.push(OnLine { device, client, line, port: line.port.name() });
        }
    }
    lines
}

fn asked_twice(devices: &[Device], progress: &Progress) -> Vec<Finding> {
    let mut first: HashMap<(String, u8), &Device> = HashMap::new();
    let mut findings = Vec::new();
    for OnLine { device, client, port, .. } in progress.during(lines(devices)) {
        let points = client.inputs.iter().chain(&client.outputs).map(|point| point.unit);
        let units: BTreeSet<u8> = points.chain(client.watchdog.map(|w| w.unit)).collect();
        // A broadcast has no answer that another device could take for its own.
        for unit in units.into_iter().filter(|unit| *unit != BROADCAST) {
            let by = first.entry((port.clone(), unit)).or_insert(device);
            if by.id != device.id {
                let message = format!("unit {unit} of `{port}` is asked by two devices");
                let finding = Finding::new(Code::Controller, device.span, message);
                let finding = finding.related(by.span, "this device asks it");
                findings.push(finding.help("put all of a unit's points into one map"));
            }
        }
    }
    findings
}

fn two_ways(devices: &[Device], progress: &Progress) -> Vec<Finding> {
    // For each port: the first device, and the first whose line differs from that one's.
    let mut firsts: HashMap<String, (&Device, &RtuLine, Option<&Device>)> = HashMap::new();
    let mut findings = Vec::new();
    for OnLine { device, line, port, .. } in progress.during(lines(devices)) {
        let (first, its_line, second) = firsts.entry(port.clone()).or_insert((device, line, None));
        let other = if *its_line == line { *second } else { Some(*first) };
        if *its_line != line {
            second.get_or_insert(device);
        }
        if let Some(other) = other {
            let message = format!("`{}` sets `{port}` differently", device.name);
            let finding = Finding::new(Code::Controller, device.span, message);
            let finding = finding.related(other.span, "this device has the line already");
            let help = match line.port {
                RtuPort::Serial(_) => {
                    "devices on one line have the same `baud`, `parity`, `stop-bits` and `echo`"
                }
                RtuPort::Tcp(_) => {
                    "devices behind one serial server have the same `connect-timeout`, \
                     `connection` and `echo`"
                }
            };
            findings.push(finding.help(help));
        }
    }
    findings
}
