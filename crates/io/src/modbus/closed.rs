//! The reasons why a client's connection ends, each with a clause for the log.

use std::fmt;
use std::io;
use std::time::Duration;

use super::frame::FrameError;

/// Why a connection ended.
#[derive(Debug)]
pub(super) enum ConnectionEnd {
    /// The client closed it, between two frames.
    ByClient,
    /// The client closed it within a frame.
    WithinFrame,
    /// The client was silent for too long.
    Idle(Duration),
    /// A frame was not complete in time.
    Unfinished(Duration),
    /// The client did not read a reply in time.
    NotTaken(Duration),
    /// The received bytes are not Modbus TCP.
    Broken(FrameError),
    /// The connection failed.
    Failed(io::Error),
    /// A new client needed its place.
    MadeRoom,
}

impl ConnectionEnd {
    /// Whether connections usually end in this way.
    pub fn is_usual(&self) -> bool {
        matches!(self, ConnectionEnd::ByClient | ConnectionEnd::Idle(_) | ConnectionEnd::Failed(_))
    }
}

impl fmt::Display for ConnectionEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = |f: &mut fmt::Formatter<'_>, words, limit: &Duration| {
            write!(f, "{words} {} s", limit.as_secs_f64())
        };
        match self {
            ConnectionEnd::ByClient => f.write_str("the client closed it"),
            ConnectionEnd::WithinFrame => f.write_str("the client closed it within a frame"),
            ConnectionEnd::Idle(limit) => seconds(f, "no request for", limit),
            ConnectionEnd::Unfinished(limit) => seconds(f, "a frame unfinished after", limit),
            ConnectionEnd::NotTaken(limit) => seconds(f, "a reply not taken for", limit),
            ConnectionEnd::Broken(broken) => broken.fmt(f),
            ConnectionEnd::Failed(error) => error.fmt(f),
            ConnectionEnd::MadeRoom => {
                f.write_str("it had sent no request, and a new client needs its place")
            }
        }
    }
}
