//! A program for the rig: lowered once, for any number of runs.

use std::fmt::{self, Write as _};
use std::hash::{DefaultHasher, Hasher};
use std::sync::Arc;

use super::device_ladder::{DeviceProgram, SimulatedDevice};
use rungd_config::controller::Controller;
use rungd_config::controller::device::{Device, DriverSettings};
use rungd_engine::isa::{Bit, DeviceBit, DeviceId};
use rungd_engine::{self as engine, BitCell, Layout};
use rungd_io::ladder::LadderProgram;
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;
use rungd_runtime::SafeState;
use rungd_runtime::wiring::Wiring;
use rungd_state::retain::RetainPlan;

/// A program with its settings, ready to run.
#[derive(Debug)]
pub struct RigProgram {
    pub(super) code: engine::EngineProgram,
    /// Its names and cells.
    pub symbols: Arc<Symbols>,
    /// The settings.
    pub controller: Arc<Controller>,
    pub(super) wirings: Vec<Wiring>,
    pub(super) safe: Vec<SafeState>,
    pub(super) plan: RetainPlan,
    /// The bits of devices that the ladder names without a controller file.
    pub(super) unwired: Vec<UnwiredBits>,
    /// The Modbus devices whose own side is a ladder.
    device_ladders: Vec<SimulatedDevice>,
    /// The devices that are a ladder.
    plants: Vec<(DeviceId, Arc<LadderProgram>)>,
}

/// The bits of a device that has no settings.
#[derive(Clone, Copy, Debug)]
pub(super) struct UnwiredBits {
    pub ok: BitCell,
    pub stale: BitCell,
}

impl RigProgram {
    /// Lowers a program that has no errors.
    pub fn new(program: &Program, controller: &Arc<Controller>) -> RigProgram {
        let (code, symbols) = lower(program);
        let count = match controller.devices.is_empty() {
            true => program.devices.len() as u32,
            false => 0,
        };
        let bit = |id, health| symbols.layout.bit(Bit::Device(DeviceId(id), health));
        let unwired =
            |id| UnwiredBits { ok: bit(id, DeviceBit::Ok), stale: bit(id, DeviceBit::Stale) };
        RigProgram {
            unwired: (0..count).map(unwired).collect(),
            wirings: controller.wirings(&symbols),
            safe: controller.safe_values(program.sizes.y),
            plan: RetainPlan::new(&controller.retain, program, &symbols),
            controller: Arc::clone(controller),
            symbols: Arc::new(symbols),
            code,
            device_ladders: controller.sides.iter().map(SimulatedDevice::of).collect(),
            plants: controller.devices.iter().filter_map(plant).collect(),
        }
    }

    /// The same program, with these devices' own sides in place of those of the controller file.
    pub fn with_devices(mut self, devices: &[SimulatedDevice]) -> RigProgram {
        self.device_ladders.retain(|known| devices.iter().all(|device| device.id != known.id));
        self.device_ladders.extend_from_slice(devices);
        self
    }

    /// The own side of a Modbus device, if it is a ladder.
    pub(super) fn device_ladder(&self, device: DeviceId) -> Option<&Arc<DeviceProgram>> {
        let found = self.device_ladders.iter().find(|known| known.id == device);
        found.map(|known| &known.program)
    }

    /// The ladder of a device that is one.
    pub(super) fn plant(&self, device: DeviceId) -> Option<&Arc<LadderProgram>> {
        let found = self.plants.iter().find(|(known, _)| *known == device);
        found.map(|(_, program)| program)
    }

    /// The cells of the controller, or of a device's ladder.
    pub(crate) fn layout_of(&self, device: Option<DeviceId>) -> &Layout {
        let side = |device| self.device_ladder(device).map(|side| &side.ladder);
        let ladder = device.and_then(|device| side(device).or_else(|| self.plant(device)));
        ladder.map_or(&self.symbols.layout, |ladder| &ladder.symbols.layout)
    }

    /// A hash of what it executes and retains: programs with the same one do the same with the
    /// same settings.
    pub(crate) fn fingerprint(&self) -> u64 {
        let mut hashed = HashedText(DefaultHasher::new());
        let kept = self.plan.ranges();
        // Writing to a hasher does not fail.
        let _ = write!(hashed, "{:?} {kept} {}", self.code, self.plan.elements());
        hashed.0.finish()
    }

    /// The wirings of the field devices.
    pub(crate) fn wirings(&self) -> &[Wiring] {
        &self.wirings
    }

    /// The scan period, ns.
    pub fn period_ns(&self) -> u64 {
        self.controller.period.ns()
    }
}

/// The ladder of a device that is one, lowered.
fn plant(device: &Device) -> Option<(DeviceId, Arc<LadderProgram>)> {
    let DriverSettings::Ladder(plant) = &device.driver else { return None };
    Some((device.id, plant.lowered()))
}

/// Hashes a text that is written in parts, without keeping it.
struct HashedText(DefaultHasher);

impl fmt::Write for HashedText {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}
