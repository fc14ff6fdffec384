//! The settings that the runtime needs: the wiring of each field device to memory, and the safe
//! values.
//!
//! Called by the daemon, and by the rig for tests in virtual time.

use std::collections::HashMap;

use super::device::{Device, DeviceInput, DeviceOutput, DriverSettings, OnLoss, SafeValue};
use super::settings::Controller;
use rungd_engine::isa::{Address, Bit, BitSpace, DeviceBit};
use rungd_io::plant::settings::InputRule;
use rungd_language::lower::Symbols;
use rungd_runtime::SafeState;
use rungd_runtime::wiring::{OutputSource, Wiring, WiringTarget};

const MS_NS: u64 = 1_000_000;
const US_NS: u64 = 1_000;

impl Controller {
    /// The wiring of each field device, in file order.
    pub fn wirings(&self, symbols: &Symbols) -> Vec<Wiring> {
        self.devices.iter().map(|device| wiring(device, symbols)).collect()
    }

    /// The addresses that simulated devices move at every scan, each with the words for its device.
    pub fn simulated(&self) -> HashMap<Address, String> {
        let is_simulated = |wired_device: &&Device| match wired_device.driver {
            DriverSettings::Simulated(_) | DriverSettings::Ladder(_) => true,
            DriverSettings::Modbus(_) | DriverSettings::Gpio(_) => false,
        };
        let devices = self.devices.iter().filter(is_simulated);
        let inputs = devices.flat_map(|device| {
            let mover = format!("device `{}`", device.name);
            device.inputs.iter().map(move |input| (input.address, mover.clone()))
        });
        let rule = |rule: &InputRule| {
            let input = Address::Bit(Bit::Space(BitSpace::X, rule.input));
            (input, "a `[[simulated-device]]` rule".to_owned())
        };
        inputs.chain(self.rules.iter().map(rule)).collect()
    }

    /// The value of each Y outside RUN.
    pub fn safe_values(&self, outputs: u32) -> Vec<SafeState> {
        let mut safe = vec![SafeState::Off; outputs as usize];
        let kinds = [(&self.outputs_on, SafeState::On), (&self.outputs_hold, SafeState::Hold)];
        for (ranges, kind) in kinds {
            for range in ranges {
                for output in range.first..=range.last {
                    safe[output as usize] = kind;
                }
            }
        }
        safe
    }
}

fn wiring(device: &Device, symbols: &Symbols) -> Wiring {
    let layout = &symbols.layout;
    let health = |health| layout.bit(Bit::Device(device.id, health));
    let target = |input: &DeviceInput| match input.address {
        Address::Bit(Bit::Space(BitSpace::X, n)) => WiringTarget::Input(n),
        Address::Bit(bit) => WiringTarget::Bit(layout.bit(bit)),
        Address::Word(word) => {
            let (min, max) = symbols.limits(word);
            WiringTarget::Word { cell: layout.word(word), min, max }
        }
        Address::Structure(_) => unreachable!("the resolver lets no structure through"),
    };
    let source = |output: &DeviceOutput| match (output.address, output.safe) {
        (Address::Bit(Bit::Space(BitSpace::Y, n)), _) => OutputSource::Output(n),
        (address, safe) => {
            let cell = layout.cell(address).expect("the resolver lets no structure through");
            let safe = if let SafeValue::Value(value) = safe { Some(value) } else { None };
            OutputSource::Cell(cell, safe)
        }
    };
    Wiring {
        inputs: device.inputs.iter().map(target).collect(),
        outputs: device.outputs.iter().map(source).collect(),
        ok: health(DeviceBit::Ok),
        stale: health(DeviceBit::Stale),
        loss_after_ns: u64::from(device.loss_after_ms) * MS_NS,
        zero_on_loss: device.on_loss == OnLoss::Zero,
        local_budget_ns: match &device.driver {
            DriverSettings::Gpio(gpio) => Some(u64::from(gpio.budget_us) * US_NS),
            DriverSettings::Modbus(_)
            | DriverSettings::Simulated(_)
            | DriverSettings::Ladder(_) => None,
        },
    }
}
