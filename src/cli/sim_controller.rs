//! `rungd sim CONTROLLER.toml`: a controller with its simulated devices, in virtual time.
//!
//! Called by `sim`. Field devices that are not simulated are silent: their `.Ok` is OFF, until a
//! stimulus turns it ON.

use std::collections::HashMap;
use std::sync::Arc;

use anyhow::Result;

use crate::engine::Cell;
use crate::isa::{Address, Bit, DeviceId, Health};
use crate::lower::Symbols;
use crate::resolve::program::Program;
use crate::resolve::scope::Scope;
use crate::rig::{Rig, RigProgram, RigSetup};
use crate::runtime::exchange::Ticket;
use crate::sim::stimulus::{Change, Stimulus, StimulusTarget};
use crate::sim::trace::{RowName, Trace};

/// A simulation, with all that the command line says of it.
pub(super) struct Simulation {
    /// The time between two scans, ms.
    pub period_ms: u32,
    /// The number of scans.
    pub scans: u64,
    /// Whether it ends with an orderly stop.
    pub stop: bool,
    /// The local time of the first scan.
    pub clock_s: i64,
}

/// What a stimulus may change in a controller.
pub(super) struct ControllerTargets<'a> {
    scope: Scope,
    symbols: &'a Symbols,
    /// What moves an address at every scan.
    moved: HashMap<Address, String>,
}

impl<'a> ControllerTargets<'a> {
    /// Of a controller and its program.
    pub fn of(program: &Program, lowered: &'a RigProgram) -> ControllerTargets<'a> {
        ControllerTargets {
            scope: Scope::of(program),
            symbols: &lowered.symbols,
            moved: lowered.controller.simulated(),
        }
    }

    /// The target of an operand, or the reason why it cannot be written.
    pub fn target(&self, operand: &str) -> Result<StimulusTarget, String> {
        let address = self.scope.address(operand)?;
        if let Some(mover) = self.moved.get(&address) {
            return Err(format!("`{operand}` is moved by {mover} at every scan"));
        }
        if let Address::Bit(Bit::Device(_, Health::Stale)) = address {
            return Err(format!(
                "`{operand}` follows from the time without an exchange: set the device\'s `.Ok`"
            ));
        }
        StimulusTarget::at(address, operand, self.symbols)
    }
}

/// Runs a simulation on the rig and traces it. An orderly stop adds the row `stop`.
///
/// # Errors
/// The trace cannot be written.
pub(super) fn run(
    program: &Arc<RigProgram>,
    (simulation, stimulus): (&Simulation, &Stimulus),
    trace: &mut dyn Trace,
) -> Result<()> {
    let clock_s = simulation.clock_s;
    let mut rig = Rig::new(program, &RigSetup { clock_s, ..RigSetup::default() });
    let ids = (0..program.controller.devices.len() as u32).map(DeviceId);
    let layout = &program.symbols.layout;
    let devices: HashMap<Cell, DeviceId> =
        ids.map(|id| (Cell::Bit(layout.bit(Bit::Device(id, Health::Ok))), id)).collect();
    let mut next_change = 0;
    for scan in 0..simulation.scans {
        if simulation.stop && scan + 1 == simulation.scans {
            rig.request_stop();
        }
        for change in stimulus.of_scan(scan, &mut next_change) {
            apply(&mut rig, change, &devices);
        }
        let time_us = rig.next_ns() / 1000;
        let is_last = rig.scan();
        trace.row(RowName::Scan(scan), time_us, rig.image())?;
        rig.end_scan(is_last);
        if is_last {
            return Ok(trace.row(RowName::Stop, time_us, rig.image())?);
        }
    }
    Ok(())
}

fn apply(rig: &mut Rig, change: Change, devices: &HashMap<Cell, DeviceId>) {
    let (cell, value) = match change {
        Change::Input(x, on) => return rig.set_input(x, on),
        Change::Bit(cell, on) => (Cell::Bit(cell), i32::from(on)),
        Change::Word(cell, value) => (Cell::Word(cell), value),
    };
    match devices.get(&cell) {
        Some(device) if value != 0 => rig.restore_device(*device),
        Some(device) => rig.lose_device(*device),
        None => rig.write(cell, value, Ticket(0)),
    }
}
