//! The operator's socket: who is let in, how many at a time, and how long each may dawdle.
//!
//! The shell binds it before the first scan and runs it among the drivers. One task a client. A
//! client that sends garbage, or half a line, or reads nothing, or sits there, is closed; where the
//! seats are taken, the one that has been idle longest goes, so that who comes next is served.
//! What requests mean is `desk`'s business. Nothing here can make a scan wait.

mod desk;
mod peer;
mod seats;
mod session;
mod socket;
mod status;

use std::future::Future;
use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use tokio::net::{UnixListener, UnixStream};
use tokio::task::JoinSet;
use tokio::time::sleep;
use tracing::{debug, error, info, warn};

pub(super) use desk::Desk;
pub(super) use socket::Place;
pub(super) use status::{AboutParts, View};

use super::shell::Failure;
use peer::Peer;
use seats::Seats;
use session::Session;

/// How many clients at a time.
const CLIENTS_MAX: usize = 64;
/// How long accepting rests after it failed, as when there are no file descriptors left.
const REST_AFTER_FAILURE: Duration = Duration::from_millis(100);

/// A bound server.
pub(super) struct Server {
    listener: UnixListener,
    socket: socket::Bound,
    shared: Arc<Shared>,
}

/// What the sessions share.
struct Shared {
    desk: Desk,
    seats: Seats,
}

impl Server {
    /// Binds the socket at its place.
    ///
    /// # Errors
    /// Somebody answers there, the group is unknown, or the system says no.
    pub fn bind(place: &Place, desk: Desk) -> Result<Server, Failure> {
        let (listener, socket) = socket::bind(place)?;
        let listener = UnixListener::from_std(listener)?;
        let shared = Shared { desk, seats: Seats::new(CLIENTS_MAX) };
        info!(
            event = "operator-listens",
            socket = %place.path.display(),
            mode = %format_args!("{:04o}", place.mode),
            group = socket.gid,
            "the operator's socket is open"
        );
        Ok(Server { listener, socket, shared: Arc::new(shared) })
    }

    /// Serves until `stop`; then all connections are closed, and the socket is gone.
    pub async fn run(self, stop: impl Future<Output = ()>) {
        let mut stop = pin!(stop);
        let mut clients = JoinSet::new();
        loop {
            tokio::select! {
                () = &mut stop => break,
                Some(ended) = clients.join_next() => {
                    if let Err(bug) = ended {
                        error!(event = "operator-bug", %bug, "a client was lost to a bug in rungd");
                    }
                }
                accepted = self.listener.accept() => match accepted {
                    Ok((stream, _)) => self.admit(stream, &mut clients),
                    Err(error) => self.rest(&error).await,
                }
            }
        }
    }

    fn admit(&self, stream: UnixStream, clients: &mut JoinSet<()>) {
        let Ok(peer) = Peer::of(&stream, &self.socket) else { return };
        let Some(seat) = self.shared.seats.take(peer.uid) else {
            session::turn_away(&stream, CLIENTS_MAX);
            return;
        };
        let (who, pid) = (&peer, peer.pid);
        debug!(event = "operator-connected", %who, pid, "operator's client connected");
        let session = Session::new(stream, peer, seat, Arc::clone(&self.shared));
        clients.spawn(session.serve());
    }

    async fn rest(&self, error: &io::Error) {
        warn!(event = "operator-accept-failed", %error, "the operator's socket accepts no client");
        self.shared.seats.make_room();
        sleep(REST_AFTER_FAILURE).await;
    }
}

/// What a controller does without its socket, as nobody but its environment asked for it: it runs.
pub(super) fn may_do_without(place: &Place, why: &Failure) -> bool {
    let Failure::Environment(why) = why else { return false };
    if place.insists || why.is::<socket::Taken>() {
        return false;
    }
    warn!(
        event = "operator-no-socket",
        socket = %place.path.display(),
        "no operator's commands: {why:#}"
    );
    true
}
