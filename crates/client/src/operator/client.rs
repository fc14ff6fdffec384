//! The client: each request and its answer use one connection. Blocking, with time limits.
//!
//! Used by every command of `cli` that sends a request to a running controller.

use std::fmt;
use std::fs;
use std::io::{self, Read, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;

use rustix::io::Errno;
use rustix::net::sockopt::socket_peercred;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};
use rustix::process::geteuid;

use super::deadline::Deadline;
use super::deadline::SLACK_MAX;
use super::protocol::{
    AwaitedPart, DEADLINE, RECORDING_BYTES_MAX, RefusalKind, Reply, Request, RequestRefusal,
    SentRequest,
};
use super::search_failure::SearchFailure;
use super::view_socket_beside;

/// The time limit for an answer that the controller makes at once.
const ANSWER_MAX: Duration = Duration::from_secs(10);
/// The time limit for an answer that waits for a scan, a disk or files. If these do not come, the
/// server itself reports it.
const CHANGE_MAX: Duration = Duration::from_secs(150);
/// The time limit for a list of names: a person has pressed a key and waits for the completion.
const NAMES_MAX: Duration = Duration::from_secs(3);
/// The time after which a person is informed of the reason for the wait.
const TELL_AFTER: Duration = Duration::from_secs(2);
/// The time limit for a connection, and for sending a request.
const SEND_MAX: Duration = Duration::from_secs(5);
/// The time between two attempts to connect while the queue is full.
const CONNECT_EVERY: Duration = Duration::from_micros(200);
/// The longest answer.
const ANSWER_BYTES_MAX: usize = 64 << 20;
const _: () = assert!(RECORDING_BYTES_MAX.div_ceil(3) * 4 + 100 < ANSWER_BYTES_MAX);

/// The reason why there is no answer.
#[derive(Debug)]
pub enum CallFailure {
    /// No socket is named, and the search for a controller chose none.
    NotFound(SearchFailure),
    /// No process listens at the socket.
    NotRunning(PathBuf, io::Error),
    /// The user is not permitted to open the socket.
    NotAllowed(PathBuf, io::Error),
    /// The connection broke, or the received bytes are not an answer.
    Broken(PathBuf, io::Error),
    /// The controller refuses.
    Refused(RequestRefusal),
}

/// Sends a request to the controller at a socket, and returns the answer.
///
/// # Errors
/// [`CallFailure`].
pub fn ask<T: DeserializeOwned>(socket: &Path, request: &Request) -> Result<T, CallFailure> {
    ask_and_tell(socket, request, &|_| ())
}

/// Like [`ask`]; if it has to wait for long, calls `tell` with the reason.
///
/// # Errors
/// [`CallFailure`].
pub fn ask_and_tell<T: DeserializeOwned>(
    socket: &Path,
    request: &Request,
    tell: &dyn Fn(&str),
) -> Result<T, CallFailure> {
    let limit = limit_of(request);
    exchanged(socket, request, limit, tell)
}

/// Like [`ask`], with the caller's time limit.
///
/// # Errors
/// [`CallFailure`].
pub fn ask_within<T: DeserializeOwned>(
    socket: &Path,
    request: &Request,
    limit: Duration,
) -> Result<T, CallFailure> {
    exchanged(socket, request, limit, &|_| ())
}

/// Like [`ask`], with the deadline of a client of this client.
///
/// # Errors
/// [`CallFailure`].
pub fn ask_by<T: DeserializeOwned>(
    socket: &Path,
    request: &Request,
    by: Option<&Deadline>,
) -> Result<T, CallFailure> {
    let Some(by) = by else { return ask(socket, request) };
    let limit = limit_of(request).min(by.left().unwrap_or_default() + SLACK_MAX);
    exchanged_by(socket, PendingRequest::begin(request, Some(by.clone()), limit, &|_| ()))
}

/// The process that listens at a socket; `None` if the system does not report it.
///
/// # Errors
/// [`CallFailure`].
pub fn listener(socket: &Path) -> Result<Option<i32>, CallFailure> {
    Ok(PeerProcess::of(&opened(socket)?).0)
}

/// Opens a connection for a request. One that only looks goes through the view socket, if there is
/// one beside the operator's socket and the user may open it: so a process needs no right to make
/// changes if it makes none.
fn opened_for(request: &Request, operator: &Path) -> Result<UnixStream, CallFailure> {
    let view = Some(view_socket_beside(operator));
    let view = view.filter(|view| request.only_looks() && is_view_of(view, operator));
    let Some(view) = view else { return opened(operator) };
    match opened(&view) {
        Err(unseen @ (CallFailure::NotRunning(..) | CallFailure::NotAllowed(..))) => {
            match opened(operator) {
                // The view socket's failure is the one that concerns this user.
                Err(CallFailure::NotAllowed(..)) => Err(unseen),
                other => other,
            }
        }
        other => other,
    }
}

/// Whether a socket belongs to the owner of the operator's socket, to the user or to root. In a
/// folder that everybody may write to, a different user could make it, and answer.
fn is_view_of(view: &Path, operator: &Path) -> bool {
    let operator = fs::symlink_metadata(operator).map(|socket| socket.uid());
    fs::symlink_metadata(view).is_ok_and(|view| {
        let owner = view.uid();
        view.file_type().is_socket()
            && (owner == 0
                || owner == geteuid().as_raw()
                || operator.is_ok_and(|operator| operator == owner))
    })
}

fn opened(socket: &Path) -> Result<UnixStream, CallFailure> {
    connected(socket).map_err(|error| {
        let failure = if error.kind() == io::ErrorKind::PermissionDenied {
            CallFailure::NotAllowed
        } else if error.kind() == io::ErrorKind::TimedOut {
            CallFailure::Broken
        } else {
            CallFailure::NotRunning
        };
        failure(socket.into(), error)
    })
}

fn exchanged<T: DeserializeOwned>(
    socket: &Path,
    request: &Request,
    limit: Duration,
    tell: &dyn Fn(&str),
) -> Result<T, CallFailure> {
    // Before the connection: the client's wait has begun.
    let deadline = Deadline::of_wait(limit).filter(|_| !request.only_looks());
    exchanged_by(socket, PendingRequest::begin(request, deadline, limit, tell))
}

fn exchanged_by<T: DeserializeOwned>(
    socket: &Path,
    wait: PendingRequest,
) -> Result<T, CallFailure> {
    match wait.answered(socket) {
        Err(CallFailure::Refused(refusal)) if is_of_earlier(&refusal) => {
            PendingRequest { deadline: None, ..wait }.answered(socket)
        }
        other => other,
    }
}

/// Whether a rungd refuses a deadline because it is of an earlier version, which an upgrade has not
/// ended.
fn is_of_earlier(refusal: &RequestRefusal) -> bool {
    refusal.kind == RefusalKind::BadRequest && refusal.message.contains(&format!("`{DEADLINE}`"))
}

/// Connects, within a time limit: a process that hangs accepts no client once its queue is full.
///
/// The client tries again instead of waiting in `connect`: a client that waits there comes after
/// every client that tries again, and a crowd of those could keep it out for ever.
fn connected(socket: &Path) -> io::Result<UnixStream> {
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let stream = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
    let (place, began) = (SocketAddrUnix::new(socket)?, Instant::now());
    while let Err(error) = connect(&stream, &place) {
        if error != Errno::AGAIN {
            return Err(error.into());
        }
        if began.elapsed() > SEND_MAX {
            let limit = SEND_MAX.as_secs();
            let why = format!(
                "no client was accepted for {limit} s: it hangs, or too many clients ask it"
            );
            return Err(io::Error::new(io::ErrorKind::TimedOut, why));
        }
        sleep(CONNECT_EVERY);
    }
    let stream = UnixStream::from(stream);
    stream.set_nonblocking(false)?;
    Ok(stream)
}

fn limit_of(request: &Request) -> Duration {
    match request.awaits() {
        AwaitedPart::Nothing if matches!(request, Request::Names { .. }) => NAMES_MAX,
        AwaitedPart::Nothing => ANSWER_MAX,
        AwaitedPart::ScanThread | AwaitedPart::Files | AwaitedPart::Image => CHANGE_MAX,
    }
}

/// A request that waits for its answer.
struct PendingRequest<'a> {
    request: &'a Request,
    /// The moment after which the controller must not begin the request.
    deadline: Option<Deadline>,
    limit: Duration,
    began: Instant,
    tell: &'a dyn Fn(&str),
}

impl<'a> PendingRequest<'a> {
    /// A request whose wait begins now. `tell`: gets the reason of a long wait.
    fn begin(
        request: &'a Request,
        deadline: Option<Deadline>,
        limit: Duration,
        tell: &'a dyn Fn(&str),
    ) -> PendingRequest<'a> {
        PendingRequest { request, deadline, limit, began: Instant::now(), tell }
    }
}

impl PendingRequest<'_> {
    fn answered<T: DeserializeOwned>(&self, socket: &Path) -> Result<T, CallFailure> {
        let broken = |error| CallFailure::Broken(socket.into(), error);
        let stream = opened_for(self.request, socket)?;
        let line = self.exchange(stream).map_err(broken)?;
        match serde_json::from_slice(&line) {
            Ok(Reply::Ok(answer)) => Ok(answer),
            Ok(Reply::Error(refusal)) => Err(CallFailure::Refused(refusal)),
            Err(error) => Err(broken(error.into())),
        }
    }

    fn exchange(&self, mut stream: UnixStream) -> io::Result<Vec<u8>> {
        stream.set_write_timeout(Some(SEND_MAX))?;
        let sent = SentRequest { request: self.request, deadline: self.deadline.clone() };
        let mut line = serde_json::to_vec(&sent)?;
        line.push(b'\n');
        // A rejected client receives the reason even if its request was not received.
        let sent = stream.write_all(&line);
        let answer = self.read_line(&mut stream);
        if answer.as_ref().is_ok_and(|line| !line.is_empty()) { answer } else { sent.and(answer) }
    }

    fn read_line(&self, stream: &mut UnixStream) -> io::Result<Vec<u8>> {
        let (mut line, mut part) = (Vec::new(), [0; 16 * 1024]);
        let mut told = false;
        loop {
            let until = if told { self.limit } else { TELL_AFTER.min(self.limit) };
            let left = until.saturating_sub(self.began.elapsed());
            stream.set_read_timeout(Some(left.max(Duration::from_millis(1))))?;
            let count = match stream.read(&mut part) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    let process = PeerProcess::of(stream);
                    if told || until == self.limit {
                        return Err(io::Error::new(
                            io::ErrorKind::TimedOut,
                            self.no_answer(process),
                        ));
                    }
                    (self.tell)(&self.waiting(process));
                    told = true;
                    continue;
                }
                other => other?,
            };
            if count == 0 {
                let ended = "the connection ended before the answer";
                return Err(io::Error::new(io::ErrorKind::UnexpectedEof, ended));
            }
            if let Some(end) = part[..count].iter().position(|byte| *byte == b'\n') {
                line.extend_from_slice(&part[..end]);
                return Ok(line);
            }
            line.extend_from_slice(&part[..count]);
            if line.len() > ANSWER_BYTES_MAX {
                return Err(io::Error::new(io::ErrorKind::InvalidData, "an answer without an end"));
            }
        }
    }

    /// A sentence about the reason for the wait, and the remedy.
    fn waiting(&self, process: PeerProcess) -> String {
        let awaited = match self.request.awaits() {
            AwaitedPart::Nothing => "",
            AwaitedPart::ScanThread => "; it is answered when the scan thread has done it",
            AwaitedPart::Files => "; it is answered when the files are checked",
            AwaitedPart::Image => {
                "; it is answered when the image of retentive memory is durable (`mode stop \
                 --no-wait` does not wait for it)"
            }
        };
        let (told, limit) = (TELL_AFTER.as_secs(), self.limit.as_secs());
        let hint = process.hint();
        format!("{process} has not answered for {told} s{awaited}; waiting up to {limit} s{hint}")
    }

    fn no_answer(&self, process: PeerProcess) -> String {
        let limit = self.limit.as_secs();
        let yet = match &self.deadline {
            _ if self.request.only_looks() => "",
            Some(_) => "; what it has not begun by now, it does not do later",
            None => "; the command may still be done",
        };
        format!("{process} gave no answer in {limit} s: it hangs{yet}{}", process.hint())
    }
}

/// The process at the other end.
#[derive(Clone, Copy)]
struct PeerProcess(Option<i32>);

impl PeerProcess {
    fn of(stream: &UnixStream) -> PeerProcess {
        PeerProcess(socket_peercred(stream).ok().map(|peer| peer.pid.as_raw_nonzero().get()))
    }

    /// A hint how to find out why the process does not answer.
    fn hint(self) -> String {
        let Some(pid) = self.0 else { return String::new() };
        let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
        match status.lines().any(|line| line.starts_with("State:\tT")) {
            true => {
                format!(" (process {pid} is stopped by a signal: `kill -CONT {pid}` continues it)")
            }
            false => format!(" (`ps -o pid,stat,wchan,args -p {pid}` shows its state)"),
        }
    }
}

impl fmt::Display for PeerProcess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(pid) => write!(f, "process {pid}"),
            None => f.write_str("the process"),
        }
    }
}

impl fmt::Display for CallFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CallFailure::NotFound(failure) => failure.fmt(f),
            CallFailure::NotRunning(path, error) => write!(
                f,
                "no rungd answers at {}: {error}; is it running? (`[operator] socket` of its \
                 controller file says where its socket is: change to that folder, or name the \
                 socket by `--socket` or RUNGD_SOCKET. A controller started by hand without that \
                 key has no socket: write the key, or set RUNGD_SOCKET for both)",
                path.display()
            ),
            CallFailure::NotAllowed(path, error) => write!(
                f,
                "{}: {error}; only members of the socket's group, its owner and root may open it: \
                 `ls -l {0}` shows whose it is",
                path.display()
            ),
            CallFailure::Broken(path, error) => write!(f, "rungd at {}: {error}", path.display()),
            CallFailure::Refused(refusal) => f.write_str(&refusal.message),
        }
    }
}

impl CallFailure {
    /// The failure in one line, for a log.
    pub fn in_one_line(&self) -> String {
        self.to_string().replace("\n  ", "; ")
    }
}

impl std::error::Error for CallFailure {}
