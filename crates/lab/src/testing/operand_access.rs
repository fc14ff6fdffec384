//! Reads and writes the operands of tests: those of the controller, and those of the ladders of its
//! field devices.
//!
//! `player` and `random_world` begin tests and give values, `random_run` reads them.

use super::suite::TestOperand;
use crate::rig::{Rig, RigSetup};
use rungd_base::calendar::LocalTime;
use rungd_runtime::exchange::Ticket;

/// The setup of a test that begins: with what it sets before the first scan.
pub(super) fn start(set: &[(TestOperand, i32)], setup: RigSetup) -> RigSetup {
    let mut setup = RigSetup { clock_s: LocalTime::SIMULATED_S, ..setup };
    for (operand, value) in set {
        match (operand.device, operand.input) {
            (Some(device), _) => setup.devices.push((device, operand.cell, *value)),
            (None, Some(x)) => setup.inputs.push((x, *value != 0)),
            (None, None) => setup.set.push((operand.cell, *value)),
        }
    }
    setup
}

impl TestOperand {
    /// Sets the level of an X, writes memory of a device, or makes a queued write for any other
    /// operand. `ticket`: its origin in the tape.
    pub(super) fn give(&self, rig: &mut Rig, value: i32, ticket: Ticket) {
        match (self.device, self.input) {
            (Some(device), _) => rig.write_device(device, self.cell, value),
            (None, Some(x)) => rig.set_input(x, value != 0),
            (None, None) => rig.write(self.cell, value, ticket),
        }
    }

    /// Forces it.
    pub(super) fn force(&self, rig: &mut Rig, value: i32, ticket: Ticket) {
        match self.device {
            Some(device) => rig.force_device(device, self.cell, value),
            None => rig.force(self.cell, value, ticket),
        }
    }

    /// Ends a force; returns false if there is none.
    pub(super) fn release(&self, rig: &mut Rig, ticket: Ticket) -> bool {
        match self.device {
            Some(device) => rig.release_device(device, self.cell),
            None => rig.release(self.cell, ticket),
        }
    }

    /// Its value now.
    pub(super) fn value(&self, rig: &Rig) -> i32 {
        match self.device {
            Some(device) => rig.device_value(device, self.cell),
            None => rig.image().value(self.cell),
        }
    }

    /// Whether it needs a scan to be written: a queued write.
    pub(super) fn is_queued(&self) -> bool {
        self.device.is_none() && self.input.is_none()
    }
}
