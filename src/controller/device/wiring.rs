//! Conflicts of wiring: every input has one mover, and every Y goes to one device.
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

use std::collections::HashMap;

use super::settings::{Device, DriverSettings};
use crate::controller::settings::Controller;
use crate::isa::{Address, Bit, BitSpace, Space};
use crate::resolve::program::Program;
use crate::resolve::range::Range;
use crate::source::finding::{Code, Finding};
use crate::source::span::Span;

/// A finding for every input that has a second mover besides a device, and for every Y that is in
/// two maps.
pub fn moved_twice(controller: &Controller) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut movers = FirstUses::default();
    for rule in &controller.rules {
        movers.first.insert(x(rule.input), (rule.span, "a simulated device moves it here".into()));
    }
    if let Some((_, image)) = controller.modbus.as_ref().and_then(|server| server.inputs) {
        for n in image.first..=image.last {
            let moved = (image.span, "Modbus clients move it here".into());
            movers.first.insert(x(n), moved);
        }
    }
    let mut takers = FirstUses::default();
    for device in &controller.devices {
        for input in &device.inputs {
            let (help, place) =
                ("an input has one mover: take one row out", (input.address, input.span));
            movers.enter(device, place, "is moved twice", help, &mut findings);
        }
        let outputs = device.outputs.iter().filter(|output| is_y(output.address));
        for output in outputs {
            let help = "a Y goes to one place; give a second contactor its own output";
            let place = (output.address, output.span);
            takers.enter(device, place, "goes out twice", help, &mut findings);
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
    if !outputs().any(|output| is_y(output.address)) {
        return Vec::new();
    }
    let image = controller.modbus.as_ref().and_then(|server| server.outputs);
    let shown = |address: Address| match (address, image) {
        (Address::Bit(Bit::Space(space, n)), Some((Range { space: of, first, last, .. }, _))) => {
            Space::Bit(space) == of && (first..=last).contains(&n)
        }
        _ => false,
    };
    let taken = |address| shown(address) || outputs().any(|output| output.address == address);
    let lost = program.operands.iter().filter(|operand| is_y(operand.address));
    let lost = lost.filter(|operand| !taken(operand.address));
    let place = controller.devices.first().map_or_else(Span::default, |device| device.span);
    let simulated = |device: &Device| matches!(device.driver, DriverSettings::Simulated(_));
    let is_all_simulated = controller.devices.iter().all(simulated);
    let finding = |name: &String| {
        let help = if is_all_simulated {
            format!(
                "add a row to the map: `{{ from = \"{name}\", to = \"lamp.in\" }}`; for a lamp or \
                 a horn, a part of kind `delay` takes it"
            )
        } else {
            format!("add a row to a map: `{{ from = \"{name}\", to = \"…\" }}`, or use a C bit")
        };
        let message = format!("`{name}` goes nowhere: no device takes it");
        Finding::new(Code::OutputUnmapped, place, message)
            .label("the devices begin here")
            .help(help)
    };
    lost.map(|operand| finding(&operand.name)).collect()
}

/// Addresses, each with the place of its first use.
#[derive(Default)]
struct FirstUses {
    first: HashMap<Address, (Span, String)>,
}

impl FirstUses {
    fn enter(
        &mut self,
        device: &Device,
        (address, span): (Address, Span),
        what: &str,
        help: &str,
        findings: &mut Vec<Finding>,
    ) {
        let here = (span, format!("`{}` has it here", device.name));
        let Some((first, label)) = self.first.get(&address) else {
            self.first.insert(address, here);
            return;
        };
        // Only one finding per place: a range may conflict in several of its elements.
        if findings.iter().any(|finding| finding.span == span) {
            return;
        }
        let finding = Finding::new(Code::Controller, span, format!("`{address}` {what}"));
        findings.push(finding.related(*first, label).help(help));
    }
}

fn x(n: u32) -> Address {
    Address::Bit(Bit::Space(BitSpace::X, n))
}

fn is_y(address: Address) -> bool {
    matches!(address, Address::Bit(Bit::Space(BitSpace::Y, _)))
}
