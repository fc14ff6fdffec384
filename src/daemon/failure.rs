//! Why a controller did not start: what every part of the start can fail with.

use std::io;

/// Why a controller did not start.
#[derive(Debug)]
pub enum Failure {
    /// What the controller file insists on is not to be had here.
    Configuration(String),
    /// The environment: a port that is taken, no thread to be had.
    Environment(anyhow::Error),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Failure::Environment(error.into())
    }
}
