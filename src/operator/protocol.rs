//! The protocol: each line is a JSON object. Each request line gets an answer line, in order.
//!
//! `{"do":"read","operands":["jam"]}` is answered by `{"ok":{…}}` or by
//! `{"error":{"kind":"…","message":"…"}}`. `docs/operator.md` describes the shapes. Names of times
//! end in their units. Later versions may add fields to answers; a client ignores unknown fields.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde::{Deserialize, Serialize};

pub(crate) use super::alarm::{
    AckList, AckedAlarm, Alarm, AlarmAck, AlarmList, AlarmState, AlarmTime,
};
pub(crate) use super::state::{
    Bar, BlockStatus, Devices, FieldDevice, Ladder, LogState, Modbus, Record, RecordDir, Retain,
    Scan, Spread,
};
pub use super::state::{Posture, Status};
pub use super::value::GivenValue;
pub(crate) use super::value::{Held, ShownValue};
use crate::events::Level;

/// The version of this protocol, as [`Status`] tells it.
pub(crate) const PROTOCOL: u32 = 1;

/// The longest line that a client may send, with its end.
pub(crate) const REQUEST_BYTES_MAX: usize = 32 * 1024;

/// The most operands that one request may read.
pub(crate) const OPERANDS_MAX: usize = 256;

/// A request. (The empty braces make serde refuse unknown keys in these requests too.)
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Request {
    /// The state of the controller: [`Status`].
    Status {},
    /// The values of operands: [`Values`].
    Read {
        /// Tags, addresses, members; a structure stands for all its members.
        operands: Vec<String>,
    },
    /// Writes one bit or word, in RUN: [`Change`].
    Write {
        /// Tag, address or member.
        operand: String,
        /// What.
        value: GivenValue,
        /// The person for whom a program writes, for the log: a user of `rungd web`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        for_user: Option<String>,
    },
    /// Forces one bit or word, in any mode: [`Change`].
    Force {
        /// Tag, address or member.
        operand: String,
        /// To what.
        value: GivenValue,
    },
    /// Ends a force: [`Change`].
    Unforce {
        /// Tag, address or member.
        operand: String,
    },
    /// Ends all forces: the present [`Values`] of the operands that were forced.
    UnforceAll {},
    /// The alarms that stand or wait for an acknowledgement: [`AlarmList`].
    Alarms {},
    /// Acknowledges alarms; all of them or none: [`AckList`].
    Ack {
        /// Tags with an `alarm`, or the addresses of their bits.
        alarms: Vec<String>,
        /// The person for whom a program acknowledges, for the log: a user of `rungd web`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        for_user: Option<String>,
    },
    /// Acknowledges all alarms: [`AckList`].
    AckAll {},
    /// Runs or stops: [`ModeChange`].
    Mode {
        /// The mode.
        to: ModeWanted,
        /// For a stop: answer before the last image of retentive memory is durable.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        no_wait: bool,
    },
    /// Reads the files again and goes on with the program in them: [`Reloaded`].
    Reload {
        /// Only report the changes, and do nothing.
        #[serde(default)]
        dry_run: bool,
    },
    /// Goes back to the last program before this one that passed its probation: [`Reloaded`].
    Rollback {},
    /// Sets the level of the log: [`LevelChange`].
    LogLevel {
        /// From which level on.
        level: Level,
    },
    /// Saves retentive memory now; answered once the image is durable: [`Saved`].
    RetainSave {},
    /// The last while of the scan log, with the program's files: [`RecordingBytes`].
    Recording {
        /// Only the sections from this number on, and the one under way.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        from_section: Option<u64>,
    },
    /// The operands of tags with `metric = true`: [`MetricList`].
    Metrics {},
    /// Tags and addresses with a prefix, for completion: [`NameList`].
    Names {
        /// The beginning.
        prefix: String,
    },
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
pub(crate) enum Reply<T> {
    /// It is done.
    Ok(T),
    /// It is not.
    Error(Refusal),
}

/// The reason why a request is not done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    /// For programs.
    pub(crate) kind: RefusalKind,
    /// For people.
    pub message: String,
}

/// What was asked for, or the reason why it is not done.
pub(crate) type Answered<T> = Result<T, Refusal>;

/// The kinds of refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum RefusalKind {
    /// The line is no request.
    BadRequest,
    /// An operand names nothing, or nothing that this request can use.
    BadOperand,
    /// A value that the operand does not take.
    BadValue,
    /// The user may not give commands.
    NotPermitted,
    /// The controller's present state does not allow it: its mode, a limit.
    Refused,
    /// The files are wrong, and the running program goes on untouched.
    BadFiles,
    /// The controller did not answer in time; it may yet be done.
    NoAnswer,
}

/// The answer to a read: all of one complete scan.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Values {
    /// `RUN`, `STOP` or `FAULT`.
    pub mode: String,
    /// Complete scans since the process started; all values are of the last one.
    pub scans: u64,
    /// In the order asked for.
    pub values: Vec<ShownValue>,
}

/// The answer to a write, force or unforce.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Change {
    /// The value before.
    pub(crate) before: Held,
    /// Whether it was forced before.
    pub(crate) was_forced: bool,
    /// The present value; after a write, the value after the scan that saw it.
    pub(crate) now: ShownValue,
    /// A note about the change: for example, that something else writes the operand too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) note: Option<String>,
}

/// The answer to a mode command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ModeChange {
    /// `RUN`, `STOP` or `FAULT`.
    pub before: String,
    /// Where it is now.
    pub after: String,
    /// Why, outside RUN.
    pub reason: Option<String>,
    /// After a stop, with retentive memory: its last image, which is durable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept: Option<Saved>,
    /// After a stop: why the last image is not durable, and the remedy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_kept: Option<String>,
}

/// The answer to a reload or rollback.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Reloaded {
    /// Whether it was a dry run.
    pub dry_run: bool,
    /// Whether the files are those that run already: nothing changed.
    #[serde(default)]
    pub same: bool,
    /// The difference report: one line per difference.
    pub report: Vec<String>,
    /// The changes of the controller file that need a restart.
    pub restart: Vec<String>,
    /// The ladder.
    pub ladder: String,
    /// SHA-256 of its files' bytes, concatenated.
    pub sha256: String,
    /// The duration of the swap; `None` if there was none.
    pub swap_us: Option<f64>,
    /// The mode after it: a reload and a rollback by hand do not change the mode.
    #[serde(default)]
    pub mode: String,
}

/// The answer to a log level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct LevelChange {
    /// The level before.
    pub before: Level,
    /// The level now.
    pub after: Level,
}

/// The answer to a request to save retentive memory.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Saved {
    /// The file.
    pub file: String,
    /// The image's number in it.
    pub image: u64,
    /// The scan of the image. A later scan with the same retentive values writes no new image.
    pub scan: u64,
    /// How long it took until it was durable; 0: it was durable already.
    pub flush_us: u64,
}

/// The last minute of the scan log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct RecordingBytes {
    /// The bytes of a recording (`docs/record-format.md`), in base64.
    pub base64: String,
}

impl RecordingBytes {
    /// The recording; `None`: the answer is not base64.
    pub fn bytes(&self) -> Option<Vec<u8>> {
        BASE64_STANDARD.decode(&self.base64).ok()
    }
}

/// The answer to a question for metrics.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct MetricList {
    /// In file order, each for a `read`; of a structure its members.
    pub operands: Vec<String>,
    /// How many more there are than an answer may have.
    pub left_out: usize,
}

/// The answer to a question for names.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct NameList {
    /// In order; not all of them where there are very many.
    pub names: Vec<Name>,
}

/// A name for completion.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Name {
    /// It.
    pub(crate) name: String,
    /// What it is, in a few words.
    pub(crate) about: String,
}

impl Refusal {
    /// A refusal.
    pub(crate) fn new(kind: RefusalKind, message: impl Into<String>) -> Refusal {
        Refusal { kind, message: message.into() }
    }
}

/// What the answer to a request waits for, in rungd.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Awaited {
    /// Nothing: it is made at once.
    Nothing,
    /// The scan thread.
    ScanThread,
    /// Files that are read and checked, and the scan thread.
    Files,
    /// A durable image of retentive memory.
    Image,
}

impl Request {
    /// What its answer waits for: a client that has waited for long tells it.
    pub(crate) fn awaits(&self) -> Awaited {
        match self {
            Request::Status {}
            | Request::Read { .. }
            | Request::Metrics {}
            | Request::Names { .. }
            | Request::Recording { .. }
            | Request::Alarms {}
            | Request::Ack { .. }
            | Request::AckAll {}
            | Request::LogLevel { .. } => Awaited::Nothing,
            Request::Mode { to: ModeWanted::Stop, no_wait: false } | Request::RetainSave {} => {
                Awaited::Image
            }
            Request::Write { .. }
            | Request::Force { .. }
            | Request::Unforce { .. }
            | Request::UnforceAll {}
            | Request::Mode { .. }
            | Request::Rollback {} => Awaited::ScanThread,
            Request::Reload { .. } => Awaited::Files,
        }
    }

    /// Whether every user that can open the socket may send it. A dry reload changes nothing, but
    /// is not among these requests: it reads files with rungd's rights, shows lines of them, and
    /// costs as much as a reload.
    pub(crate) fn only_looks(&self) -> bool {
        match self {
            Request::Status {}
            | Request::Read { .. }
            | Request::Recording { .. }
            | Request::Alarms {}
            | Request::Metrics {}
            | Request::Names { .. } => true,
            Request::Write { .. }
            | Request::Force { .. }
            | Request::Unforce { .. }
            | Request::UnforceAll {}
            | Request::Mode { .. }
            | Request::Reload { .. }
            | Request::Rollback {}
            | Request::Ack { .. }
            | Request::AckAll {}
            | Request::LogLevel { .. }
            | Request::RetainSave {} => false,
        }
    }
}
