//! The settings of a controller file, for the daemon.

use super::alarms::AlarmSettings;
use super::device::settings::Device;
use super::log::LogSettings;
use super::operator::Operator;
use super::record::RecordSettings;
use super::retain::Retention;
use super::simulated_side::SimulatedSide;
use super::watch::WatchSettings;
use super::web::WebSettings;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::BlockId;
use rungd_io::modbus::settings::ModbusServerSettings;
use rungd_io::plant::settings::InputRule;
use rungd_language::resolve::range::Range;
use rungd_language::source::span::Located;
use rungd_runtime::Posture;

/// The settings of a controller file, without its ladders.
#[derive(Clone, Debug)]
pub struct Controller {
    /// Scan period.
    pub period: ScanPeriod,
    /// A scan longer than this is a fault, ms; at least 1.
    pub watchdog_ms: u32,
    /// The requests to the operating system.
    pub realtime: Posture,
    /// Outputs that are ON in the safe state: ranges of Y.
    pub outputs_on: Vec<Range>,
    /// Outputs that keep their state: ranges of Y.
    pub outputs_hold: Vec<Range>,
    /// The ranges that survive a restart.
    pub retain: Vec<Range>,
    /// The Programs whose Stages survive a restart, each once, with its place in the list.
    pub retained_stages: Vec<Located<BlockId>>,
    /// The settings of the file that keeps both.
    pub retention: Retention,
    /// The Modbus server, if there is one.
    pub modbus: Option<ModbusServerSettings>,
    /// Rules of simulated inputs; at most one per input.
    pub rules: Vec<InputRule>,
    /// Field devices.
    pub devices: Vec<Device>,
    /// The own sides of Modbus devices, for tests and simulations.
    pub sides: Vec<SimulatedSide>,
    /// The operator's socket.
    pub operator: Operator,
    /// The scan log.
    pub record: RecordSettings,
    /// The operands that `rungd web` may write, and its panels.
    pub web: WebSettings,
    /// The lines that must hold at the end of every scan.
    pub watches: WatchSettings,
    /// The settings of alarms.
    pub alarms: AlarmSettings,
    /// The log.
    pub log: LogSettings,
    /// The time for which a reloaded program is on trial, ms; 0: no trial.
    pub probation_ms: u32,
}
