//! Alarms in the protocol: what the controller's book says of each, and what an acknowledgement
//! changed.
//!
//! Part of [`super::protocol`], which says the rest; `daemon::alarm_book` keeps the book. Names of
//! times end in their unit.

use serde::{Deserialize, Serialize};

use crate::resolve::priority::Priority;

/// The state of an alarm, as ISA-18.2 has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum AlarmState {
    /// Its bit is OFF, and nothing is left to be acknowledged.
    Normal,
    /// It stands, and nobody has acknowledged it.
    #[default]
    Unacknowledged,
    /// It stands, and somebody has acknowledged it.
    Acknowledged,
    /// It went away before anybody acknowledged it.
    Returned,
}

impl AlarmState {
    /// Whether the alarm's bit is ON.
    pub fn stands(self) -> bool {
        match self {
            AlarmState::Unacknowledged | AlarmState::Acknowledged => true,
            AlarmState::Normal | AlarmState::Returned => false,
        }
    }

    /// The word for it in answers and in the log.
    pub fn name(self) -> &'static str {
        match self {
            AlarmState::Normal => "normal",
            AlarmState::Unacknowledged => "unacknowledged",
            AlarmState::Acknowledged => "acknowledged",
            AlarmState::Returned => "returned",
        }
    }
}

/// A time of an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct AlarmTime {
    /// Complete scans since the process started.
    pub scan: u64,
    /// ns since 1970 (UTC).
    pub unix_ns: i64,
}

/// A person's acknowledgement.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct AlarmAck {
    /// The user.
    pub who: String,
    /// ns since 1970 (UTC).
    pub unix_ns: i64,
}

/// An alarm that stands, or that went away before anybody acknowledged it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Alarm {
    /// The tag.
    pub tag: String,
    /// What the ladder's author says of it.
    pub text: String,
    /// How soon a person has to act.
    #[serde(default)]
    pub priority: Priority,
    /// Its state.
    #[serde(default)]
    pub state: AlarmState,
    /// When it went ON last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub since: Option<AlarmTime>,
    /// When it went OFF, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<AlarmTime>,
    /// How long it has stood, or stood.
    #[serde(default)]
    pub lasted_ms: u64,
    /// The episode: one begins with an alarm that rises while no other stands.
    #[serde(default)]
    pub episode: u64,
    /// Its number in the episode, from 1: the order in which alarms rose.
    #[serde(default)]
    pub order: u32,
    /// How often it rose in the last day, as far as this process knows.
    #[serde(default)]
    pub day: u32,
    /// Who acknowledged it, if somebody did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acknowledged: Option<AlarmAck>,
}

/// The answer to `alarms`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct AlarmList {
    /// `RUN`, `STOP` or `FAULT`.
    pub mode: String,
    /// Complete scans since the process started.
    pub scans: u64,
    /// Those that stand, in the order in which they rose; then those that wait for an
    /// acknowledgement alone.
    pub alarms: Vec<Alarm>,
}

/// The answer to `ack` and `ack-all`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct AckList {
    /// The alarms named, in that order.
    pub alarms: Vec<AckedAlarm>,
}

/// What an acknowledgement changed in one alarm.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct AckedAlarm {
    /// The tag.
    pub tag: String,
    /// What the ladder's author says of it.
    pub text: String,
    /// Its state before.
    pub before: AlarmState,
    /// Its state now; the same if there was nothing to acknowledge.
    pub after: AlarmState,
}
