//! The state that the connections of a server share: settings, maps, the port to the scan. It also
//! logs refused requests.
//!
//! Made by `server`, read by each `connection`.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use super::map::ModbusMap;
use super::pdu::ModbusRequest;
use super::refusal::ModbusRefusal;
use super::settings::ModbusServerSettings;
pub use rungd_runtime::Generations;
use rungd_runtime::exchange::{Port, Snapshot};
pub use rungd_runtime::say::say;

/// The texts about a refused request, for the log.
pub(super) struct RefusalText<'t> {
    /// The operands of the request.
    pub place: &'t str,
    /// The reason.
    pub why: &'t str,
}

/// The state that the connections share.
pub(super) struct ServerState {
    pub settings: ModbusServerSettings,
    /// The map of each program. Reads and writes use the map of the image's own program.
    pub maps: Generations<ModbusMap>,
    pub port: Port,
    /// The time limit of the wait until a scan has seen a write.
    pub write_wait: Duration,
}

impl ServerState {
    /// The latest image, and the map of its program.
    pub fn latest(&self) -> (Arc<Snapshot>, Arc<ModbusMap>) {
        self.maps.latest(&self.port)
    }

    /// Logs a well-formed request that was refused.
    pub fn log_refusal(
        &self,
        client: SocketAddr,
        RefusalText { place, why: why_said }: RefusalText,
        request: &ModbusRequest<'_>,
        why: ModbusRefusal,
    ) {
        let exception = why.exception() as u8;
        if let ModbusRequest::Read { .. } = request {
            say!(
                MODBUS_READ_REFUSED,
                %client,
                %place,
                exception,
                "Modbus read refused: {why_said}"
            );
        } else {
            say!(
                MODBUS_WRITE_REFUSED,
                %client,
                %place,
                exception,
                "Modbus write refused: {why_said}"
            );
        }
    }

    /// The time limit for receiving a frame, from its first byte to its last, and for sending a
    /// reply.
    pub fn frame_timeout(&self) -> Duration {
        Duration::from_millis(self.settings.frame_timeout_ms.into())
    }
}
