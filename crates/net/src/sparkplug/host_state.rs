//! The state of a host application: JSON, in the only message that is no protocol buffer
//! (specification, 6.4.30).

use serde::{Deserialize, Serialize};

/// Whether a host is online, and since when.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HostState {
    /// Whether the host is online.
    pub online: bool,
    /// The time at which it connected, ms since 1970 (UTC). Its will has the same time as its
    /// birth.
    pub timestamp: u64,
}

impl HostState {
    /// The state as bytes.
    pub fn bytes(self) -> Vec<u8> {
        format!(r#"{{"online":{},"timestamp":{}}}"#, self.online, self.timestamp).into_bytes()
    }

    /// Reads a state.
    ///
    /// # Errors
    /// The bytes are no state: the reason, for people.
    pub fn read(bytes: &[u8]) -> Result<HostState, String> {
        serde_json::from_slice(bytes).map_err(|error| format!("not a STATE of a host: {error}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_host_state_is_read_back() {
        let state = HostState { online: true, timestamp: 1_700_000_000_123 };
        assert_eq!(HostState::read(&state.bytes()), Ok(state));
        assert!(HostState::read(b"ONLINE").is_err());
        assert!(HostState::read(br#"{"online":true}"#).is_err());
        assert!(HostState::read(br#"{"online":true,"timestamp":-1}"#).is_err());
    }
}
