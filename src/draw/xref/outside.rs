//! What a controller file does with bits and words: devices, the Modbus server, simulated inputs,
//! safe values, retentive memory.

use super::answer::{FileLine, OutsideUse};
use crate::controller::Controller;
use crate::io::modbus::places::ModbusPlace;
use crate::isa::{Address, Bit, BitSpace, Space};
use crate::resolve::range::Range;
use crate::source::span::{SourceFile, Span};

/// The parts of a controller file that touch one of these addresses.
pub(super) fn of(
    controller: &Controller,
    addresses: &[Address],
    files: &[SourceFile],
) -> Vec<OutsideUse> {
    let mut list = OutsideList { files, all: Vec::new() };
    let wanted = |address: Address| addresses.contains(&address);
    for device in &controller.devices {
        let name = &device.name;
        for input in device.inputs.iter().filter(|input| wanted(input.address)) {
            list.add(true, format!("device {name} moves it"), Some(input.span));
        }
        for output in device.outputs.iter().filter(|output| wanted(output.address)) {
            let text = format!("device {name} takes it");
            list.add(false, text, Some(output.span));
        }
    }
    for rule in &controller.rules {
        if wanted(Address::Bit(Bit::Space(BitSpace::X, rule.input))) {
            list.add(true, "a simulated device moves it".to_owned(), None);
        }
        for (_, at) in rule.reads().filter(|(bit, _)| wanted(Address::Bit(*bit))) {
            list.add(false, format!("X{} is simulated by it", rule.input), Some(at));
        }
    }
    for address in addresses {
        for place in controller.modbus.iter().flat_map(|modbus| modbus.places(*address)) {
            list.add(place.is_writable, modbus_text(&place), place.span);
        }
    }
    for (ranges, value) in [(&controller.outputs_on, "ON"), (&controller.outputs_hold, "held")] {
        for range in ranges.iter().filter(|range| addresses.iter().any(|at| has(range, *at))) {
            list.add(false, format!("outside of RUN it is {value}"), Some(range.span));
        }
    }
    list.all
}

/// Whether retentive memory keeps one of them.
pub(super) fn is_retained(controller: &Controller, addresses: &[Address]) -> bool {
    controller.retain.iter().any(|range| addresses.iter().any(|at| has(range, *at)))
}

fn has(range: &Range, address: Address) -> bool {
    let is_in =
        |(space, n): (Space, u32)| space == range.space && n >= range.first && n <= range.last;
    Space::of(address).is_some_and(is_in)
}

fn modbus_text(place: &ModbusPlace) -> String {
    let last = place.first + place.count - 1;
    let numbers = match place.count {
        1 => place.first.to_string(),
        _ => format!("{}..{last}", place.first),
    };
    let unit = place.unit.map(|unit| format!(" of unit {unit}")).unwrap_or_default();
    let how = if place.is_writable { "read and write" } else { "read" };
    format!("Modbus clients {how} it: {} {numbers}{unit}", place.table.name())
}

struct OutsideList<'a> {
    files: &'a [SourceFile],
    all: Vec<OutsideUse>,
}

impl OutsideList<'_> {
    fn add(&mut self, writes: bool, text: String, span: Option<Span>) {
        let place = span.and_then(|span| {
            let file = self.files.get(span.file.0 as usize)?;
            Some(FileLine { file: file.name.clone(), line: file.line_column(span.start).0 })
        });
        let of = OutsideUse { text, writes, place };
        if !self.all.contains(&of) {
            self.all.push(of);
        }
    }
}
