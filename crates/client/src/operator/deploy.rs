//! Changes of the program in the protocol: each reload and each rollback of a process, with its
//! differences.
//!
//! Part of [`super::protocol`]; `daemon::reload` keeps the last ones.

use serde::{Deserialize, Serialize};

/// The answer to `deploys`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DeployList {
    /// The last changes of the program since the process started, the newest first.
    pub deploys: Vec<Deploy>,
}

/// A change of the program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Deploy {
    /// When the new program took over, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// The user.
    pub who: String,
    /// Whether the program before came back.
    pub rollback: bool,
    /// The name of the ladder.
    pub ladder: String,
    /// The hash of its files.
    pub sha256: String,
    /// The differences, a line each: of an edited rung its old and its new text.
    pub report: Vec<String>,
    /// The number of lines that are left out.
    #[serde(default)]
    pub more: usize,
}
