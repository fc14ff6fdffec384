//! The answer to `status`: the controller, its program, what is wrong, what is forced, figures.
//!
//! Part of [`super::protocol`], which says the rest. Times end in their unit.

use serde::{Deserialize, Serialize};

use super::value::Value;
use crate::events::Level;

/// How the controller is.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Status {
    pub protocol: u32,
    /// rungd's own version.
    pub version: String,
    pub pid: u32,
    pub uptime_ms: u64,
    /// The controller file.
    pub controller: String,
    pub ladder: Ladder,
    /// `RUN`, `STOP` or `FAULT`.
    pub mode: String,
    /// Why, outside RUN.
    pub reason: Option<String>,
    /// For how long it has been so.
    pub mode_ms: u64,
    /// Complete scans since the process started.
    pub scans: u64,
    pub period_us: u64,
    pub watchdog_us: u64,
    /// What was asked of the machine, and what it granted.
    pub posture: Vec<Posture>,
    pub scan: Scan,
    pub blocks: Vec<Block>,
    /// Alarms that stand.
    #[serde(default)]
    pub alarms: Vec<Alarm>,
    /// What is forced.
    pub forces: Vec<Value>,
    pub devices: Devices,
    /// Retentive memory, where the controller file asks for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub retain: Option<Retain>,
    pub log: Log,
}

/// An alarm that stands: the bit of a tag with an `alarm` is ON.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Alarm {
    pub tag: String,
    pub text: String,
}

/// A field device.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct FieldDevice {
    pub name: String,
    pub driver: String,
    pub peer: String,
    /// `.Ok` and `.Stale` as the ladder sees them.
    pub ok: bool,
    pub stale: bool,
    /// Since the start.
    pub exchanges: u64,
    pub failures: u64,
    /// How long the last good exchange took, and the slowest one.
    pub took_us: u64,
    pub took_max_us: u64,
    /// Why the last one failed, if none has succeeded since.
    pub trouble: Option<String>,
}

/// Retentive memory.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Retain {
    pub file: String,
    pub interval_ms: u64,
    /// What the start restored, in words.
    pub restored: String,
    /// The last image that is durable, if this process wrote one: its number, its scan, its age.
    pub image: Option<u64>,
    pub scan: Option<u64>,
    pub age_ms: Option<u64>,
    /// From the beginning of a write until it was durable: the last one, the longest one.
    pub flush_us: u64,
    pub flush_max_us: u64,
    pub writes: u64,
    pub bytes: u64,
    /// As it went so far; none where that is less than a minute.
    pub bytes_per_day: Option<u64>,
    pub budget_per_day: u64,
    /// Why it cannot be written at present.
    pub failing: Option<String>,
}

/// The ladder.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Ladder {
    pub name: String,
    pub files: String,
    /// Of the files' bytes one behind the other.
    pub sha256: String,
    pub blocks: usize,
    pub rungs: usize,
}

/// One thing that was asked of the machine.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Posture {
    /// What.
    pub asked: String,
    /// Whether it was granted.
    pub granted: bool,
    /// Why not.
    pub why: Option<String>,
}

/// Statistics since the start of RUN.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Scan {
    /// Over how long.
    pub over_ms: u64,
    pub scans: u64,
    /// Scans that ended after the next grid point.
    pub overruns: u64,
    /// Grid points that passed without a scan because of them.
    pub skipped: u64,
    /// From a scan's timestamp to its end.
    pub execution: Spread,
    /// How long after its grid point the scan thread was awake.
    pub lateness: Spread,
}

/// One measured quantity.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Spread {
    pub last_us: f64,
    pub min_us: f64,
    pub mean_us: f64,
    pub p50_us: f64,
    pub p99_us: f64,
    pub p999_us: f64,
    pub max_us: f64,
    /// A bar a doubling, from the first that counted any to the last.
    pub histogram: Vec<Bar>,
}

/// So many scans.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Bar {
    /// The greatest value that counts here.
    pub up_to_us: f64,
    /// How many.
    pub count: u64,
}

/// A Program or Task.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Block {
    /// Its name.
    pub name: String,
    /// `program` or `task`.
    pub kind: String,
    /// `.Running`.
    pub running: bool,
    /// `.Done`; of Tasks alone.
    pub done: Option<bool>,
    /// Its Stages that are ON.
    pub stages: Vec<String>,
}

/// What moves inputs and takes outputs.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Devices {
    /// The Modbus server, if there is one.
    pub modbus: Option<Modbus>,
    /// The simulated device's rules, if there is one.
    pub simulated_rules: Option<usize>,
    /// The field devices, in file order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub field: Vec<FieldDevice>,
}

/// The Modbus server.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Modbus {
    pub address: String,
    pub clients: usize,
    pub connections_max: u32,
}

/// The log.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Log {
    /// From which level on.
    pub level: Level,
    /// Lines that were dropped: read too slowly, or could not be written.
    pub lines_dropped: u64,
    /// Records that the scan thread could not tell.
    pub records_dropped: u64,
}
