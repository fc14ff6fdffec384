//! The protocol: a JSON object a line, each way. A line asks, a line answers, in order.
//!
//! `{"do":"read","operands":["jam"]}` is answered by `{"ok":{…}}` or by
//! `{"error":{"kind":"…","message":"…"}}`. The shapes are those of `docs/operator.md`. Times end in
//! their units. Later versions may add fields to answers; a client passes over what it does not
//! know.

use serde::{Deserialize, Serialize};

use crate::events::Level;

/// The version of this protocol, as [`Status`] tells it.
pub const PROTOCOL: u32 = 1;

/// The longest line that a client may send, with its end.
pub const REQUEST_BYTES_MAX: usize = 32 * 1024;

/// The most operands that one request may read.
pub const OPERANDS_MAX: usize = 256;

/// What a client asks for. (The braces without fields have serde refuse a key too many there too.)
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Request {
    /// How the controller is: [`Status`].
    Status {},
    /// What operands hold: [`Values`].
    Read {
        /// Tags, addresses, members; a structure stands for all its members.
        operands: Vec<String>,
    },
    /// Writes one bit or word, in RUN: [`Change`].
    Write {
        /// Tag, address or member.
        operand: String,
        /// What.
        value: Given,
    },
    /// Forces one bit or word, in any mode: [`Change`].
    Force {
        /// Tag, address or member.
        operand: String,
        /// To what.
        value: Given,
    },
    /// Ends a force: [`Change`].
    Unforce {
        /// Tag, address or member.
        operand: String,
    },
    /// Ends all forces: [`Values`] of what was forced, as they are now.
    UnforceAll {},
    /// Runs or stops: [`ModeChange`].
    Mode {
        /// The mode.
        to: ModeWanted,
        /// Of a stop: answer before the last image of retentive memory is durable.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        no_wait: bool,
    },
    /// Reads the files anew and goes on with what they say: [`Reloaded`].
    Reload {
        /// Only says what it would do.
        #[serde(default)]
        dry_run: bool,
    },
    /// Goes back to the program before the last reload: [`Reloaded`].
    Rollback {},
    /// What is logged: [`LevelChange`].
    LogLevel {
        /// From which level on.
        level: Level,
    },
    /// Has retentive memory kept now; answered once it is durable: [`Saved`].
    RetainSave {},
    /// Tags and addresses that begin so, for completion: [`Names`].
    Names {
        /// The beginning.
        prefix: String,
    },
}

/// A value as a client gives it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a value is true or false, a whole number, or a string")]
pub enum Given {
    /// `true`, `false`.
    Bit(bool),
    /// A number.
    Number(i64),
    /// As people write it: `ON`, `12`, `0x1F`, `1m30s`.
    Text(String),
}

/// A mode to go to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum ModeWanted {
    Run,
    Stop,
}

/// The answer to a request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Reply<T> {
    /// It is done.
    Ok(T),
    /// It is not.
    Error(Refusal),
}

/// Why a request is not done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    /// For programs.
    pub kind: RefusalKind,
    /// For people.
    pub message: String,
}

/// The kinds of refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RefusalKind {
    /// The line is no request.
    BadRequest,
    /// An operand names nothing, or not what is needed here.
    BadOperand,
    /// A value that the operand does not take.
    BadValue,
    /// Whoever asks may not change things.
    NotPermitted,
    /// Not as the controller is now: its mode, a limit.
    Refused,
    /// The files are wrong, and the running program goes on untouched.
    BadFiles,
    /// The controller did not answer in time; it may yet be done.
    NoAnswer,
}

/// What one operand holds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Value {
    /// As it was asked for; of a structure that was asked for, with the member.
    pub operand: String,
    /// Its tag, if it has one; of a member, with it: `parts.Acc`.
    pub tag: Option<String>,
    /// Its address: `CT0.Acc`; of Stages and blocks, their name: `Drain.Open`.
    pub address: String,
    /// What it holds.
    pub value: Held,
    /// Whether it is forced.
    pub forced: bool,
}

/// A bit or a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
#[allow(missing_docs)]
pub enum Held {
    Bit(bool),
    Word(i32),
}

/// The answer to a read: all of one complete scan.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Values {
    /// `RUN`, `STOP` or `FAULT`.
    pub mode: String,
    /// Complete scans since the process started; all values are of the last one.
    pub scans: u64,
    /// In the order asked for.
    pub values: Vec<Value>,
}

/// The answer to a write, force or unforce.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Change {
    /// The value before.
    pub before: Held,
    /// Whether it was forced before.
    pub was_forced: bool,
    /// How it is now: after a write, behind the scan that saw it.
    pub now: Value,
    /// What is to be borne in mind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// The answer to a mode command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModeChange {
    /// `RUN`, `STOP` or `FAULT`.
    pub before: String,
    /// Where it is now.
    pub after: String,
    /// Why, outside RUN.
    pub reason: Option<String>,
    /// Of a stop, with retentive memory: its last image, which is durable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept: Option<Saved>,
    /// Of a stop: why that is not durable, and what to do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_kept: Option<String>,
}

/// The answer to a reload or rollback.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reloaded {
    /// Whether it was only said.
    pub dry_run: bool,
    /// Whether the files are those that run already: nothing changed.
    #[serde(default)]
    pub same: bool,
    /// The difference report: a line a difference.
    pub report: Vec<String>,
    /// What of the controller file waits for a restart.
    pub restart: Vec<String>,
    /// The ladder.
    pub ladder: String,
    /// SHA-256 of its files' bytes one behind the other.
    pub sha256: String,
    /// How long the swap took; nothing where none was.
    pub swap_us: Option<f64>,
    /// The mode behind it: a reload and a rollback by hand do not change it.
    #[serde(default)]
    pub mode: String,
}

/// The answer to a log level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LevelChange {
    /// The level before.
    pub before: Level,
    /// The level now.
    pub after: Level,
}

/// The answer to a wish to have retentive memory kept.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Saved {
    /// The file.
    pub file: String,
    /// The image's number in it.
    pub image: u64,
    /// Of which scan it is, or an earlier one of which the same is retained.
    pub scan: u64,
    /// How long it took until it was durable; 0: it was already.
    pub flush_us: u64,
}

/// The answer to a question for names.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Names {
    /// In order; not all of them where there are very many.
    pub names: Vec<Name>,
}

/// A name for completion.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Name {
    /// It.
    pub name: String,
    /// What it is, in a few words.
    pub about: String,
}

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
    /// What is forced.
    pub forces: Vec<Value>,
    pub devices: Devices,
    /// Retentive memory, where the controller file asks for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub retain: Option<Retain>,
    pub log: Log,
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

impl Refusal {
    /// A refusal.
    pub fn new(kind: RefusalKind, message: impl Into<String>) -> Refusal {
        Refusal { kind, message: message.into() }
    }
}

impl Request {
    /// Whether it changes anything.
    pub fn changes(&self) -> bool {
        let dry = matches!(self, Request::Reload { dry_run: true });
        let reads =
            matches!(self, Request::Status {} | Request::Read { .. } | Request::Names { .. });
        !reads && !dry
    }
}

impl std::fmt::Display for Held {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Held::Bit(true) => f.write_str("ON"),
            Held::Bit(false) => f.write_str("OFF"),
            Held::Word(value) => write!(f, "{value}"),
        }
    }
}

impl std::fmt::Display for Value {
    /// `parts.Acc (CT0.Acc)`, or the address alone.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.tag {
            Some(tag) => write!(f, "{tag} ({})", self.address),
            None => f.write_str(&self.address),
        }
    }
}
