//! The listening socket: admits clients, limits their number, and logs both.
//!
//! The daemon binds it before the first scan, and runs it in its runtime until it stops. Each
//! client has a task, and a seat (`io::seats`), which it keeps once it has been answered. At the
//! limit, the oldest client that has not been answered yet is closed to make room for the new
//! client. If all clients have been answered, the new client is closed at once. A panic in a task
//! ends that client's connection and is logged as an error; it never ends the daemon.

use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use tokio::net::{TcpListener, TcpStream};
use tokio::task::{JoinError, JoinSet};

use super::connection::ClientConnection;
use super::map::ModbusMap;
use super::settings::ModbusServerSettings;
use super::shared::ServerState;
use crate::seats::{ANY_GUEST, SeatSettings, Seats};
pub use rungd_runtime::Generations;
use rungd_runtime::exchange::Port;
pub use rungd_runtime::say::say;

/// The pause after a failed accept.
const REST_AFTER_FAILURE: Duration = Duration::from_millis(20);

/// The shortest time limit of a write's wait. A scan that does not end causes a fault long before,
/// and a fault ends the wait too.
const WRITE_WAIT_LEAST: Duration = Duration::from_secs(10);

/// A bound server.
pub struct BoundModbusServer {
    listener: TcpListener,
    shared: Arc<ServerState>,
    seats: Seats,
}

fn log_bug(error: &JoinError) {
    say!(MODBUS_BUG, %error, "a bug in rungd ended a Modbus client's connection");
}

impl BoundModbusServer {
    /// Binds the socket, and sets the inputs of the image to their first values. `maps` must be
    /// made from the same settings. A write waits for 10 s, or for `patience` if that is longer.
    ///
    /// # Errors
    /// When the address cannot be bound.
    pub async fn bind(
        settings: ModbusServerSettings,
        maps: Generations<ModbusMap>,
        port: Port,
        patience: Duration,
    ) -> io::Result<BoundModbusServer> {
        let listener = TcpListener::bind(settings.listen).await?;
        for (x, on) in maps.of_generation(0).first_inputs(&port.latest()) {
            port.set_input(x, on);
        }
        let write_wait = patience.max(WRITE_WAIT_LEAST);
        let seats = Seats::new(SeatSettings {
            count_max: settings.connections as usize,
            reserved: 0,
            idle_max: Duration::from_millis(settings.idle_timeout_ms.into()),
            wait_max: Duration::ZERO,
            rest: REST_AFTER_FAILURE,
        });
        let shared = ServerState { settings, maps, port, write_wait };
        let server = BoundModbusServer { listener, shared: Arc::new(shared), seats };
        server.log_start();
        Ok(server)
    }

    /// The address at which it listens. If the settings have port 0, the address has the port that
    /// the system chose.
    ///
    /// # Errors
    /// If the system does not return the address.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// The seats of its clients, for `status`.
    pub fn seats(&self) -> Seats {
        self.seats.clone()
    }

    /// Serves until `stop`; then all connections are closed.
    pub async fn run(self, stop: impl Future<Output = ()>) {
        let mut stop = pin!(stop);
        let mut clients = JoinSet::new();
        loop {
            tokio::select! {
                () = &mut stop => break,
                Some(ended) = clients.join_next() => {
                    if let Err(bug) = ended {
                        log_bug(&bug);
                    }
                }
                accepted = self.listener.accept() => match accepted {
                    Ok((stream, client)) => self.admit(stream, client, &mut clients),
                    Err(error) => {
                        say!(MODBUS_ACCEPT_FAILED, %error, "Modbus server cannot accept a client");
                        self.seats.make_room_for_next().await;
                    }
                }
            }
        }
        say!(MODBUS_STOPS, clients = self.seats.count(), "Modbus server stops");
    }

    fn admit(&self, stream: TcpStream, client: SocketAddr, clients: &mut JoinSet<()>) {
        let Some(seat) = self.seats.take(ANY_GUEST) else {
            // Dropping the stream closes it.
            let connections = self.shared.settings.connections;
            say!(
                MODBUS_FULL,
                %client,
                connections,
                "Modbus client refused: no connection left"
            );
            return;
        };
        clients
            .spawn(ClientConnection::new(stream, client, Arc::clone(&self.shared), seat).serve());
    }

    fn log_start(&self) {
        let ModbusServerSettings { listen, connections, .. } = self.shared.settings;
        let address = self.address().unwrap_or(listen);
        say!(MODBUS_LISTENS, %address, connections, "Modbus server listens");
        if !address.ip().is_loopback() {
            say!(
                MODBUS_EXPOSED,
                %address,
                "Modbus has no passwords: every client that reaches this address can write"
            );
        }
    }
}
