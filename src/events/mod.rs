//! The catalogue of events: everything that the log can say, a row each.
//!
//! Each row is a constant. A log line names it (`say!(ALARM_ON, …)`) and takes its level from it.
//! The log's writer takes the rest: the stable code, the message ID by which `journalctl -x` finds
//! the explanation, and how often such lines may come. `rungd explain` and `docs/events.md` are
//! made of the same rows. A code and an ID, once given, never change: a test keeps a list of them
//! (`events.txt`), and finds rows that no line uses.
//!
//! Deliberately absent: texts of log lines, which stand where they are logged, and tracing.

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
            pub const $constant: $crate::events::Event = $crate::events::Event {
                number: $number,
                name: $name,
                level: $crate::events::Level::$level,
                limit: $crate::events::Limit::$limit,
                id: $id,
                meaning: $meaning,
                remedy: $remedy,
            };
        )+

        pub(super) const EVENTS: &[(&str, $crate::events::Event)] =
            &[$((stringify!($constant), $constant)),+];
    };
}

mod controller;
mod device;
mod journal_catalog;
mod memory;
mod plant;
mod reload;
mod world;

pub use controller::*;
pub use device::*;
pub use journal_catalog::catalog;
pub use memory::*;
pub use plant::*;
pub use reload::*;
pub use world::*;

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
    pub limit: Limit,
    /// What it means, in a sentence or two.
    pub meaning: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
}

/// How urgent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Level {
    Error,
    Warn,
    Info,
    Debug,
}

/// How many lines of a kind are written: so many at once, so many a second in the long run. What
/// is beyond is counted and told (`lines-withheld`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// So many at once; 0 is without limit.
    pub burst: u32,
    /// So many a second in the long run.
    pub per_second: u32,
}

impl Limit {
    /// What comes seldom by itself, or is thinned out where it is made.
    pub const NONE: Limit = Limit { burst: 0, per_second: 0 };
    /// What the plant can cause.
    pub const PLANT: Limit = Limit { burst: 200, per_second: 20 };
    /// What anybody on the network or the socket can cause.
    pub const CLIENTS: Limit = Limit { burst: 20, per_second: 1 };
}

/// The hundreds of the codes, and what they are about.
pub const GROUPS: [(u16, &str); 12] = [
    (0, "The process"),
    (1, "Real-time posture"),
    (2, "Modes"),
    (3, "Alarms and tags"),
    (4, "Programs, Tasks and Stages"),
    (5, "Scans"),
    (6, "The log itself"),
    (7, "Modbus"),
    (8, "The operator"),
    (9, "Retentive memory"),
    (10, "Reloads"),
    (11, "Field devices"),
];

const TABLES: [&[(&str, Event)]; 6] = [
    controller::EVENTS,
    plant::EVENTS,
    world::EVENTS,
    memory::EVENTS,
    reload::EVENTS,
    device::EVENTS,
];

/// All rows, by code.
pub fn all() -> impl Iterator<Item = &'static Event> {
    TABLES.into_iter().flatten().map(|(_, event)| event)
}

/// The row of a name.
pub fn named(name: &str) -> Option<&'static Event> {
    all().find(|event| event.name == name)
}

/// The row of a code, in any case: `RUNGD-0301`.
pub fn coded(code: &str) -> Option<&'static Event> {
    all().find(|event| event.code().eq_ignore_ascii_case(code))
}

impl Event {
    /// `RUNGD-0301`.
    pub fn code(&self) -> String {
        format!("RUNGD-{:04}", self.number)
    }

    /// What its hundred is about.
    pub fn group(&self) -> &'static str {
        let group = GROUPS.iter().find(|(hundred, _)| *hundred == self.number / 100);
        group.map_or("", |(_, title)| title)
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
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn codes_rise_and_names_and_ids_are_unique() {
        let numbers: Vec<u16> = all().map(|event| event.number).collect();
        assert!(numbers.is_sorted_by(|a, b| a < b), "{numbers:?}");
        let count = numbers.len();
        assert_eq!(all().map(|event| event.name).collect::<HashSet<_>>().len(), count);
        assert_eq!(all().map(|event| event.id).collect::<HashSet<_>>().len(), count);
    }

    #[test]
    fn a_constant_is_named_like_its_event() {
        for (constant, event) in TABLES.into_iter().flatten() {
            assert_eq!(constant.to_ascii_lowercase().replace('_', "-"), event.name);
        }
    }

    #[test]
    fn a_row_is_whole() {
        for event in all() {
            let name = event.name;
            let hex = |c: char| c.is_ascii_digit() || ('a'..='f').contains(&c);
            assert!(event.id.len() == 32 && event.id.chars().all(hex), "{name}: {}", event.id);
            for text in [event.meaning, event.remedy] {
                assert!(text.ends_with('.') && !text.contains(['\n', '@']), "{name}: {text}");
            }
            assert!(!event.group().is_empty(), "{name}: {} is in no group", event.number);
        }
    }

    #[test]
    fn a_row_is_found_by_name_and_by_code() {
        assert_eq!(named("alarm-on").map(|event| event.number), Some(301));
        assert_eq!(coded("rungd-0301").map(|event| event.name), Some("alarm-on"));
        assert!(named("alarm").is_none() && coded("RUNGD-9999").is_none());
    }
}
