//! A row of the catalogue, and the macro that makes constants from rows.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use super::limit::LineLimit;
use rungd_base::variants::all_variants;

/// Makes a constant of each row, and `EVENTS`, the table of a file's rows:
///
/// ```text
/// CONSTANT = number, name, level, limit, silence:
///     message ID,
///     what it means,
///     what to do;
/// ```
macro_rules! rows {
    ($($constant:ident = $number:literal, $name:literal, $level:ident, $limit:ident, $silence:ident:
        $id:literal, $meaning:literal, $remedy:literal;)+) => {
        $(
            #[doc = $meaning]
            pub const $constant: $crate::events::row::Event = $crate::events::row::Event {
                number: $number,
                name: $name,
                level: $crate::events::row::Level::$level,
                limit: $crate::events::limit::LineLimit::$limit,
                silence: $crate::events::row::Silence::$silence,
                id: $id,
                meaning: $meaning,
                remedy: $remedy,
            };
        )+

        pub(super) const EVENTS: &[(&str, $crate::events::row::Event)] =
            &[$((stringify!($constant), $constant)),+];
    };
}

/// A kind of log line.
#[derive(Debug)]
pub struct Event {
    /// The number in the code: 301 is `RUNGD-0301`. The hundreds are the [`GROUPS`].
    pub number: u16,
    /// The name in kebab-case; unique.
    pub name: &'static str,
    /// The level that lines of this event usually have.
    pub level: Level,
    /// The journal's MESSAGE_ID: 32 hexadecimal digits.
    pub id: &'static str,
    /// The limit of such lines.
    pub limit: LineLimit,
    /// Whether a controller file may leave such lines out.
    pub silence: Silence,
    /// The meaning, in a sentence or two.
    pub meaning: &'static str,
    /// The remedy.
    pub remedy: &'static str,
}

/// Whether `[log]` of a controller file may leave the lines of an event out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Silence {
    /// Never, and its level is at least info: the line reports a start or an end, a mode, a fault,
    /// an alarm, an overrun, a lost device, a change by a person or a reload, or a loss in the log,
    /// in retentive memory or in the scan log.
    Never,
    /// Yes, by the event's name in `[log.events]`.
    ByName,
    /// Yes, by its name, and by `[log] blocks = "none"`: a Program, Task or Stage changed its
    /// state.
    ByBlocks,
    /// Yes, by its name, and by `[log] blocks` if that is not `"all"`: a Stage changed its state.
    ByStages,
}

/// The urgency of an event, or the least urgent level that is logged. The most urgent level is the
/// least value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum Level {
    Error,
    Warn,
    Info,
    Debug,
    Trace,
}

/// The hundreds of the codes, each with its subject.
pub const GROUPS: [(u16, &str); 13] = [
    (0, "The process"),
    (1, "Real-time posture"),
    (2, "Modes"),
    (3, "Alarms and tags"),
    (4, "Programs, Tasks, Stages and MATH"),
    (5, "Scans"),
    (6, "The log itself"),
    (7, "Modbus"),
    (8, "The operator"),
    (9, "Retentive memory"),
    (10, "Reloads"),
    (11, "Field devices"),
    (12, "The scan log"),
];

impl Event {
    /// The code, as `RUNGD-0301`.
    pub fn code(&self) -> String {
        format!("RUNGD-{:04}", self.number)
    }
}

impl Level {
    /// All levels, the most urgent first.
    pub const ALL: [Level; 5] =
        all_variants![Level::Error, Level::Warn, Level::Info, Level::Debug, Level::Trace];

    /// The name of the level.
    pub fn name(self) -> &'static str {
        match self {
            Level::Error => "error",
            Level::Warn => "warn",
            Level::Info => "info",
            Level::Debug => "debug",
            Level::Trace => "trace",
        }
    }
}
