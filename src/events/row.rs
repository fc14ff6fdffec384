//! A row of the catalogue, and the macro that makes constants of rows.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use super::limit::LineLimit;

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
    /// In kebab-case, unique.
    pub name: &'static str,
    /// At which level it usually comes.
    pub level: Level,
    /// The journal's MESSAGE_ID: 32 hexadecimal digits.
    pub id: &'static str,
    /// How many such lines are written.
    pub limit: LineLimit,
    /// Whether a controller file may leave such lines out.
    pub silence: Silence,
    /// What it means, in a sentence or two.
    pub meaning: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
}

/// Whether `[log]` of a controller file may leave the lines of an event out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Silence {
    /// Never, and its level is at least info: the line tells of a start or an end, a mode, a fault,
    /// an alarm, an overrun, a lost device, a change by a person or a reload, or of what the log,
    /// retentive memory or the scan log has lost.
    Never,
    /// By the event's name in `[log.events]`.
    ByName,
    /// By its name, and by `[log] blocks = "none"`: a Program, Task or Stage changed its state.
    ByBlocks,
    /// By its name, and by `[log] blocks` if that is not `"all"`: a Stage changed its state.
    ByStages,
}

/// How urgent: the level of an event, and from which level on the log tells. The most urgent is the
/// least.
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

/// The hundreds of the codes, and what they are about.
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
    /// `RUNGD-0301`.
    pub fn code(&self) -> String {
        format!("RUNGD-{:04}", self.number)
    }
}

impl Level {
    /// All levels, the most urgent first.
    pub const ALL: [Level; 5] =
        [Level::Error, Level::Warn, Level::Info, Level::Debug, Level::Trace];

    /// In words.
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
