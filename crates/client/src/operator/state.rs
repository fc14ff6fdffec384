//! The answer to `status`: the controller, its program, alarms, forces, statistics.
//!
//! Part of [`super::protocol`]. Names of times end in their unit.

use serde::{Deserialize, Serialize};

use super::alarm::AlarmStatus;
use super::value::ShownValue;
use rungd_runtime::events::Level;

/// The state of the controller.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct ControllerStatus {
    pub protocol: u32,
    /// rungd's own version.
    pub version: String,
    pub pid: u32,
    pub uptime_ms: u64,
    /// The controller file.
    pub controller: String,
    pub ladder: LadderStatus,
    /// `RUN`, `STOP` or `FAULT`.
    pub mode: String,
    /// The reason for the mode; `None` in RUN.
    pub reason: Option<String>,
    /// The time in this mode.
    pub mode_ms: u64,
    /// Complete scans since the process started.
    pub scans: u64,
    pub period_us: u64,
    pub watchdog_us: u64,
    /// The real-time settings that were requested from the system, and whether each was granted.
    pub posture: Vec<PostureStatus>,
    pub scan: ScanStatus,
    pub blocks: Vec<BlockStatus>,
    /// The alarms that are ON.
    #[serde(default)]
    pub alarms: Vec<AlarmStatus>,
    /// The forced operands.
    pub forces: Vec<ShownValue>,
    /// Outside RUN: the outputs whose state differs from memory.
    #[serde(default)]
    pub outputs: Vec<ShownValue>,
    pub devices: DevicesStatus,
    /// Retentive memory, if the controller file has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub retain: Option<RetainStatus>,
    /// The scan log.
    #[serde(default)]
    pub record: RecordStatus,
    pub log: LogStatus,
}

/// A field device.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct FieldDevice {
    pub name: String,
    pub driver: String,
    pub peer: String,
    /// `.Ok` and `.Stale` as seen by the ladder.
    pub ok: bool,
    pub stale: bool,
    /// The exchanges since the start, and those that failed.
    pub exchanges: u64,
    pub failures: u64,
    /// The durations of the last good exchange and of the slowest one.
    pub took_us: u64,
    pub took_max_us: u64,
    /// The reason why the last exchange failed, if none has succeeded since.
    pub trouble: Option<String>,
}

/// Retentive memory.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct RetainStatus {
    pub file: String,
    pub interval_ms: u64,
    /// A sentence about what the start restored.
    pub restored: String,
    /// The last durable image that this process wrote, if any: its number, its scan, its age.
    pub image: Option<u64>,
    pub scan: Option<u64>,
    pub age_ms: Option<u64>,
    /// The time from the start of a write until the image was durable: of the last write, and the
    /// longest.
    pub flush_us: u64,
    pub flush_max_us: u64,
    pub writes: u64,
    pub bytes: u64,
    /// The bytes per day at the rate so far; `None` in the first minute.
    pub bytes_per_day: Option<u64>,
    pub budget_per_day: u64,
    /// The reason why the file cannot be written now.
    pub failing: Option<String>,
}

/// The scan log.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct RecordStatus {
    /// The time that the recording in memory covers.
    pub memory_ms: u64,
    /// The most bytes that the recording in memory may take.
    pub memory_bytes: u64,
    /// The number of scans since the process started that the scan log lacks.
    pub lost: u64,
    /// The folder on disk, if there is one.
    pub disk: Option<RecordDir>,
}

/// The folder of the scan log.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct RecordDir {
    pub dir: String,
    pub bytes: u64,
    /// The most bytes that the folder may take.
    pub size: u64,
    /// The reason why the folder cannot be written now.
    pub failing: Option<String>,
    /// How far the copy on disk is behind: the age of the oldest section that is not durable.
    #[serde(default)]
    pub behind_ms: u64,
}

/// The ladder.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct LadderStatus {
    pub name: String,
    pub files: String,
    /// SHA-256 of the concatenated bytes of the files.
    pub sha256: String,
    pub blocks: usize,
    pub rungs: usize,
}

/// One request to the machine.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PostureStatus {
    /// The request.
    pub asked: String,
    /// Whether it was granted.
    pub granted: bool,
    /// The reason why not.
    pub why: Option<String>,
}

/// Statistics since the start of RUN.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct ScanStatus {
    /// The time that the statistics cover.
    pub over_ms: u64,
    pub scans: u64,
    /// Scans that ended after the next grid point.
    pub overruns: u64,
    /// Grid points that passed without a scan because of overruns.
    pub skipped: u64,
    /// From a scan's timestamp to its end.
    pub execution: SpreadStatus,
    /// The time from a scan's grid point until the scan thread was awake.
    pub lateness: SpreadStatus,
}

/// One measured quantity.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct SpreadStatus {
    pub last_us: f64,
    pub min_us: f64,
    /// The sum over all scans.
    #[serde(default)]
    pub sum_us: f64,
    pub mean_us: f64,
    pub p50_us: f64,
    pub p99_us: f64,
    pub p999_us: f64,
    pub max_us: f64,
    /// One bar per doubling, from the first with a count to the last.
    pub histogram: Vec<HistogramBar>,
}

/// A bar of a histogram.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct HistogramBar {
    /// The greatest value that this bar counts.
    pub up_to_us: f64,
    /// The number of scans.
    pub count: u64,
}

/// A Program or Task.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BlockStatus {
    /// Its name.
    pub name: String,
    /// `program` or `task`.
    pub kind: String,
    /// `.Running`.
    pub running: bool,
    /// `.Done`, for Tasks only.
    pub done: Option<bool>,
    /// Its Stages that are ON.
    pub stages: Vec<String>,
}

/// The servers and devices that move inputs and take outputs.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct DevicesStatus {
    /// The Modbus server, if there is one.
    pub modbus: Option<ModbusStatus>,
    /// The simulated device's rules, if there is one.
    pub simulated_rules: Option<usize>,
    /// The field devices, in file order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub field: Vec<FieldDevice>,
}

/// The Modbus server.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct ModbusStatus {
    pub address: String,
    pub clients: usize,
    pub connections_max: u32,
}

/// The log.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LogStatus {
    /// The least urgent level that is logged.
    pub level: Level,
    /// Lines that were dropped: read too slowly, or could not be written.
    pub lines_dropped: u64,
    /// Records of the scan thread that were lost.
    pub records_dropped: u64,
}
