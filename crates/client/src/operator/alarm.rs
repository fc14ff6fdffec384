//! Alarms in the protocol: the content of the controller's alarm book, and the effect of an
//! acknowledgement.
//!
//! Part of [`super::protocol`], which describes the rest; `daemon::alarm_book` keeps the book.
//! Names of times end in their unit.

use serde::{Deserialize, Serialize};

use super::shelf::{AlarmShelf, OUT_OF_SERVICE, OUT_OF_SERVICE_WORDS, SHELVED};

pub use rungd_language::resolve::priority::Priority;

/// The state of an alarm, as defined by ISA-18.2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AlarmState {
    /// Its bit is OFF, and nothing is left to be acknowledged.
    Normal,
    /// It is active, and not acknowledged.
    #[default]
    Unacknowledged,
    /// It is active, and acknowledged.
    Acknowledged,
    /// It went away unacknowledged.
    Returned,
}

impl AlarmState {
    /// Whether the alarm's bit is ON.
    pub fn is_active(self) -> bool {
        match self {
            AlarmState::Unacknowledged | AlarmState::Acknowledged => true,
            AlarmState::Normal | AlarmState::Returned => false,
        }
    }

    /// Whether the alarm waits for an acknowledgement, unless it is shelved.
    pub fn waits(self) -> bool {
        match self {
            AlarmState::Unacknowledged | AlarmState::Returned => true,
            AlarmState::Acknowledged | AlarmState::Normal => false,
        }
    }

    /// The name of the state in answers and in the log.
    pub const fn name(self) -> &'static str {
        match self {
            AlarmState::Normal => "normal",
            AlarmState::Unacknowledged => "unacknowledged",
            AlarmState::Acknowledged => "acknowledged",
            AlarmState::Returned => "returned",
        }
    }
}

/// How many alarms of a list are active, how many returned before anybody acknowledged them, and
/// how many are suppressed, as a sentence's beginning: `2 active alarms, 1 returned
/// unacknowledged`.
pub fn alarm_count<'a>(alarms: impl Iterator<Item = &'a AlarmStatus>) -> String {
    let (mut active, mut returned, mut shelved, mut out) = (0, 0, 0, 0);
    for alarm in alarms {
        match alarm.shelved.as_ref().map(AlarmShelf::is_timed) {
            Some(true) => shelved += 1,
            Some(false) => out += 1,
            None if alarm.state.is_active() => active += 1,
            None => returned += 1,
        }
    }
    let mut counted = match active {
        0 => "no active alarm".to_owned(),
        1 => "1 active alarm".to_owned(),
        many => format!("{many} active alarms"),
    };
    let others =
        [(returned, "returned unacknowledged"), (shelved, SHELVED), (out, OUT_OF_SERVICE_WORDS)];
    for (count, words) in others.into_iter().filter(|(count, _)| *count > 0) {
        counted += &format!(", {count} {words}");
    }
    counted
}

/// A time of an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlarmTime {
    /// Complete scans since the process started.
    pub scan: u64,
    /// ns since 1970 (UTC).
    pub unix_ns: i64,
}

/// A person's acknowledgement.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlarmAck {
    /// The user.
    pub who: String,
    /// ns since 1970 (UTC).
    pub unix_ns: i64,
}

/// An active alarm, or one that returned to normal unacknowledged.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlarmStatus {
    /// The tag.
    pub tag: String,
    /// The alarm's text, written by the ladder's author.
    pub text: String,
    /// How soon a person has to act.
    #[serde(default)]
    pub priority: Priority,
    /// The part of the machine that it is of, if the ladder says it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// Its state.
    #[serde(default)]
    pub state: AlarmState,
    /// When it last went ON.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub since: Option<AlarmTime>,
    /// When it went OFF; `None` if it is ON.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<AlarmTime>,
    /// How long it has been ON, or was ON.
    #[serde(default)]
    pub lasted_ms: u64,
    /// The number of the episode. An episode begins with an alarm that rises while no other alarm
    /// stands.
    #[serde(default)]
    pub episode: u64,
    /// Its number in the episode, from 1: the order in which the alarms rose.
    #[serde(default)]
    pub order: u32,
    /// How often it rose in the last day, as counted by this process.
    #[serde(default)]
    pub day: u32,
    /// The acknowledgement, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acknowledged: Option<AlarmAck>,
    /// Who shelved it, or took it out of service; `state` is then that of its bit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shelved: Option<AlarmShelf>,
    /// For a watch: the line that does not hold.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub watch: Option<String>,
    /// For a watch: why the line did not hold in the scan of `since`, as lines of text; empty until
    /// that is known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub why: Vec<String>,
}

impl AlarmStatus {
    /// Whether it stands, and somebody has to care for it: its bit is ON, and it is not shelved.
    pub fn is_standing(&self) -> bool {
        self.state.is_active() && self.shelved.is_none()
    }

    /// Whether it waits for an acknowledgement.
    pub fn waits(&self) -> bool {
        self.state.waits() && self.shelved.is_none()
    }

    /// The name of its state, or of its suppression.
    pub fn state_name(&self) -> &'static str {
        self.shelved.as_ref().map_or(self.state.name(), AlarmShelf::name)
    }

    /// For a watch: the line that does not hold, and why it did not when the alarm rose. Empty for
    /// the alarm of a bit, which `why` explains by its tag.
    pub fn watch_lines(&self) -> Vec<String> {
        let Some(line) = &self.watch else { return Vec::new() };
        let why = self.why.iter().map(|line| format!("  {line}"));
        [format!("it does not hold: {line}")].into_iter().chain(why).collect()
    }
}

/// The names of the states of listed alarms, and of suppressed ones.
pub const LISTED_STATES: [&str; 5] = [
    AlarmState::Unacknowledged.name(),
    AlarmState::Acknowledged.name(),
    AlarmState::Returned.name(),
    SHELVED,
    OUT_OF_SERVICE,
];

/// The answer to `alarms`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AlarmList {
    /// `RUN`, `STOP` or `FAULT`.
    pub mode: String,
    /// Complete scans since the process started.
    pub scans: u64,
    /// The standing alarms, in the order in which they rose; then the alarms that only wait for an
    /// acknowledgement; then those that are shelved or out of service.
    pub alarms: Vec<AlarmStatus>,
}

/// The answer to `ack` and `ack-all`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AckList {
    /// The requested alarms, in the order of the request.
    pub alarms: Vec<AckedAlarm>,
}

/// The effect of an acknowledgement on one alarm.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AckedAlarm {
    /// The tag.
    pub tag: String,
    /// The alarm's text, written by the ladder's author.
    pub text: String,
    /// Its state before.
    pub before: AlarmState,
    /// Its state now; the same if there was nothing to acknowledge.
    pub after: AlarmState,
    /// Whether it is shelved or out of service: then nobody has to acknowledge it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub shelved: bool,
    /// The bit by which the ladder sees the acknowledgement (`ack`), if the alarm has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bit: Option<String>,
    /// Why the bit was not turned ON; the acknowledgement is entered nevertheless.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bit_refused: Option<String>,
}

impl AckedAlarm {
    /// What became of its bit, as the end of a sentence; empty without one.
    pub fn bit_words(&self) -> String {
        match (&self.bit, &self.bit_refused) {
            (None, _) => String::new(),
            (Some(bit), None) => format!("; {bit} is written ON"),
            (Some(bit), Some(why)) => {
                format!("; the ladder does NOT see it, {bit} is not written: {why}")
            }
        }
    }
}
