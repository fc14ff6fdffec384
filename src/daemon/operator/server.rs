//! The operator's server: lets in a limited number of clients, and makes a lost socket again.
//!
//! The shell binds it before the first scan and runs it among the drivers. Each client has a task.
//! A client is closed if it sends garbage or half a line, does not read, or makes no request. If
//! all seats are taken, the client that has been idle longest is closed, so that the next one is
//! served. One pace for all clients limits the load of a crowd. If the socket's file is removed,
//! the server makes it again.

use std::future::Future;
use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use tokio::net::{UnixListener, UnixStream};
use tokio::task::JoinSet;
use tokio::time::{Instant, interval, sleep, sleep_until};

use super::desk::Desk;
use super::pace::Pace;
use super::peer::Peer;
use super::seats::{KEPT, Seats};
use super::session::{self, Session, Shared};
use super::socket::{self, Claim, SocketSpec};
use crate::daemon::failure::StartFailure;
use crate::say::say;

/// The most clients at a time.
const CLIENTS_MAX: usize = 64;
/// The least time between two clients. After a rest, as many clients as there are seats are let in
/// at once.
const CLIENT_EVERY: Duration = Duration::from_millis(2);
/// The interval at which the server checks that the socket is still in its place.
const LOOK_EVERY: Duration = Duration::from_secs(2);
/// The pause after a failed accept, for example if there are no file descriptors left.
const REST_AFTER_FAILURE: Duration = Duration::from_millis(100);

/// A bound server.
pub(in super::super) struct Server {
    listener: UnixListener,
    socket: socket::Bound,
    shared: Arc<Shared>,
    clients: Pace,
    /// The socket is gone, and this has been logged.
    lost: bool,
}

impl Server {
    /// Binds the socket at its place. `None` if the controller runs without it.
    ///
    /// # Errors
    /// The group is unknown, or the system refuses a socket that the controller file requires.
    pub fn bind(claim: Claim, desk: Desk) -> Result<Option<Server>, StartFailure> {
        let spec = claim.spec().clone();
        let Some((listener, socket)) = unless_done_without(&spec, claim.bind())? else {
            return Ok(None);
        };
        let listener = UnixListener::from_std(listener)?;
        tell_open(&socket);
        let shared = Arc::new(Shared::new(desk, Seats::new(CLIENTS_MAX, KEPT)));
        let clients = Pace::new(CLIENT_EVERY, CLIENTS_MAX as u32);
        Ok(Some(Server { listener, socket, shared, clients, lost: false }))
    }

    /// Serves until `stop`; then closes all connections and removes the socket.
    pub async fn run(mut self, stop: impl Future<Output = ()>) {
        let mut stop = pin!(stop);
        let mut clients = JoinSet::new();
        let mut looks = interval(LOOK_EVERY);
        let mut turn = Instant::now();
        loop {
            let accept = async {
                sleep_until(turn).await;
                self.listener.accept().await
            };
            tokio::select! {
                () = &mut stop => break,
                Some(ended) = clients.join_next() => {
                    if let Err(bug) = ended {
                        say!(OPERATOR_BUG, %bug, "a bug in rungd ended an operator's connection");
                    }
                }
                accepted = accept => {
                    turn = self.clients.take(Instant::now());
                    match accepted {
                        Ok((stream, _)) => self.admit(stream, &mut clients),
                        Err(error) => self.rest(&error).await,
                    }
                }
                _ = looks.tick() => self.look(),
            }
        }
    }

    /// If the socket is gone, makes it again; logs this once.
    fn look(&mut self) {
        let Some(why) = self.socket.lost() else {
            if std::mem::take(&mut self.lost) {
                tell_open(&self.socket);
            }
            return;
        };
        let again = self.socket.again().and_then(|listener| Ok(UnixListener::from_std(listener)?));
        let told = std::mem::replace(&mut self.lost, again.is_err());
        let then = match &again {
            Ok(_) => "it was made again".to_owned(),
            Err(StartFailure::Configuration(why)) => format!("not made again: {why}"),
            Err(StartFailure::Environment(why)) => {
                format!("not made again: {why:#}; rungd tries again")
            }
        };
        if !told {
            let socket = self.socket.path().display();
            say!(OPERATOR_SOCKET_LOST,
                %socket,
                "the operator's socket {socket} is gone: {why}; {then}"
            );
        }
        if let Ok(listener) = again {
            self.listener = listener;
            tell_open(&self.socket);
        }
    }

    fn admit(&self, stream: UnixStream, clients: &mut JoinSet<()>) {
        let Ok(peer) = Peer::of(&stream, self.socket.owner) else { return };
        let Some(seat) = self.shared.seats.take(peer.uid, peer.may_change) else {
            session::turn_away(&stream, CLIENTS_MAX);
            return;
        };
        let (who, pid) = (&peer, peer.pid);
        say!(OPERATOR_CONNECTED, %who, pid, "operator's client connected");
        let session = Session::new(stream, peer, seat, Arc::clone(&self.shared));
        clients.spawn(session.serve());
    }

    async fn rest(&self, error: &io::Error) {
        say!(OPERATOR_ACCEPT_FAILED, %error, "the operator's socket accepts no client");
        self.shared.seats.make_room();
        sleep(REST_AFTER_FAILURE).await;
    }
}

fn tell_open(socket: &socket::Bound) {
    let instead = socket.instead_of().map_or(String::new(), |path| {
        format!(" here and not at `{path}`: a service ignores a relative `[operator] socket`")
    });
    say!(OPERATOR_LISTENS,
        socket = %socket.path().display(),
        mode = %format_args!("{:04o}", socket.mode()),
        group = socket.owner.gid,
        "the operator's socket is open{instead}"
    );
}

/// Claims the place of the operator's socket, before the start touches anything else. `None` if the
/// controller runs without a socket.
///
/// # Errors
/// A different controller has the place, or the system refuses a socket that the controller file
/// requires.
pub(in super::super) fn claim(spec: &SocketSpec) -> Result<Option<Claim>, StartFailure> {
    unless_done_without(spec, Claim::new(spec))
}

/// Turns a failure into `None` and a line in the log if the controller can run without the socket,
/// that is, if only the environment requested it.
fn unless_done_without<T>(
    spec: &SocketSpec,
    done: Result<T, StartFailure>,
) -> Result<Option<T>, StartFailure> {
    match done {
        Err(StartFailure::Environment(why))
            if !spec.insists && !why.is::<socket::SocketTaken>() =>
        {
            say!(OPERATOR_NO_SOCKET,
                socket = %spec.path.display(),
                "operator's commands are not available: {why:#}"
            );
            Ok(None)
        }
        done => done.map(Some),
    }
}
