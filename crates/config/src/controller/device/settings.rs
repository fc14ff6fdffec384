//! The settings of field devices, for the daemon: inputs, outputs, and the driver's settings.

use rungd_engine::isa::{Address, DeviceId};
use rungd_io::gpio::settings::GpioSettings;
use rungd_io::ladder::settings::LadderSettings;
use rungd_io::modbus_client::settings::ClientSettings;
use rungd_io::plant::settings::PlantSettings;
use rungd_language::source::span::Span;

/// A field device.
#[derive(Clone, Debug)]
pub struct Device {
    /// Its number, which identifies its bits `Ok` and `Stale`.
    pub id: DeviceId,
    /// Its name.
    pub name: String,
    /// The place of its name.
    pub span: Span,
    /// The time between exchanges, ms; at least 1.
    pub poll_ms: u32,
    /// The values of its inputs when it is lost.
    pub on_loss: OnLoss,
    /// The age of the last good exchange at which it is lost, ms; at least 1.
    pub loss_after_ms: u32,
    /// The bits and words that it moves, one per point.
    pub inputs: Vec<DeviceInput>,
    /// The bits and words that go out to it, one per point.
    pub outputs: Vec<DeviceOutput>,
    /// The driver's settings, with its points in the same order.
    pub driver: DriverSettings,
}

impl Device {
    /// Its name with each address of its map.
    pub fn wired(&self) -> impl Iterator<Item = (&str, Address)> {
        let inputs = self.inputs.iter().map(|input| input.address);
        let addresses = inputs.chain(self.outputs.iter().map(|output| output.address));
        addresses.map(|address| (self.name.as_str(), address))
    }
}

/// The values of a lost device's inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnLoss {
    /// Inputs keep the values that were read last.
    #[default]
    Hold,
    /// Inputs are OFF and 0.
    Zero,
}

impl OnLoss {
    /// All values with their names.
    pub const NAMES: [(&'static str, OnLoss); 2] = [("hold", OnLoss::Hold), ("zero", OnLoss::Zero)];
}

/// A bit or word that a device moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceInput {
    /// Its address; X, C, MC, MI, V, D, R, MHR or MIR.
    pub address: Address,
    /// The place of its row.
    pub span: Span,
    /// Whether a key of a plant's part names it, not a row of the map: the findings about inputs
    /// and outputs that are missing in the map do not count it.
    pub is_of_part: bool,
}

/// A bit or word that goes to a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceOutput {
    /// Its address; never a structure.
    pub address: Address,
    /// The value that goes to the device outside RUN.
    pub(crate) safe: SafeValue,
    /// The place of its row.
    pub span: Span,
    /// Whether a key of a plant's part names it, not a row of the map: the findings about inputs
    /// and outputs that are missing in the map do not count it.
    pub is_of_part: bool,
}

/// The value of an output outside RUN.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SafeValue {
    /// The value of a Y, which `[outputs]` sets.
    AsOutput,
    /// This value.
    Value(i32),
    /// Its last value.
    Hold,
}

/// A driver's settings, with its points. They contain no places in the file, because those change
/// with every edit, and a reload compares settings.
#[derive(Clone, Debug, PartialEq)]
pub enum DriverSettings {
    /// Remote I/O over Modbus, over TCP or a serial line.
    Modbus(ClientSettings),
    /// Local lines.
    Gpio(GpioSettings),
    /// A plant in software, of parts.
    Simulated(PlantSettings),
    /// A plant in software, as a ladder.
    Ladder(LadderSettings),
}
