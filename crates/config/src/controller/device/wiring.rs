//! Wiring of the devices: every input has one mover, every Y is in one row of one map; and a
//! warning for a Y in none.
//!
//! Two movers of the same input would overwrite each other's value without any sign of it. A Y in
//! two maps would switch two contactors, although the ladder means one. The rules apply to the
//! whole controller file: devices, simulated inputs, the Modbus server's image.
//!
//! ```toml
//! # passes: each of X0 and Y0 stands in one map
//! [[device]]
//! name = "line1"
//! driver = "gpio"
//! chip = "/dev/gpiochip0"
//! map = [{ from = "line 17", to = "X0" }, { from = "Y0", to = "line 27" }]
//! # fails with a second device that has { from = "line 3", to = "X0" }
//! ```

use std::collections::{HashMap, HashSet};

use super::settings::{Device, DeviceOutput, DriverSettings};
use crate::controller::settings::Controller;
use rungd_engine::isa::{Address, Bit, BitSpace, Space};
use rungd_language::resolve::program::Program;
use rungd_language::resolve::range::Range;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::FixEdit;
use rungd_language::source::span::Span;

/// A finding for every input that has a second mover besides a device, and for every Y that is in
/// two maps.
pub fn moved_twice(controller: &Controller) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut movers = FirstUses::default();
    for rule in &controller.rules {
        movers.first.insert(x(rule.input), (rule.span, FirstUse::Rule));
    }
    if let Some((_, image)) = controller.modbus.as_ref().and_then(|server| server.inputs) {
        for n in image.first..=image.last {
            movers.first.insert(x(n), (image.span, FirstUse::Clients));
        }
    }
    let mut takers = FirstUses::default();
    for device in &controller.devices {
        for input in &device.inputs {
            let used = DeviceUse { device, address: input.address, span: input.span };
            movers.enter(used, TWO_MOVERS, &mut findings);
        }
        for output in device.outputs.iter().filter(is_row_of_y) {
            let used = DeviceUse { device, address: output.address, span: output.span };
            takers.enter(used, TWO_TAKERS, &mut findings);
        }
    }
    findings
}

/// A warning for every Y that the ladder names but no device receives, if any device receives a Y.
pub(in crate::controller) fn unmapped_outputs(
    controller: &Controller,
    program: &Program,
) -> Vec<Finding> {
    let outputs = || controller.devices.iter().flat_map(|device| &device.outputs);
    if !outputs().any(|output| is_row_of_y(&output)) {
        return Vec::new();
    }
    let image = controller.modbus.as_ref().and_then(|server| server.outputs);
    let shown = |address: Address| match (address, image) {
        (Address::Bit(Bit::Space(space, n)), Some((Range { space: of, first, last, .. }, _))) => {
            Space::Bit(space) == of && (first..=last).contains(&n)
        }
        _ => false,
    };
    let received: HashSet<Address> = outputs().map(|output| output.address).collect();
    let taken = |address| shown(address) || received.contains(&address);
    let lost = program.operands.iter().filter(|operand| is_y(operand.address));
    let lost = lost.filter(|operand| !taken(operand.address));
    let place = controller.devices.first().map_or_else(Span::default, |device| device.span);
    let simulated = |device: &Device| matches!(device.driver, DriverSettings::Simulated(_));
    let is_all_simulated = controller.devices.iter().all(simulated);
    let finding = |name: &str| {
        let row = format!("{{ from = \"{name}\", to = \"lamp.in\" }}");
        let help = if is_all_simulated {
            format!(
                "add a row to the map: `{row}`; for a lamp or a horn, a part of kind `delay` \
                 receives it"
            )
        } else {
            format!("add a row to a map: `{{ from = \"{name}\", to = \"…\" }}`, or use a C bit")
        };
        let message = format!("`{name}` goes nowhere: no device receives it");
        Finding::new(Code::OutputUnmapped, place, message)
            .label("the devices begin here")
            .help(help)
            .fix(FixEdit::Row(row))
    };
    lost.map(|operand| finding(&operand.name())).collect()
}

/// The words about a second use of an address.
#[derive(Clone, Copy)]
struct SecondUse {
    what: &'static str,
    help: &'static str,
}

const TWO_MOVERS: SecondUse =
    SecondUse { what: "is moved twice", help: "an input has one mover: take one row out" };
const TWO_TAKERS: SecondUse = SecondUse {
    what: "goes out twice",
    help: "a Y goes to one place; give a second contactor its own output",
};

/// The first use of an address.
#[derive(Clone, Copy)]
enum FirstUse<'c> {
    Rule,
    Clients,
    Device(&'c Device),
}

impl FirstUse<'_> {
    /// The words at its place.
    fn label(self) -> String {
        match self {
            FirstUse::Rule => "a simulated device moves it here".to_owned(),
            FirstUse::Clients => "Modbus clients move it here".to_owned(),
            FirstUse::Device(device) => format!("`{}` has it here", device.name),
        }
    }
}

/// The use of an address in the map of a device.
struct DeviceUse<'c> {
    device: &'c Device,
    address: Address,
    span: Span,
}

/// Addresses, each with the place of its first use.
#[derive(Default)]
struct FirstUses<'c> {
    first: HashMap<Address, (Span, FirstUse<'c>)>,
}

impl<'c> FirstUses<'c> {
    fn enter(
        &mut self,
        DeviceUse { device, address, span }: DeviceUse<'c>,
        SecondUse { what, help }: SecondUse,
        findings: &mut Vec<Finding>,
    ) {
        let Some((first, first_use)) = self.first.get(&address) else {
            self.first.insert(address, (span, FirstUse::Device(device)));
            return;
        };
        // Only one finding per place: a range may conflict in several of its elements, one after
        // the other.
        if findings.last().is_some_and(|finding| finding.span == span) {
            return;
        }
        let finding = Finding::new(Code::Controller, span, format!("`{address}` {what}"));
        findings.push(finding.related(*first, first_use.label()).help(help).or_delete_row());
    }
}

fn x(n: u32) -> Address {
    Address::Bit(Bit::Space(BitSpace::X, n))
}

/// Whether a row of a map sends a Y. A part of a plant that reads it is no second contactor.
fn is_row_of_y(output: &&DeviceOutput) -> bool {
    !output.is_of_part && is_y(output.address)
}

fn is_y(address: Address) -> bool {
    matches!(address, Address::Bit(Bit::Space(BitSpace::Y, _)))
}
