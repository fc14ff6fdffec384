//! What the connections of a server share: settings, maps, the port to the scan, and the lines of
//! the log about refused requests.
//!
//! Made by `server`, read by each `connection`.

use std::net::SocketAddr;
use std::time::Duration;

use super::map::Map;
use super::pdu::Request;
use super::refusal::Refusal;
use super::settings::Modbus;
use crate::runtime::Generations;
use crate::runtime::exchange::Port;
use crate::say::say;

/// What the connections share.
pub(super) struct Shared {
    pub settings: Modbus,
    /// By program: an image is read, and a write made, by its own.
    pub maps: Generations<Map>,
    pub port: Port,
    /// How long a write waits for the scan that sees it.
    pub write_wait: Duration,
}

impl Shared {
    /// Logs a request that was well-formed and not done.
    pub fn log_refusal(
        &self,
        client: SocketAddr,
        place: &str,
        request: &Request<'_>,
        why: Refusal,
    ) {
        let exception = why.exception() as u8;
        if let Request::Read { .. } = request {
            say!(
                MODBUS_READ_REFUSED,
                %client,
                %place,
                exception,
                "Modbus read refused: {why}"
            );
        } else {
            say!(
                MODBUS_WRITE_REFUSED,
                %client,
                %place,
                exception,
                "Modbus write refused: {why}"
            );
        }
    }

    /// How long a frame may take from its first byte to its last, and a reply to be taken.
    pub fn frame_timeout(&self) -> Duration {
        Duration::from_millis(self.settings.frame_timeout_ms.into())
    }

    /// How long a client may be silent between two requests.
    pub fn idle_timeout(&self) -> Duration {
        Duration::from_millis(self.settings.idle_timeout_ms.into())
    }
}
