//! The bits and words that a controller file lets devices and Modbus clients write, for the check.
//!
//! Called by `load` once the settings are resolved.

use super::device::Device;
use super::settings::Controller;
use crate::check::Outside;
use crate::isa::{Address, Bit, BitSpace};

impl Controller {
    /// What devices and Modbus clients write.
    pub(crate) fn outside(&self) -> Outside {
        let x = |n| Address::Bit(Bit::Space(BitSpace::X, n));
        let is_x = |address| matches!(address, Address::Bit(Bit::Space(BitSpace::X, _)));
        let of_devices = self.devices.iter().flat_map(|device| &device.inputs);
        let moved = of_devices.map(|input| input.address);
        let moved = moved.chain(self.rules.iter().map(|rule| x(rule.input)));
        let moves_x = |device: &&Device| device.inputs.iter().any(|input| is_x(input.address));
        let (mut listed, mut image) = (Vec::new(), Vec::new());
        if let Some(server) = &self.modbus {
            listed.extend(server.lists.iter().flat_map(|list| list.ranges.iter().cloned()));
            image.extend(server.inputs.iter().flat_map(|(coils, inputs)| [*coils, *inputs]));
        }
        Outside {
            moved: moved.collect(),
            listed,
            image,
            wired: self.devices.iter().find(moves_x).map(|device| device.span),
        }
    }
}
