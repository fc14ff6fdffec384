//! The protocol: each line is a JSON object. Each request line has one answer line, in order.
//!
//! `{"do":"read","operands":["jam"]}` is answered by `{"ok":{…}}` or by
//! `{"error":{"kind":"…","message":"…"}}`. `docs/operator.md` describes the fields. Names of times
//! end in their units. Later versions may add fields to answers; a client ignores unknown fields.

use serde::{Deserialize, Serialize};
use serde_json::Value;

pub use super::alarm::{
    AckList, AckedAlarm, AlarmAck, AlarmList, AlarmState, AlarmStatus, AlarmTime, LISTED_STATES,
    alarm_count,
};
pub use super::answers::{LevelChange, MemorySave};
use super::deadline::Deadline;
pub use super::deploy::{Deploy, DeployList};
pub use super::hold::{HOLD_MAX, HOLD_PERIOD_MAX, HeldOperand, HoldState};
pub use super::metric::MetricList;
pub use super::offer::{NameList, OfferedName};
pub use super::present::PresentOutputs;
pub use super::recording::{RECORDING_BYTES_MAX, RecordingBytes};
pub use super::shelf::{
    AlarmShelf, OUT_OF_SERVICE, REASON_CHARS_MAX, SHELF_MS_MAX, SHELVED, ShelfList, ShelvedAlarm,
    is_reason,
};
pub use super::state::{
    BlockStatus, DevicesStatus, FieldDevice, HistogramBar, LadderStatus, LogStatus, ModbusStatus,
    RecordDir, RecordStatus, RetainStatus, ScanStatus, SpreadStatus,
};
pub use super::state::{ControllerStatus, PostureStatus};
pub use super::value::UnknownOutput;
pub use super::value::{BitOrNumber, ShownValue, WritableValues};
pub use super::value::{ChangedOperand, ChangedOperands};
pub use super::value::{GivenValue, GivenWrite};
use rungd_runtime::events::Level;
use rungd_runtime::exchange::{BATCH_WRITES_MAX, Mode};

/// The version of this protocol, as sent in [`ControllerStatus`].
pub const PROTOCOL: u32 = 1;

/// The longest line that a client may send, with its end.
pub const REQUEST_BYTES_MAX: usize = 32 * 1024;

/// The longest line of a client that may make changes, with its end: it has room for
/// [`WRITES_MAX`] writes.
pub const CHANGE_BYTES_MAX: usize = 512 * 1024;

/// The most bits and words that one change may write: as many as one batch may have.
pub const WRITES_MAX: usize = BATCH_WRITES_MAX;

/// The most operands that one request may read.
pub const OPERANDS_MAX: usize = 256;

/// A request. (The empty braces make serde refuse unknown keys in these requests too.)
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Request {
    /// The state of the controller: [`ControllerStatus`].
    Status {},
    /// The values of operands: [`OperandValues`].
    Read {
        /// Tags, addresses, members; a structure stands for all its members.
        operands: Vec<String>,
        /// Whether each operand is answered by itself, with its value or its refusal. If not, one
        /// refused operand refuses the whole request.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        each: bool,
    },
    /// Writes one bit or word, in RUN: [`ChangedOperand`].
    Write {
        /// Tag, address or member.
        operand: String,
        /// The value to write.
        value: GivenValue,
        /// The person for whom a program writes: the log shows this user of `rungd web`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        for_user: Option<String>,
        /// The write comes from a page: it is refused unless `[web] write` of the running
        /// controller file lists the operand for the role of the person.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        from_page: bool,
        /// Why: a line of at most [`REASON_CHARS_MAX`] characters, for the log.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        reason: Option<String>,
    },
    /// Writes bits and words before one scan, in RUN, all of them or none: [`ChangedOperands`].
    WriteSet {
        /// At most [`WRITES_MAX`] writes, to different places.
        writes: Vec<GivenWrite>,
        /// The person for whom a program writes: the log shows this user of `rungd web`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        for_user: Option<String>,
        /// The writes come from a page, as that of a `write`.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        from_page: bool,
        /// Why, as that of a `write`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        reason: Option<String>,
    },
    /// The values that a `write-set` can write back: [`WritableValues`].
    ReadSet {
        /// Operands as those of a `read`; without operands, all tags.
        #[serde(default)]
        operands: Vec<String>,
    },
    /// Turns one bit ON, in RUN, for [`HOLD_MAX`] at most: [`HeldOperand`].
    Hold {
        /// A bit that a panel of the running controller file holds.
        operand: String,
        /// The person for whom a program writes: the log shows this user of `rungd web`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        for_user: Option<String>,
        /// The hold comes from a page.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        from_page: bool,
        /// Why, as that of a `write`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        reason: Option<String>,
    },
    /// Puts off the end of a hold, to [`HOLD_MAX`] from now at most: [`HoldState`].
    KeepHold {
        /// The number of the hold.
        hold: u64,
        /// The person who began it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        for_user: Option<String>,
    },
    /// Ends a hold: [`HoldState`].
    EndHold {
        /// The number of the hold.
        hold: u64,
        /// The person who began it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        for_user: Option<String>,
    },
    /// Forces one bit or word, in any mode: [`ChangedOperand`].
    Force {
        /// Tag, address or member.
        operand: String,
        /// The value to force.
        value: GivenValue,
    },
    /// Ends a force: [`ChangedOperand`].
    Unforce {
        /// Tag, address or member.
        operand: String,
    },
    /// Ends all forces: the current [`OperandValues`] of the operands that were forced.
    UnforceAll {},
    /// The alarms that stand or wait for an acknowledgement: [`AlarmList`].
    Alarms {},
    /// Acknowledges all of these alarms or none: [`AckList`].
    Ack {
        /// Tags with an `alarm`, or the addresses of their bits.
        alarms: Vec<String>,
        /// The person for whom a program acknowledges: the log shows this user of `rungd web`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        for_user: Option<String>,
    },
    /// Acknowledges all unacknowledged alarms: [`AckList`].
    AckAll {},
    /// Shelves all of these alarms or none: [`ShelfList`].
    Shelve {
        /// Tags with an `alarm`, or the addresses of their bits.
        alarms: Vec<String>,
        /// The time until they come back, ms, at most [`SHELF_MS_MAX`]; `None`: out of service.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        for_ms: Option<u64>,
        /// The reason: a line of at most [`REASON_CHARS_MAX`] characters.
        why: String,
        /// The person for whom a program shelves: the log shows this user of `rungd web`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        for_user: Option<String>,
    },
    /// Brings all of these alarms back or none: [`ShelfList`].
    Unshelve {
        /// Tags with an `alarm`, or the addresses of their bits.
        alarms: Vec<String>,
        /// The person for whom a program brings them back.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        for_user: Option<String>,
    },
    /// Changes the mode to RUN or STOP: [`ModeChange`].
    Mode {
        /// The mode.
        to: WantedMode,
        /// For a stop: answer before the last image of retentive memory is durable.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        no_wait: bool,
    },
    /// Reads the files again and continues with the program in them: [`ReloadResult`].
    Reload {
        /// Only report the differences, and change nothing.
        #[serde(default)]
        dry_run: bool,
    },
    /// Returns to a previous program, the last one that passed its probation: [`ReloadResult`].
    Rollback {},
    /// Sets the level of the log: [`LevelChange`].
    LogLevel {
        /// The least urgent level that is logged.
        level: Level,
    },
    /// Saves retentive memory now; answered once the image is durable: [`MemorySave`].
    RetainSave {},
    /// The most recent part of the scan log, with the program's files: [`RecordingBytes`].
    Recording {
        /// Only the sections from this number on, and the current section.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        from_section: Option<u64>,
    },
    /// The last changes of the program, each with its differences: [`DeployList`].
    Deploys {},
    /// The operands of tags with `metric = true`: [`MetricList`].
    Metrics {},
    /// Tags and addresses with a prefix, for completion: [`NameList`].
    Names {
        /// The beginning.
        prefix: String,
    },
}

/// A request as it is sent.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct SentRequest<'a> {
    /// The request.
    #[serde(flatten)]
    pub request: &'a Request,
    /// The moment at which the client stops waiting.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deadline: Option<Deadline>,
}

/// The key of a deadline in a request.
pub const DEADLINE: &str = "deadline";

/// A request as it is received: with the deadline, if its client has named one.
///
/// # Errors
/// The line is not a request, or exceeds a limit of a request, or names a wrong user.
pub fn received(line: &[u8]) -> serde_json::Result<(Request, Option<Deadline>)> {
    let refused = match serde_json::from_slice(line) {
        Ok(request) => return Ok((request, None)),
        Err(error) => error,
    };
    // The requests refuse unknown keys, so the deadline is taken out before them.
    let Ok(Value::Object(mut keys)) = serde_json::from_slice(line) else { return Err(refused) };
    let Some(deadline) = keys.remove(DEADLINE) else { return Err(refused) };
    let deadline = serde_json::from_value(deadline)?;
    Ok((serde_json::from_value(Value::Object(keys))?, Some(deadline)))
}

/// The mode that a request sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum WantedMode {
    Run,
    Stop,
}

impl WantedMode {
    /// The mode's name in answers.
    pub fn name(self) -> &'static str {
        match self {
            WantedMode::Run => Mode::RUN,
            WantedMode::Stop => Mode::STOP,
        }
    }
}

/// Whether the mode of this name is RUN.
pub fn is_run(mode: &str) -> bool {
    mode == Mode::RUN
}

/// The answer to a request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Reply<T> {
    /// The request is done.
    Ok(T),
    /// The request is not done.
    Error(RequestRefusal),
}

impl<T: Serialize> Reply<T> {
    /// The reply as a line.
    pub fn line(&self) -> Vec<u8> {
        let mut line = serde_json::to_vec(self).unwrap_or_default();
        line.push(b'\n');
        line
    }
}

/// The reason why a request is not done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RequestRefusal {
    /// The kind, for programs.
    pub kind: RefusalKind,
    /// The message, for people.
    pub message: String,
    /// Of a change with several writes: each write that is refused.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mistakes: Vec<RefusedOperand>,
}

/// The result of a request, or the reason why it is not done.
pub type RequestResult<T> = Result<T, RequestRefusal>;

/// The kinds of refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RefusalKind {
    /// The line is not a request.
    BadRequest,
    /// An operand names nothing, or nothing that this request can use.
    BadOperand,
    /// The operand does not accept the value.
    BadValue,
    /// The user has no permission for commands.
    NotPermitted,
    /// The current state of the controller does not permit the request: its mode, a limit.
    Refused,
    /// The files have errors, and the running program continues unchanged.
    BadFiles,
    /// The controller did not answer in time; the request may still be done.
    NoAnswer,
    /// The deadline of the request was over before the controller began it: nothing is done.
    TooLate,
}

/// The answer to a read: all values are from one complete scan.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OperandValues {
    /// `RUN`, `STOP` or `FAULT`.
    pub mode: String,
    /// Complete scans since the process started; all values are from the last one.
    pub scans: u64,
    /// In the order of the request.
    pub values: Vec<ShownValue>,
    /// To a request for `each` operand: those that are refused, in the order of the request.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub refused: Vec<RefusedOperand>,
}

/// An operand without a value.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RefusedOperand {
    /// The text of the request.
    pub operand: String,
    /// The reason.
    #[serde(flatten)]
    pub refusal: RequestRefusal,
}

/// The answer to a mode command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModeChange {
    /// `RUN`, `STOP` or `FAULT`.
    pub before: String,
    /// The mode now.
    pub after: String,
    /// The reason for the mode; `None` in RUN.
    pub reason: Option<String>,
    /// After a stop, with retentive memory: the last image, which is durable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept: Option<MemorySave>,
    /// After a stop: why the last image is not durable, and the remedy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_kept: Option<String>,
}

/// The answer to a reload or rollback.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReloadResult {
    /// Whether it was a dry run.
    pub dry_run: bool,
    /// Whether the files equal those of the running program: then nothing changed.
    #[serde(default)]
    pub same: bool,
    /// The difference report: one line per difference.
    pub report: Vec<String>,
    /// The changed settings of the controller file that need a restart.
    pub restart: Vec<String>,
    /// The ladder's name.
    pub ladder: String,
    /// SHA-256 of the concatenated bytes of the ladder's files.
    pub sha256: String,
    /// The duration of the swap; `None` if there was none.
    pub swap_us: Option<f64>,
    /// The mode after the swap: a reload and a rollback by hand do not change the mode.
    #[serde(default)]
    pub mode: String,
}

impl RequestRefusal {
    /// Whether the operands of the request are the reason: the program does not have one of them,
    /// or they are too many.
    pub fn is_of_operands(&self) -> bool {
        matches!(self.kind, RefusalKind::BadOperand | RefusalKind::BadRequest)
    }

    /// A refusal.
    pub fn new(kind: RefusalKind, message: impl Into<String>) -> RequestRefusal {
        RequestRefusal { kind, message: message.into(), mistakes: Vec::new() }
    }
}

/// The part of rungd for which the answer to a request waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AwaitedPart {
    /// Nothing: the answer is made at once.
    Nothing,
    /// The scan thread.
    ScanThread,
    /// Files that are read and checked, and the scan thread.
    Files,
    /// A durable image of retentive memory.
    Image,
}

impl Request {
    /// The part for which the answer waits. A client that has waited for long shows it.
    pub(crate) fn awaits(&self) -> AwaitedPart {
        match self {
            Request::Status {}
            | Request::Read { .. }
            | Request::ReadSet { .. }
            | Request::Metrics {}
            | Request::Deploys {}
            | Request::Names { .. }
            | Request::Recording { .. }
            | Request::Alarms {}
            | Request::Shelve { .. }
            | Request::Unshelve { .. }
            | Request::LogLevel { .. } => AwaitedPart::Nothing,
            Request::Mode { to: WantedMode::Stop, no_wait: false } | Request::RetainSave {} => {
                AwaitedPart::Image
            }
            Request::Write { .. }
            | Request::WriteSet { .. }
            | Request::Ack { .. }
            | Request::AckAll {}
            | Request::Hold { .. }
            | Request::KeepHold { .. }
            | Request::EndHold { .. }
            | Request::Force { .. }
            | Request::Unforce { .. }
            | Request::UnforceAll {}
            | Request::Mode { .. }
            | Request::Rollback {} => AwaitedPart::ScanThread,
            Request::Reload { .. } => AwaitedPart::Files,
        }
    }

    /// Whether every user that can open the socket may send it. A dry reload changes nothing, but
    /// is not among these requests: it reads files with rungd's rights, shows lines of them, and
    /// costs as much as a reload.
    pub fn only_looks(&self) -> bool {
        match self {
            Request::Status {}
            | Request::Read { .. }
            | Request::ReadSet { .. }
            | Request::Recording { .. }
            | Request::Alarms {}
            | Request::Metrics {}
            | Request::Deploys {}
            | Request::Names { .. } => true,
            Request::Write { .. }
            | Request::WriteSet { .. }
            | Request::Hold { .. }
            | Request::KeepHold { .. }
            | Request::EndHold { .. }
            | Request::Force { .. }
            | Request::Unforce { .. }
            | Request::UnforceAll {}
            | Request::Mode { .. }
            | Request::Reload { .. }
            | Request::Rollback {}
            | Request::Ack { .. }
            | Request::AckAll {}
            | Request::Shelve { .. }
            | Request::Unshelve { .. }
            | Request::LogLevel { .. }
            | Request::RetainSave {} => false,
        }
    }
}
