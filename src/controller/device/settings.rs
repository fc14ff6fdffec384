//! Field devices as the daemon starts them: what each moves and takes, and its driver's settings.

use crate::io::gpio::settings::Gpio;
use crate::io::modbus_client::settings::Client;
use crate::io::plant::settings::Plant;
use crate::isa::{Address, DeviceId};
use crate::source::span::Span;

/// A field device.
#[derive(Clone, Debug)]
pub struct Device {
    /// Its number, which names its bits.
    pub id: DeviceId,
    /// Its name.
    pub name: String,
    /// The place of its name.
    pub span: Span,
    /// From exchange to exchange, ms; at least 1.
    pub poll_ms: u32,
    /// What becomes of its inputs when it is lost.
    pub on_loss: OnLoss,
    /// How old its last good exchange may become before it is lost, ms; at least 1.
    pub loss_after_ms: u32,
    /// What it moves, point by point.
    pub inputs: Vec<Input>,
    /// What it takes, point by point.
    pub outputs: Vec<Output>,
    /// Which driver, and its points in the same order.
    pub driver: DriverSettings,
}

/// What becomes of the inputs of a lost device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnLoss {
    /// They stay as they were read last.
    #[default]
    Hold,
    /// They are OFF and 0.
    Zero,
}

impl OnLoss {
    /// All by name.
    pub const NAMES: [(&'static str, OnLoss); 2] = [("hold", OnLoss::Hold), ("zero", OnLoss::Zero)];
}

/// A bit or word that a device moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// Which; X, C, MC, MI, V, D, MHR or MIR.
    pub address: Address,
    /// The place of its row.
    pub span: Span,
}

/// A bit or word that goes to a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Output {
    /// Which; never a structure.
    pub address: Address,
    /// What goes out instead, outside RUN.
    pub safe: SafeValue,
    /// The place of its row.
    pub span: Span,
}

/// What an output is outside RUN.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SafeValue {
    /// A Y: what `[outputs]` says of it.
    AsOutput,
    /// This.
    Value(i32),
    /// What it was last.
    Hold,
}

/// A driver's settings, with its points; no places, since these move with every edit of the file.
#[derive(Clone, Debug, PartialEq)]
pub enum DriverSettings {
    /// Remote I/O over Modbus, by TCP or a serial line.
    Modbus(Client),
    /// Local lines.
    Gpio(Gpio),
    /// A plant in software.
    Simulated(Plant),
}
