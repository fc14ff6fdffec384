//! The operator's server: lets in a limited number of clients, and makes a lost socket again. The
//! view socket has a server too: its clients look, and change nothing.
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
use tokio::time::{Instant, interval, sleep_until};

use super::pace::TurnPace;
use super::peer::{OperatorPeer, PeerSocket};
use super::service::OperatorService;
use super::session::{self, OperatorSession, SessionShared};
use super::socket::{self, SocketClaim, SocketOwner, SocketTaken};
use crate::daemon::failure::StartFailure;
use rungd_client::operator::socket_place::{InsteadOf, SocketPurpose, SocketSpec};
use rungd_config::controller::operator::Operator;
use rungd_io::seats::{SeatClient, SeatSettings, Seats};
use rungd_runtime::say::say;

/// A client without requests is closed after the idle time. If all seats are busy, a new client is
/// turned away at once.
const SEATS: SeatSettings = SeatSettings {
    count_max: 64,
    reserved: 8,
    idle_max: Duration::from_secs(60),
    wait_max: Duration::ZERO,
    rest: Duration::from_millis(100),
};
/// The least time between two clients. After a rest, as many clients as there are seats are let in
/// at once.
const CLIENT_EVERY: Duration = Duration::from_millis(2);
/// The interval at which the server checks that the socket is still in its place.
const LOOK_EVERY: Duration = Duration::from_secs(2);

/// A bound server of one socket. The servers of a controller share the service and the seats.
pub(in super::super) struct OperatorServer {
    listener: UnixListener,
    socket: socket::BoundSocket,
    /// The owner of the operator's socket: of its group, everybody may look at everything.
    operator: SocketOwner,
    shared: Arc<SessionShared>,
    clients: TurnPace,
    /// The socket is gone, and this has been logged.
    lost: bool,
}

impl OperatorServer {
    /// Binds the claimed sockets at their places, the operator's socket first. Empty if the
    /// controller runs without it.
    ///
    /// # Errors
    /// A group is unknown, or the system refuses a socket that the controller file requires.
    pub fn bind(
        claims: Vec<SocketClaim>,
        service: OperatorService,
    ) -> Result<Vec<OperatorServer>, StartFailure> {
        let mut bound = Vec::new();
        for claim in claims {
            let spec = claim.spec().clone();
            match unless_done_without(&spec, claim.bind())? {
                Some(socket) => bound.push(socket),
                None if spec.door == SocketPurpose::Operator => return Ok(Vec::new()),
                None => {}
            }
        }
        let Some((_, first)) = bound.first() else { return Ok(Vec::new()) };
        let (operator, path) = (first.owner, first.path().to_owned());
        let shared = Arc::new(SessionShared::new(service, Seats::new(SEATS), path));
        let server = |(listener, socket): (_, socket::BoundSocket)| {
            let listener = UnixListener::from_std(listener)?;
            tell_open(&socket);
            let clients = TurnPace::new(CLIENT_EVERY, SEATS.count_max as u32);
            let shared = Arc::clone(&shared);
            Ok(OperatorServer { listener, socket, operator, shared, clients, lost: false })
        };
        bound.into_iter().map(server).collect()
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
        self.socket.keep_listed();
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
            let (socket, name) = (self.socket.path().display(), self.socket.door().name());
            say!(OPERATOR_SOCKET_LOST,
                %socket,
                "{name} {socket} is gone: {why}; {then}"
            );
        }
        if let Ok(listener) = again {
            self.listener = listener;
            tell_open(&self.socket);
        }
    }

    fn admit(&self, stream: UnixStream, clients: &mut JoinSet<()>) {
        let Ok(peer) = OperatorPeer::of(&stream, &self.doorway()) else { return };
        let guest = SeatClient { user: peer.uid, may_change: peer.may_change };
        let Some(seat) = self.shared.seats.take(guest) else {
            session::turn_away(&stream, SEATS.count_max);
            return;
        };
        let (who, pid) = (&peer, peer.pid);
        say!(OPERATOR_CONNECTED, %who, pid, "operator's client connected");
        let session = OperatorSession::new(stream, peer, seat, Arc::clone(&self.shared));
        clients.spawn(session.serve());
    }

    fn doorway(&self) -> PeerSocket {
        PeerSocket { door: self.socket.door(), own: self.socket.owner, operator: self.operator }
    }

    async fn rest(&self, error: &io::Error) {
        let name = self.socket.door().name();
        say!(OPERATOR_ACCEPT_FAILED, %error, "{name} accepts no client");
        self.shared.seats.make_room().await;
    }
}

fn tell_open(socket: &socket::BoundSocket) {
    let (door, key) = (socket.door(), socket.door().keys()[0]);
    let instead = match socket.instead_of() {
        None => String::new(),
        Some(InsteadOf::Service(path)) => {
            format!(" here and not at `{path}`: a service ignores a relative `{key}`")
        }
        Some(InsteadOf::ReadOnly(path)) => {
            format!(" here and not at `{path}`: rungd may not write beside the controller file")
        }
    };
    let (name, limit) = match door {
        SocketPurpose::Operator => (door.name(), ""),
        SocketPurpose::View => (door.name(), "; it refuses every change"),
    };
    say!(OPERATOR_LISTENS,
        socket = %socket.path().display(),
        mode = %format_args!("{:04o}", socket.mode()),
        group = socket.owner.gid,
        "{name} is open{instead}{limit}"
    );
}

/// Claims the places of the sockets, the operator's first, before the start touches anything else.
/// Empty if the controller runs without a socket.
///
/// # Errors
/// A different controller has a place, or the system refuses a socket that the controller file
/// requires.
pub(in super::super) fn claim(
    asked: &Operator,
    controller: &str,
) -> Result<Vec<SocketClaim>, StartFailure> {
    let Some(operator) = SocketSpec::of(asked, controller) else { return Ok(Vec::new()) };
    let Some(first) = unless_done_without(&operator, SocketClaim::new(&operator))? else {
        return Ok(Vec::new());
    };
    let view = operator.view(asked, controller);
    let second = unless_done_without(&view, SocketClaim::new(&view))?;
    Ok([first].into_iter().chain(second).collect())
}

/// Turns a failure into `None` and a line in the log if the controller can run without the socket:
/// one that only the environment requested, and a view socket that nothing requested.
fn unless_done_without<T>(
    spec: &SocketSpec,
    done: Result<T, StartFailure>,
) -> Result<Option<T>, StartFailure> {
    match done {
        Err(StartFailure::Environment(why))
            if !spec.insists && (spec.door == SocketPurpose::View || !why.is::<SocketTaken>()) =>
        {
            let missing = match spec.door {
                SocketPurpose::Operator => "operator's commands are not available",
                SocketPurpose::View => "there is no socket for looks alone",
            };
            say!(OPERATOR_NO_SOCKET,
                socket = %spec.path.display(),
                "{missing}: {why:#}"
            );
            Ok(None)
        }
        done => done.map(Some),
    }
}
