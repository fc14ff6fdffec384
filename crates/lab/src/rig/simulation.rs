//! A simulation: a controller with its simulated devices, in virtual time. Ladders alone are a
//! controller without devices.
//!
//! Called by `rungd sim` and by the editor's simulation. All field devices are connected from the
//! first scan on: those that are not simulated deliver what a stimulus sets, and are lost while it
//! turns their `.Ok` OFF. The bits of devices that ladders alone name are a stimulus's. The caller
//! has read the stimulus, and passes the trace. Scan k has the timestamp k × period.

use std::collections::HashMap;
use std::io;
use std::sync::Arc;

use super::{Rig, RigProgram, RigSetup};
use crate::traces::stimulus::{Stimulus, StimulusChange, StimulusTarget};
use crate::traces::trace::{RowName, Trace, TracedOperand};
use rungd_base::scan_period::ScanPeriod;
use rungd_config::controller::Controller;
use rungd_engine::Cell;
use rungd_engine::isa::{Address, Bit, DeviceBit, DeviceId};
use rungd_language::lower::Symbols;
use rungd_language::resolve::program::Program;
use rungd_language::resolve::scope::Scope;
use rungd_runtime::exchange::Ticket;

/// The default number of scans.
pub const DEFAULT_SCANS: u64 = 100;

/// The maximum number of elements of an array in a trace of all operands.
pub const ELEMENTS_MAX: usize = 64;

/// The settings of a simulation.
pub struct Simulation {
    /// The number of scans.
    pub scans: u64,
    /// Whether it ends with an orderly stop.
    pub stop: bool,
    /// The local time of the first scan.
    pub clock_s: i64,
}

/// The operands that a stimulus may change.
pub struct StimulusTargets<'a> {
    scope: &'a Scope,
    symbols: &'a Symbols,
    /// The number of field devices with settings.
    devices: usize,
    /// The addresses that are written in every scan, each with its writer.
    moved: HashMap<Address, String>,
}

impl<'a> StimulusTargets<'a> {
    /// The targets in a program.
    pub fn of(program: &'a Program, lowered: &'a RigProgram) -> StimulusTargets<'a> {
        StimulusTargets {
            scope: program.scope(),
            symbols: &lowered.symbols,
            devices: lowered.controller.devices.len(),
            moved: lowered.controller.simulated(),
        }
    }

    /// The target of an operand, or the reason why it cannot be written.
    pub fn target(&self, operand: &str) -> Result<StimulusTarget, String> {
        let address = self.scope.address(operand)?;
        if let Some(mover) = self.moved.get(&address) {
            return Err(format!("`{operand}` is moved by {mover} at every scan"));
        }
        if let Address::Bit(Bit::Device(DeviceId(at), DeviceBit::Stale)) = address
            && (at as usize) < self.devices
        {
            return Err(format!(
                "`{operand}` is computed from the time since the last exchange: set the device's \
                 `.Ok` instead"
            ));
        }
        StimulusTarget::at(address, operand, self.symbols)
    }
}

/// Lowers a program, with the settings of its controller file or, without one, the usual ones.
pub fn lowered(
    program: &Program,
    controller: Option<Controller>,
    period: ScanPeriod,
) -> Arc<RigProgram> {
    let controller = controller.unwrap_or_else(|| Controller::usual(program));
    let controller = Controller { period, ..controller };
    Arc::new(RigProgram::new(program, &Arc::new(controller)))
}

/// Whether the timestamp of the last scan, in ns, fits into 64 bits.
pub fn fits(scans: u64, period: ScanPeriod) -> bool {
    scans.saturating_sub(1).checked_mul(period.ns()).is_some()
}

/// All operands that the ladder names; for arrays, the first [`ELEMENTS_MAX`] elements.
pub fn all_named(program: &Program, symbols: &Symbols) -> Vec<TracedOperand> {
    let watched = program.named(ELEMENTS_MAX).into_iter().filter_map(|operand| {
        let cell = symbols.layout.cell(operand.address)?;
        Some(TracedOperand::new(&operand.name(), cell, &symbols.layout))
    });
    watched.collect()
}

/// Runs a simulation, and passes the memory at the end of every scan to the trace. An orderly stop
/// adds the row `stop`.
///
/// # Errors
/// The error of writing the trace.
pub fn run(
    program: &Arc<RigProgram>,
    simulation: &Simulation,
    stimulus: &Stimulus,
    trace: &mut dyn Trace,
) -> io::Result<()> {
    let clock_s = simulation.clock_s;
    let mut rig = Rig::new(program, &RigSetup { clock_s, ..RigSetup::default() });
    let ids = (0..program.controller.devices.len() as u32).map(DeviceId);
    let layout = &program.symbols.layout;
    let devices: HashMap<Cell, DeviceId> =
        ids.map(|id| (Cell::Bit(layout.bit(Bit::Device(id, DeviceBit::Ok))), id)).collect();
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
            return trace.row(RowName::Stop, time_us, rig.image());
        }
    }
    Ok(())
}

fn apply(rig: &mut Rig, change: StimulusChange, devices: &HashMap<Cell, DeviceId>) {
    let (cell, value) = match change {
        StimulusChange::Input(x, on) => return rig.set_input(x, on),
        StimulusChange::Bit(cell, on) => (cell, i32::from(on)),
        StimulusChange::Word(cell, value) => (Cell::Word(cell), value),
    };
    match devices.get(&cell) {
        Some(device) if value != 0 => rig.restore_device(*device),
        Some(device) => rig.lose_device(*device),
        None => rig.write(cell, value, Ticket(0)),
    }
}
