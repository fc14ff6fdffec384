//! A program for the rig: lowered once, for any number of runs.

use std::fmt::{self, Write as _};
use std::hash::{DefaultHasher, Hasher};
use std::sync::Arc;

use super::device_ladder::{DeviceProgram, SimulatedDevice};
use rungd_config::controller::Controller;
use rungd_engine::isa::{Bit, DeviceBit, DeviceId};
use rungd_engine::{self as engine, BitCell, Layout};
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
    /// The devices whose own side is a ladder.
    pub(super) device_ladders: Vec<SimulatedDevice>,
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
            device_ladders: Vec::new(),
        }
    }

    /// The same program, with these devices' own sides.
    pub fn with_devices(self, devices: &[SimulatedDevice]) -> RigProgram {
        RigProgram { device_ladders: devices.to_vec(), ..self }
    }

    /// The own side of a device, if it is a ladder.
    pub(crate) fn device_ladder(&self, device: DeviceId) -> Option<&Arc<DeviceProgram>> {
        let found = self.device_ladders.iter().find(|known| known.id == device);
        found.map(|known| &known.program)
    }

    /// The cells of the controller, or of a device's ladder.
    pub(crate) fn layout_of(&self, device: Option<DeviceId>) -> &Layout {
        let ladder = device.and_then(|device| self.device_ladder(device));
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
        u64::from(self.controller.period_ms) * 1_000_000
    }
}

/// Hashes a text that is written in parts, without keeping it.
struct HashedText(DefaultHasher);

impl fmt::Write for HashedText {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}
