//! The uses of bits and words in a controller file: devices, the Modbus server, simulated inputs,
//! safe values, retentive memory.

use super::answer::{FileLine, OutsideUse};
use rungd_config::controller::Controller;
use rungd_engine::isa::{Address, Bit, BitSpace};
use rungd_history::observe::Subject;
use rungd_io::modbus::places::ModbusPlace;
use rungd_language::resolve::program::Program;
use rungd_language::source::span::Span;

/// The parts of a controller file that touch one of these addresses.
pub(super) fn of(
    controller: &Controller,
    addresses: &[Address],
    subject: &Subject,
) -> Vec<OutsideUse> {
    let mut list = OutsideList { subject, all: Vec::new() };
    let wanted = |address: Address| addresses.contains(&address);
    for device in &controller.devices {
        let name = &device.name;
        for input in device.inputs.iter().filter(|input| wanted(input.address)) {
            list.add(true, format!("device {name} moves it"), Some(input.span));
        }
        for output in device.outputs.iter().filter(|output| wanted(output.address)) {
            let text = format!("device {name} receives it");
            list.add(false, text, Some(output.span));
        }
    }
    for rule in &controller.rules {
        if wanted(Address::Bit(Bit::Space(BitSpace::X, rule.input))) {
            list.add(true, "a simulated device moves it".to_owned(), None);
        }
        for read in rule.reads().filter(|read| wanted(Address::Bit(read.bit))) {
            list.add(false, format!("X{} is simulated by it", rule.input), Some(read.span));
        }
    }
    for address in addresses {
        for place in controller.modbus.iter().flat_map(|modbus| modbus.places(*address)) {
            list.add(place.is_writable, modbus_text(&place), place.span);
        }
    }
    for (ranges, value) in [(&controller.outputs_on, "ON"), (&controller.outputs_hold, "held")] {
        for range in
            ranges.iter().filter(|range| addresses.iter().any(|at| range.holds_member(*at)))
        {
            list.add(false, format!("outside of RUN it is {value}"), Some(range.span));
        }
    }
    list.all
}

/// Whether retentive memory keeps one of the addresses.
pub(super) fn is_retained(
    controller: &Controller,
    addresses: &[Address],
    program: &Program,
) -> bool {
    let is_kept = |id| controller.retained_stages.iter().any(|kept| kept.value == id);
    let of_block = |at: &Address| match at {
        Address::Bit(Bit::Stage(stage)) => is_kept(program.stages[stage.0 as usize].0),
        Address::Bit(Bit::Running(block)) => is_kept(*block),
        Address::Bit(_) | Address::Word(_) | Address::Structure(_) => false,
    };
    controller.retain.iter().any(|range| addresses.iter().any(|at| range.holds_member(*at)))
        || addresses.iter().any(of_block)
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
    subject: &'a Subject,
    all: Vec<OutsideUse>,
}

impl OutsideList<'_> {
    fn add(&mut self, writes: bool, text: String, span: Option<Span>) {
        let place = span.map(|span| FileLine::of(&self.subject.place(span)));
        let outside_use = OutsideUse { text, writes, place };
        if !self.all.contains(&outside_use) {
            self.all.push(outside_use);
        }
    }
}
