//! Shelved alarms in the protocol, in the words of ISA-18.2: an operator takes an alarm out of the
//! list for a time, or out of service until somebody brings it back.
//!
//! Part of [`super::protocol`]; `daemon::alarm_book` keeps the shelves. `docs/alarms.md` compares
//! them with the other ways to suppress an alarm.

use serde::{Deserialize, Serialize};

/// The longest time for which an alarm is shelved, ms: a week.
pub const SHELF_MS_MAX: u64 = 7 * 24 * 3_600_000;

/// The most characters of a reason.
pub const REASON_CHARS_MAX: usize = 200;

/// Why an alarm is not in the list of those that somebody has to care for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlarmShelf {
    /// The user.
    pub who: String,
    /// The reason that the user gave.
    pub why: String,
    /// Since when, ns since 1970 (UTC).
    pub since_ns: i64,
    /// When the alarm comes back by itself, ns since 1970 (UTC); `None`: it is out of service,
    /// until somebody brings it back.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_ns: Option<i64>,
}

impl AlarmShelf {
    /// Whether the alarm comes back by itself.
    pub fn is_timed(&self) -> bool {
        self.until_ns.is_some()
    }

    /// The name of the alarm's state.
    pub fn name(&self) -> &'static str {
        if self.is_timed() { SHELVED } else { OUT_OF_SERVICE }
    }

    /// The state in a sentence: the alarm is …
    pub fn words(&self) -> &'static str {
        if self.is_timed() { SHELVED } else { OUT_OF_SERVICE_WORDS }
    }
}

/// The name of the state of an alarm that comes back by itself.
pub const SHELVED: &str = "shelved";
/// The name of the state of an alarm that somebody has to bring back.
pub const OUT_OF_SERVICE: &str = "out-of-service";
/// This state in a sentence.
pub(super) const OUT_OF_SERVICE_WORDS: &str = "out of service";

/// The answer to `shelve` and `unshelve`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShelfList {
    /// The requested alarms, in the order of the request.
    pub alarms: Vec<ShelvedAlarm>,
    /// Why a restart would forget it; `None`: it is kept.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_kept: Option<String>,
}

/// The effect of a request on one alarm.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShelvedAlarm {
    /// The tag.
    pub tag: String,
    /// The alarm's text, written by the ladder's author.
    pub text: String,
    /// Its shelf before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub before: Option<AlarmShelf>,
    /// Its shelf now.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<AlarmShelf>,
    /// Whether its bit is ON.
    pub is_active: bool,
}

/// Whether a text may be the reason of a shelf: one line, which a person can read.
pub fn is_reason(why: &str) -> bool {
    let count = why.chars().count();
    (1..=REASON_CHARS_MAX).contains(&count)
        && !why.trim().is_empty()
        && !why.contains(rungd_language::source::wording::is_obeyed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reason_is_one_line_of_at_most_200_characters() {
        assert!(is_reason("Filter is changed") && is_reason(&"ä".repeat(200)));
        for wrong in ["", "  ", "a\nb", "\u{1b}[2J", "\u{202e}x"] {
            assert!(!is_reason(wrong), "{wrong:?}");
        }
        assert!(!is_reason(&"ä".repeat(201)));
    }
}
