//! The bits and words that devices, Modbus clients and users of `rungd web` may write or read,
//! according to a controller file. Used by the check.
//!
//! Called by `load` once the settings are resolved.

use super::device::{Device, DeviceInput, DeviceOutput, DriverSettings};
use super::settings::Controller;
use rungd_engine::isa::{Address, Bit, BitSpace, NumberRanges};
use rungd_io::plant::settings::RuleCommand;
use rungd_language::check::{OutsideOperands, OutsideRead};
use rungd_language::resolve::operands::numbers;

impl Controller {
    /// The bits and words that are written from outside, and the reads from outside.
    pub(crate) fn outside(&self) -> OutsideOperands {
        let x = |n| Address::Bit(Bit::Space(BitSpace::X, n));
        let is_x = |address| matches!(address, Address::Bit(Bit::Space(BitSpace::X, _)));
        let of_devices = self.devices.iter().flat_map(|device| &device.inputs);
        let moved = of_devices.map(|input| input.address);
        let moved = moved.chain(self.rules.iter().map(|rule| x(rule.input)));
        let moved = moved.chain(self.web.write.iter().map(|operand| operand.address));
        let acks = self.watches.all.iter().filter_map(|watch| watch.terms.ack.as_ref());
        let moved = moved.chain(acks.map(|ack| Address::Bit(ack.bit)));
        let is_row = |input: &DeviceInput| !input.is_of_part && is_x(input.address);
        let moves_x = |device: &&Device| device.inputs.iter().any(is_row);
        let (mut listed, mut image) = (NumberRanges::default(), Vec::new());
        if let Some(server) = &self.modbus {
            for operands in server.lists.iter().flat_map(|list| &list.ranges) {
                listed.add(numbers(operands.first, operands.count), 0);
            }
            image.extend(server.inputs.iter().flat_map(|(coils, inputs)| [*coils, *inputs]));
        }
        OutsideOperands {
            moved: moved.collect(),
            listed,
            image,
            wired: self.devices.iter().find(moves_x).map(|device| device.span),
            reads: self.reads(),
        }
    }

    /// The operands that rows of maps send, simulated inputs follow, or the Modbus server's map
    /// shows.
    fn reads(&self) -> Vec<OutsideRead> {
        let mut reads: Vec<OutsideRead> = Vec::new();
        for device in &self.devices {
            let first = reads.len();
            // Outputs to a simulated plant that are not a Y are its levers, which an operator moves
            // by hand.
            let is_simulated =
                matches!(device.driver, DriverSettings::Simulated(_) | DriverSettings::Ladder(_));
            let is_judged = |output: &&DeviceOutput| !is_simulated || is_y(output.address);
            for output in device.outputs.iter().filter(is_judged) {
                // All outputs of a row have the row's place, and consecutive addresses.
                match reads[first..].last_mut().filter(|read| read.span == output.span) {
                    Some(read) => read.count += 1,
                    None => {
                        let reader = format!("device `{}` receives it", device.name);
                        reads.push(OutsideRead::new(output.address, 1, output.span, reader));
                    }
                }
            }
        }
        for rule in &self.rules {
            let reader = format!("`X{}` depends on it", rule.input);
            let read = |command: RuleCommand| {
                OutsideRead::new(Address::Bit(command.bit), 1, command.span, reader.clone())
            };
            reads.extend(rule.reads().map(read));
        }
        for entry in self.modbus.iter().flat_map(|server| &server.entries) {
            let (operands, reader) = (&entry.operands, "Modbus clients read it".to_owned());
            reads.push(OutsideRead::new(operands.first, operands.count, entry.span, reader));
        }
        reads
    }
}

fn is_y(address: Address) -> bool {
    matches!(address, Address::Bit(Bit::Space(BitSpace::Y, _)))
}
