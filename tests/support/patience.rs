//! How long a test waits for an event that should come within milliseconds.

use std::time::Duration;

/// The longest such wait. It only ends a test that would hang: no result depends on it. A machine's
/// disk or processors may stand still for a minute, and a test must not fail for that.
pub const PATIENCE: Duration = Duration::from_secs(300);
