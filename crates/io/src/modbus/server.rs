//! The listening socket: admits clients, limits their number, and logs both.
//!
//! The daemon binds it before the first scan, and runs it in its runtime until it stops. Each
//! client has a task. At the limit, a client that has not been answered yet is closed to make room
//! for the new client (`guests`). If all clients have been answered, the new client is closed at
//! once. A panic in a task ends that client's connection and is logged as an error; it never ends
//! the daemon.

use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinError;
use tokio::time::sleep;

use super::connection::Connection;
use super::guests::{Ended, Guests};
use super::map::Map;
use super::settings::Modbus;
use super::shared::ServerState;
pub use rungd_runtime::Generations;
use rungd_runtime::exchange::Port;
pub use rungd_runtime::say::say;

/// The pause after a failed accept if no client could be closed, so that the loop does not spin.
const REST_AFTER_FAILURE: Duration = Duration::from_millis(20);

/// The shortest time limit of a write's wait. A scan that does not end causes a fault long before,
/// and a fault ends the wait too.
const WRITE_WAIT_LEAST: Duration = Duration::from_secs(10);

/// A bound server.
pub struct Server {
    listener: TcpListener,
    shared: Arc<ServerState>,
    clients: Arc<AtomicUsize>,
}

impl Server {
    /// Binds the socket, and sets the inputs of the image to their first values. `maps` must be
    /// made from the same settings. A write waits for 10 s, or for `patience` if that is longer.
    ///
    /// # Errors
    /// When the address cannot be bound.
    pub async fn bind(
        settings: Modbus,
        maps: Generations<Map>,
        port: Port,
        patience: Duration,
    ) -> io::Result<Server> {
        let listener = TcpListener::bind(settings.listen).await?;
        for (x, on) in maps.of(0).first_inputs(&port.latest()) {
            port.set_input(x, on);
        }
        let write_wait = patience.max(WRITE_WAIT_LEAST);
        let shared = ServerState { settings, maps, port, write_wait };
        let server = Server { listener, shared: Arc::new(shared), clients: Arc::default() };
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

    /// The number of connected clients, for `status`.
    pub fn clients(&self) -> Arc<AtomicUsize> {
        Arc::clone(&self.clients)
    }

    /// Serves until `stop`; then all connections are closed.
    pub async fn run(self, stop: impl Future<Output = ()>) {
        let mut stop = pin!(stop);
        let mut guests = Guests::default();
        loop {
            tokio::select! {
                () = &mut stop => break,
                ended = guests.next_gone() => log_end(ended),
                accepted = self.listener.accept() => match accepted {
                    Ok((stream, client)) => self.admit(stream, client, &mut guests),
                    Err(error) => self.rest(&error, &mut guests).await,
                }
            }
            self.clients.store(guests.count(), Ordering::Relaxed);
        }
        say!(MODBUS_STOPS, clients = guests.count(), "Modbus server stops");
    }

    fn admit(&self, stream: TcpStream, client: SocketAddr, guests: &mut Guests) {
        while let Some(ended) = guests.gone() {
            log_end(ended);
        }
        let connections = self.shared.settings.connections;
        if guests.count() >= connections as usize {
            let Some(silent) = guests.make_room() else {
                // Dropping the stream closes it.
                say!(
                    MODBUS_FULL,
                    %client,
                    connections,
                    "Modbus client refused: no connection left"
                );
                return;
            };
            log_given_way(silent);
        }
        say!(MODBUS_CONNECTED, %client, "Modbus client connected");
        let shared = Arc::clone(&self.shared);
        guests.seat(client, |served| Connection::new(stream, client, shared, served).serve());
    }

    /// Closes a client or pauses after a failed accept, which happens if no file descriptor is
    /// left.
    async fn rest(&self, error: &io::Error, guests: &mut Guests) {
        say!(MODBUS_ACCEPT_FAILED, %error, "Modbus server cannot accept a client");
        match guests.make_room() {
            Some(silent) => {
                log_given_way(silent);
                guests.see_out().await;
            }
            None => sleep(REST_AFTER_FAILURE).await,
        }
    }

    fn log_start(&self) {
        let Modbus { listen, connections, .. } = self.shared.settings;
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

fn log_given_way(client: SocketAddr) {
    let why = "it had sent no request, and a new client needs its place";
    say!(MODBUS_CLOSED, %client, "Modbus client closed: {why}");
}

fn log_end(ended: Result<Ended, JoinError>) {
    let (client, why) = match ended {
        Ok(ended) => ended,
        Err(error) => {
            say!(MODBUS_BUG, %error, "a bug in rungd ended a Modbus client's connection");
            return;
        }
    };
    if why.is_usual() {
        say!(MODBUS_GONE, %client, "Modbus client gone: {why}");
    } else {
        say!(MODBUS_CLOSED, %client, "Modbus client closed: {why}");
    }
}
