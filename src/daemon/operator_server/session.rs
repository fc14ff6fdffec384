//! Serves one client: reads request lines, writes answer lines, with a limit on everything.
//!
//! A line has a greatest length and a longest time; an answer must be taken in time. A client that
//! makes no request is closed after a while, even if it sends blank lines. Requests have two paces:
//! one per client, and one for all clients together. An answer is made after the previous answer
//! was taken, so for a client that never reads, one answer is kept, and only until its time limit.

use std::collections::HashMap;
use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::UnixStream;
use tokio::time::{Instant, sleep_until, timeout, timeout_at};

use super::pace::{TurnPace, metered};
use super::peer::{OperatorPeer, PeerRequest};
use super::refused::tell_refused;
use super::service::OperatorService;
use crate::daemon::narration::one_line;
use crate::daemon::turns::{Turn, Turns};
use rungd_base::duration_text::duration_text;
use rungd_base::locked::locked;
use rungd_client::operator::deadline::{self, Deadline, NEVER_NS, has_left};
use rungd_client::operator::protocol::{
    CHANGE_BYTES_MAX, REQUEST_BYTES_MAX, RefusalKind, Reply, Request, RequestRefusal,
    RequestResult, received,
};
use rungd_client::operator::socket_place::SocketPurpose;
use rungd_io::seats::{Seats, TakenSeat};
use rungd_runtime::say::say;

/// The time limit for a whole line.
const LINE_MAX: Duration = Duration::from_secs(5);
/// The time limit for a client to take an answer.
const TAKE_MAX: Duration = Duration::from_secs(5);
/// The least time between two requests of one client.
const REQUEST_EVERY: Duration = Duration::from_millis(2);
/// The number of consecutive lines without a request that ends a connection.
const GARBAGE_MAX: u32 = 8;

/// The most characters of a client's text that are logged.
const LOGGED_CHARS_MAX: usize = 200;

/// The least time between two requests of all clients; after a rest, some are served at once.
const REQUEST_OF_ALL_EVERY: Duration = Duration::from_millis(1);
const REQUESTS_AT_ONCE: u32 = 64;
/// The least time between two lists of names, which are long; after a rest, some are served at
/// once.
const NAMES_OF_ALL_EVERY: Duration = Duration::from_millis(20);
const NAMES_AT_ONCE: u32 = 16;

/// From this number of users on, those without a request for a recording are forgotten.
const USERS_KEPT: usize = 64;

/// The state that all sessions share.
pub(super) struct SessionShared {
    service: OperatorService,
    pub seats: Seats,
    /// The path of the operator's socket, for messages.
    operator_socket: PathBuf,
    requests: TurnPace,
    names: TurnPace,
    /// The turns of the recordings, by user.
    recordings: Mutex<HashMap<u32, Turns>>,
}

impl SessionShared {
    pub fn new(service: OperatorService, seats: Seats, operator_socket: PathBuf) -> SessionShared {
        let requests = TurnPace::new(REQUEST_OF_ALL_EVERY, REQUESTS_AT_ONCE);
        let names = TurnPace::new(NAMES_OF_ALL_EVERY, NAMES_AT_ONCE);
        let recordings = Mutex::default();
        SessionShared { service, seats, operator_socket, requests, names, recordings }
    }

    /// The turns of a user's recordings.
    fn turns_of(&self, uid: u32) -> Turns {
        let mut recordings = locked(&self.recordings);
        if recordings.len() >= USERS_KEPT {
            recordings.retain(|_, turns| turns.is_busy());
        }
        recordings.entry(uid).or_insert_with(Turns::new).clone()
    }
}

/// A client being served.
pub(super) struct OperatorSession {
    stream: UnixStream,
    peer: OperatorPeer,
    seat: Arc<TakenSeat>,
    shared: Arc<SessionShared>,
    received: Vec<u8>,
    garbage: u32,
}

/// Why a connection ended.
#[derive(Debug)]
enum SessionEnd {
    ByClient,
    Idle,
    Unfinished,
    NotTaken,
    TooLong,
    Garbage,
    MadeRoom,
}

impl fmt::Display for SessionEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            SessionEnd::ByClient => "the client closed it",
            SessionEnd::Idle => "no request for too long",
            SessionEnd::Unfinished => "a request was not finished in time",
            SessionEnd::NotTaken => "an answer was not taken in time",
            SessionEnd::TooLong => "a line was too long",
            SessionEnd::Garbage => "too many lines were not requests",
            SessionEnd::MadeRoom => "it made room for another client",
        })
    }
}

impl OperatorSession {
    pub fn new(
        stream: UnixStream,
        peer: OperatorPeer,
        seat: Arc<TakenSeat>,
        shared: Arc<SessionShared>,
    ) -> OperatorSession {
        OperatorSession { stream, peer, seat, shared, received: Vec::new(), garbage: 0 }
    }

    pub async fn serve(mut self) {
        let why = loop {
            if let Err(why) = self.one().await {
                break why;
            }
        };
        let (peer, pid) = (&self.peer, self.peer.pid);
        say!(OPERATOR_GONE, who = %peer, pid, %why, "operator's client gone");
    }

    /// One request and its answer.
    async fn one(&mut self) -> Result<(), SessionEnd> {
        let line = match self.line().await {
            Err(SessionEnd::TooLong) => {
                let message = format!("a line has at most {} bytes", self.line_bytes_max());
                let refusal = RequestRefusal::new(RefusalKind::BadRequest, message);
                self.send(&Reply::<()>::Error(refusal)).await?;
                return Err(SessionEnd::TooLong);
            }
            other => other?,
        };
        let now = Instant::now();
        if line.iter().any(|byte| !byte.is_ascii_whitespace()) {
            self.wait_for(&self.shared.requests).await?;
            let answered = self.answer(&line).await;
            self.seat.set_busy(false);
            answered?;
        } else if now >= self.seat.idle_until() {
            return Err(SessionEnd::Idle);
        }
        self.unless_asked_to_leave(sleep_until(now + REQUEST_EVERY)).await
    }

    /// Waits for a turn. A client that waits counts as idle: it makes room for a new client.
    async fn wait_for(&self, pace: &TurnPace) -> Result<(), SessionEnd> {
        self.seat.set_busy(false);
        self.unless_asked_to_leave(pace.turn()).await?;
        self.seat.set_busy(true);
        Ok(())
    }

    async fn unless_asked_to_leave(
        &self,
        wait: impl Future<Output = ()>,
    ) -> Result<(), SessionEnd> {
        tokio::select! {
            () = self.seat.asked_to_leave() => Err(SessionEnd::MadeRoom),
            () = wait => Ok(()),
        }
    }

    /// The longest line of this client, with its end: only a change needs a long one.
    fn line_bytes_max(&self) -> usize {
        if self.peer.may_change { CHANGE_BYTES_MAX } else { REQUEST_BYTES_MAX }
    }

    /// The next line, without its end.
    async fn line(&mut self) -> Result<Vec<u8>, SessionEnd> {
        let mut deadline = match self.received.is_empty() {
            true => self.seat.idle_until(),
            false => Instant::now() + LINE_MAX,
        };
        let (line_bytes_max, mut looked) = (self.line_bytes_max(), 0);
        loop {
            if let Some(end) = self.received[looked..].iter().position(|byte| *byte == b'\n') {
                let rest = self.received.split_off(looked + end + 1);
                let mut line = std::mem::replace(&mut self.received, rest);
                line.pop();
                return Ok(line);
            }
            looked = self.received.len();
            if looked >= line_bytes_max {
                return Err(SessionEnd::TooLong);
            }
            let OperatorSession { stream, seat, received, .. } = self;
            let room = line_bytes_max - looked;
            let mut part = [0; 4096];
            let part = &mut part[..room.min(4096)];
            let count = tokio::select! {
                () = seat.asked_to_leave() => return Err(SessionEnd::MadeRoom),
                read = timeout_at(deadline, stream.read(part)) => match read {
                    Err(_) if received.is_empty() => return Err(SessionEnd::Idle),
                    Err(_) => return Err(SessionEnd::Unfinished),
                    Ok(Err(_) | Ok(0)) => return Err(SessionEnd::ByClient),
                    Ok(Ok(count)) => count,
                },
            };
            if received.is_empty() {
                deadline = Instant::now() + LINE_MAX;
            }
            received.extend_from_slice(&part[..count]);
        }
    }

    async fn answer(&mut self, line: &[u8]) -> Result<(), SessionEnd> {
        let (request, deadline) = match received(line) {
            Ok(received) => received,
            Err(error) => {
                self.garbage += 1;
                let message =
                    format!("not a request: {error} (docs/operator.md shows all requests)");
                let refusal = RequestRefusal::new(RefusalKind::BadRequest, message);
                self.send(&Reply::<()>::Error(refusal)).await?;
                let enough = self.garbage >= GARBAGE_MAX;
                return if enough { Err(SessionEnd::Garbage) } else { Ok(()) };
            }
        };
        self.garbage = 0;
        let is_names = matches!(request, Request::Names { .. });
        let pace = if is_names { &self.shared.names } else { &self.shared.requests };
        if is_names {
            self.wait_for(pace).await?;
        }
        // A user's recordings are made and taken one after the other: each can have many megabytes.
        let is_recording = matches!(request, Request::Recording { .. });
        let _turn = if is_recording { Some(self.turn().await?) } else { None };
        let (answer, cost) = metered(self.done(&request, deadline)).await;
        let line = answer.unwrap_or_else(|refusal| {
            self.tell_refusal(&request, &refusal);
            Reply::<()>::Error(refusal).line()
        });
        if request.only_looks() {
            pace.charge(cost);
        }
        self.send_line(&line).await
    }

    /// Waits for the turn of this user.
    async fn turn(&self) -> Result<Turn, SessionEnd> {
        self.seat.set_busy(false);
        let turns = self.shared.turns_of(self.peer.uid);
        let turn = tokio::select! {
            () = self.seat.asked_to_leave() => return Err(SessionEnd::MadeRoom),
            turn = turns.turn() => turn,
        };
        self.seat.set_busy(true);
        Ok(turn)
    }

    /// Carries out a request whose turn has come, unless its client has given up by now.
    async fn done(&self, request: &Request, deadline: Option<Deadline>) -> RequestResult<Vec<u8>> {
        if !request.only_looks() && !self.peer.may_change {
            let message = match self.peer.door {
                SocketPurpose::Operator => format!(
                    "{} may only look: changes and dry runs are for root, the user rungd runs as, \
                     and members of the socket's group",
                    self.peer
                ),
                SocketPurpose::View => format!(
                    "this is the view socket, which refuses every change and dry run: send it to \
                     the operator's socket, {}",
                    self.shared.operator_socket.display()
                ),
            };
            return Err(RequestRefusal::new(RefusalKind::NotPermitted, message));
        }
        let until_ns = self.until_ns(request, deadline)?;
        let asker = PeerRequest { peer: self.peer.clone(), until_ns };
        self.shared.service.answer(&asker, request).await
    }

    /// The moment after which a request is not carried out.
    ///
    /// # Errors
    /// It is over, or the client is gone.
    fn until_ns(&self, request: &Request, deadline: Option<Deadline>) -> RequestResult<u64> {
        let Some(deadline) = deadline.filter(|_| !request.only_looks()) else {
            return Ok(NEVER_NS);
        };
        let until_ns = deadline.until_ns().unwrap_or(NEVER_NS);
        let late_ns = deadline::now_ns().saturating_sub(until_ns);
        let message = if late_ns > 0 {
            let late = duration_text(late_ns);
            format!("nothing is done: the request came {late} after its client had stopped waiting")
        } else if has_left(&self.stream) {
            "nothing is done: its client has left without waiting for the answer".to_owned()
        } else {
            return Ok(until_ns);
        };
        Err(RequestRefusal::new(RefusalKind::TooLate, message))
    }

    /// A refused change is worth a warning; a refused look is a detail.
    fn tell_refusal(&self, request: &Request, refusal: &RequestRefusal) {
        let is_own = matches!(refusal.kind, RefusalKind::NotPermitted | RefusalKind::TooLate);
        if matches!(request, Request::Reload { .. } | Request::Rollback {}) && !is_own {
            // The code that refused it has logged the findings.
            return;
        }
        let (peer, why) = (&self.peer, short(&refusal.message));
        let what = short(&serde_json::to_string(request).unwrap_or_default());
        if request.only_looks() {
            say!(
                OPERATOR_READ_REFUSED,
                who = %peer,
                pid = peer.pid,
                what,
                "operator's request refused: {why}"
            );
        } else {
            tell_refused(peer, &what, &format!(": {why}"));
        }
    }

    async fn send(&mut self, reply: &Reply<()>) -> Result<(), SessionEnd> {
        self.send_line(&reply.line()).await
    }

    async fn send_line(&mut self, line: &[u8]) -> Result<(), SessionEnd> {
        // The request is done: a client that does not take the answer makes room like an idle one.
        self.seat.set_busy(false);
        let OperatorSession { stream, seat, .. } = self;
        tokio::select! {
            biased;
            taken = timeout(TAKE_MAX, stream.write_all(line)) => match taken {
                Err(_) => Err(SessionEnd::NotTaken),
                Ok(Err(_)) => Err(SessionEnd::ByClient),
                Ok(Ok(())) => Ok(()),
            },
            () = seat.asked_to_leave() => Err(SessionEnd::MadeRoom),
        }
    }
}

/// A client's text, or a message that repeats it, for the log: shortened, and on one line.
fn short(text: &str) -> String {
    let line = one_line(text);
    match line.char_indices().nth(LOGGED_CHARS_MAX) {
        Some((end, _)) => format!("{} …", &line[..end]),
        None => line,
    }
}

/// Informs a client that no seat is free, if this is possible without waiting.
pub(super) fn turn_away(stream: &UnixStream, seats: usize) {
    let message = format!("{seats} clients are being served already; try again");
    let refusal = RequestRefusal::new(RefusalKind::Refused, message);
    let _ = stream.try_write(&Reply::<()>::Error(refusal).line());
}
