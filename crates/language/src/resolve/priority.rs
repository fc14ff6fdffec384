//! The priority of an alarm: how soon a person has to act.
//!
//! The words are those of the field (ISA-18.2, EEMUA 191). `tags` reads the priority from a tag's
//! `priority`, and `lower` passes it on with the alarm's text. Nothing in a scan depends on it.

use serde::{Deserialize, Serialize};

use rungd_base::variants::all_variants;

/// How soon a person has to act on an alarm; the most urgent first.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Priority {
    /// At once: people or the plant are in danger.
    Critical,
    /// Within minutes.
    High,
    /// Within the hour; also the priority of an alarm without `priority`.
    #[default]
    Medium,
    /// Within the shift.
    Low,
}

impl Priority {
    /// All priorities, the most urgent first.
    pub const ALL: [Priority; 4] =
        all_variants![Priority::Critical, Priority::High, Priority::Medium, Priority::Low];

    /// The word for it in files and answers.
    pub const fn name(self) -> &'static str {
        match self {
            Priority::Critical => "critical",
            Priority::High => "high",
            Priority::Medium => "medium",
            Priority::Low => "low",
        }
    }

    /// The priority with this word.
    pub(crate) fn named(word: &str) -> Option<Priority> {
        Priority::ALL.into_iter().find(|priority| priority.name() == word)
    }
}
