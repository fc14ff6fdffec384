//! A row of the catalogue, and the macro that makes constants of rows.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use super::limit::LineLimit;

/// Makes a constant of each row, and `EVENTS`, the table of a file's rows:
///
/// ```text
/// CONSTANT = number, name, level, limit:
///     message ID,
///     what it means,
///     what to do;
/// ```
macro_rules! rows {
    ($($constant:ident = $number:literal, $name:literal, $level:ident, $limit:ident:
        $id:literal, $meaning:literal, $remedy:literal;)+) => {
        $(
            #[doc = $meaning]
            pub const $constant: $crate::events::row::Event = $crate::events::row::Event {
                number: $number,
                name: $name,
                level: $crate::events::row::Level::$level,
                limit: $crate::events::limit::LineLimit::$limit,
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
    /// What it means, in a sentence or two.
    pub meaning: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
}

/// How urgent: the level of an event, and from which level on the log tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
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
