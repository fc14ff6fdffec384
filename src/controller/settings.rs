//! The settings that a controller file makes, for the daemon.

use super::device::settings::Device;
use super::operator::Operator;
use super::retain::Retention;
use crate::io::modbus::settings::Modbus;
use crate::io::plant::settings::Rule;
use crate::resolve::range::Range;
use crate::runtime::Posture;

/// What a controller file asks for, beside its ladders.
#[derive(Clone, Debug)]
pub struct Controller {
    /// Scan period, ms; at least 1.
    pub period_ms: u32,
    /// One scan longer than this is a fault, ms; at least 1.
    pub watchdog_ms: u32,
    /// What is asked of the operating system.
    pub realtime: Posture,
    /// Outputs that are ON in the safe state: ranges of Y.
    pub outputs_on: Vec<Range>,
    /// Outputs that keep their state: ranges of Y.
    pub outputs_hold: Vec<Range>,
    /// What survives a restart.
    pub retain: Vec<Range>,
    /// How it is kept.
    pub retention: Retention,
    /// The Modbus server, if there is one.
    pub modbus: Option<Modbus>,
    /// Rules by which inputs move; at most one an input.
    pub rules: Vec<Rule>,
    /// Field devices.
    pub devices: Vec<Device>,
    /// The operator's socket.
    pub operator: Operator,
    /// How often statistics are logged, ms; 0: never.
    pub statistics_ms: u32,
    /// How long a reloaded program is on trial, ms; 0: not at all.
    pub probation_ms: u32,
}
