//! Answers of the protocol that no file of their own has: levels of the log, saved memory.
//!
//! Part of [`super::protocol`], which has the requests. Names of times end in their unit.

use serde::{Deserialize, Serialize};

use rungd_runtime::events::Level;

/// The answer to a change of the log level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LevelChange {
    /// The level before.
    pub before: Level,
    /// The level now.
    pub after: Level,
}

/// The answer to a request to save retentive memory.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MemorySave {
    /// The file.
    pub file: String,
    /// The number of the image in the file.
    pub image: u64,
    /// The scan of the image. A later scan with the same retentive values writes no new image.
    pub scan: u64,
    /// The time until the image was durable; 0 if it was durable already.
    pub flush_us: u64,
}
