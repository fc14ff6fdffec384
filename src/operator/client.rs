//! The client: each request and its answer use one connection. Blocking, with time limits.
//!
//! Used by every command of `cli` that asks a running controller.

use std::fmt;
use std::fs;
use std::io::{self, Read, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;

use super::protocol::{Refusal, Reply, Request};
use super::{SOCKET_DEFAULT, SOCKET_NAME};

/// The time limit of an answer. The server may wait for the controller's next scan, and reports
/// by itself if none comes.
const ANSWER_MAX: Duration = Duration::from_secs(150);
/// The time limit for sending a request.
const SEND_MAX: Duration = Duration::from_secs(5);
/// The longest answer.
const ANSWER_BYTES_MAX: usize = 64 << 20;

/// The reason why there is no answer.
#[derive(Debug)]
pub enum Failure {
    /// No process listens at the socket.
    NotRunning(PathBuf, io::Error),
    /// The socket may not be opened.
    NotAllowed(PathBuf, io::Error),
    /// The connection broke, or the received bytes are not an answer.
    Broken(PathBuf, io::Error),
    /// The controller refuses.
    Refused(Refusal),
}

/// The controller's socket: `named`, if given; else `rungd.sock` in the current folder, if it
/// belongs to the user or to root; else the service's.
pub(crate) fn socket(named: Option<PathBuf>) -> PathBuf {
    let here = || is_trusted(Path::new(SOCKET_NAME)).then(|| SOCKET_NAME.into());
    named.or_else(here).unwrap_or_else(|| SOCKET_DEFAULT.into())
}

/// Whether a socket belongs to the user or to root. In a folder that everybody may write to, a
/// different user could make a socket and receive the commands.
fn is_trusted(path: &Path) -> bool {
    let own = fs::metadata("/proc/self").map(|process| process.uid());
    fs::symlink_metadata(path).is_ok_and(|socket| {
        let owner = socket.uid();
        socket.file_type().is_socket() && (owner == 0 || own.is_ok_and(|own| own == owner))
    })
}

/// Asks the controller at a socket.
///
/// # Errors
/// [`Failure`].
pub fn ask<T: DeserializeOwned>(socket: &Path, request: &Request) -> Result<T, Failure> {
    let stream = UnixStream::connect(socket).map_err(|error| match error.kind() {
        io::ErrorKind::PermissionDenied => Failure::NotAllowed(socket.into(), error),
        _ => Failure::NotRunning(socket.into(), error),
    })?;
    let line = exchange(stream, request).map_err(|error| Failure::Broken(socket.into(), error))?;
    match serde_json::from_slice(&line) {
        Ok(Reply::Ok(answer)) => Ok(answer),
        Ok(Reply::Error(refusal)) => Err(Failure::Refused(refusal)),
        Err(error) => Err(Failure::Broken(socket.into(), error.into())),
    }
}

fn exchange(mut stream: UnixStream, request: &Request) -> io::Result<Vec<u8>> {
    stream.set_write_timeout(Some(SEND_MAX))?;
    let mut line = serde_json::to_vec(request)?;
    line.push(b'\n');
    // A rejected client gets the reason even if its request was not received.
    let sent = stream.write_all(&line);
    let answer = read_line(&mut stream);
    if answer.as_ref().is_ok_and(|line| !line.is_empty()) { answer } else { sent.and(answer) }
}

fn read_line(stream: &mut UnixStream) -> io::Result<Vec<u8>> {
    let deadline = Instant::now() + ANSWER_MAX;
    let (mut line, mut part) = (Vec::new(), [0; 16 * 1024]);
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        stream.set_read_timeout(Some(left.max(Duration::from_millis(1))))?;
        let count = match stream.read(&mut part) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "no answer came in time"));
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

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::NotRunning(path, error) => write!(
                f,
                "no rungd answers at {}: {error}; is it running? (`[operator] socket` of its \
                 controller file says where its socket is: stand in that folder, or name the \
                 socket by `--socket` or RUNGD_SOCKET. A controller started by hand without that \
                 key has no socket: write the key, or set RUNGD_SOCKET for both)",
                path.display()
            ),
            Failure::NotAllowed(path, error) => write!(
                f,
                "{}: {error}; only members of the socket's group, its owner and root may open it: \
                 `ls -l {0}` shows whose it is",
                path.display()
            ),
            Failure::Broken(path, error) => write!(f, "rungd at {}: {error}", path.display()),
            Failure::Refused(refusal) => f.write_str(&refusal.message),
        }
    }
}

impl std::error::Error for Failure {}
