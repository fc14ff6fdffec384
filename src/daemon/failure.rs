//! The failures of a controller's start.

use std::io;

/// The reason why a controller did not start.
#[derive(Debug)]
pub enum StartFailure {
    /// The machine does not grant a setting that the controller file requires.
    Configuration(String),
    /// A problem of the environment: a port that is taken, a thread that the system refuses.
    Environment(anyhow::Error),
}

impl From<io::Error> for StartFailure {
    fn from(error: io::Error) -> Self {
        StartFailure::Environment(error.into())
    }
}
