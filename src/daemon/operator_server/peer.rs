//! The user at the other end of a connection, as reported by the kernel, not by the client.
//!
//! Every user that can open the socket may look. Root, the user that rungd runs as, and members of
//! the socket's group may also make changes, unless it is the view socket. Used by
//! `server` for each client that it lets in.
#![allow(unsafe_code)]

use std::fmt;
use std::io;
use std::os::fd::AsRawFd;

use tokio::net::UnixStream;

use super::accounts::name_of;
use super::socket::SocketOwner;
use rungd_client::operator::protocol::{RefusalKind, RequestRefusal};
use rungd_client::operator::socket_place::SocketPurpose;
use rungd_language::source::wording::is_unseen;

/// The most groups that are read. If a user has more, only its first group counts.
const GROUPS_MAX: usize = 1024;

/// The longest name of a person on whose behalf a client acts.
const PERSON_BYTES_MAX: usize = 64;

/// A client.
#[derive(Clone, Debug)]
pub(super) struct OperatorPeer {
    pub uid: u32,
    pub pid: i32,
    /// The user's name if `/etc/passwd` has one, else the number.
    pub name: String,
    /// The socket to which it connected.
    pub door: SocketPurpose,
    /// Whether it may see the ladder's files: root, rungd's own user, and members of the groups of
    /// this socket and of the operator's.
    pub may_see_files: bool,
    pub may_change: bool,
}

/// The socket to which a client connects.
#[derive(Clone, Copy, Debug)]
pub(super) struct PeerSocket {
    pub door: SocketPurpose,
    /// The owner of this socket.
    pub own: SocketOwner,
    /// The owner of the operator's socket.
    pub operator: SocketOwner,
}

impl OperatorPeer {
    /// The user that connected to a socket.
    pub fn of(
        stream: &UnixStream,
        PeerSocket { door, own, operator }: &PeerSocket,
    ) -> io::Result<OperatorPeer> {
        let cred = stream.peer_cred()?;
        let (uid, gid) = (cred.uid(), cred.gid());
        let is_in = |group: &u32| *group == own.gid || *group == operator.gid;
        let may_see_files =
            uid == 0 || uid == own.uid || is_in(&gid) || groups(stream)?.iter().any(is_in);
        let may_change = *door == SocketPurpose::Operator && may_see_files;
        let name = name_of(&std::fs::read_to_string("/etc/passwd").unwrap_or_default(), uid);
        let name = name.unwrap_or_else(|| uid.to_string());
        Ok(OperatorPeer {
            uid,
            pid: cred.pid().unwrap_or(0),
            name,
            door: *door,
            may_see_files,
            may_change,
        })
    }
}

/// A client with one of its requests.
#[derive(Clone, Debug)]
pub(super) struct PeerRequest {
    pub peer: OperatorPeer,
    /// After this moment the request is not carried out; ns of the clock of deadlines.
    pub until_ns: u64,
}

impl PeerRequest {
    /// The same request on behalf of one of the client's own users: the log shows both names.
    ///
    /// # Errors
    /// The person's name is not valid.
    pub fn acting_for(&self, person: Option<&str>) -> Result<PeerRequest, RequestRefusal> {
        Ok(PeerRequest { peer: self.peer.acting_for(person)?, until_ns: self.until_ns })
    }
}

impl OperatorPeer {
    /// The same client on behalf of one of its own users: the log shows both names.
    ///
    /// # Errors
    /// The person's name is not valid.
    fn acting_for(&self, person: Option<&str>) -> Result<OperatorPeer, RequestRefusal> {
        let Some(person) = person else { return Ok(self.clone()) };
        let is_odd = |c: char| c.is_whitespace() || is_unseen(c);
        if person.is_empty() || person.len() > PERSON_BYTES_MAX || person.contains(is_odd) {
            let message = format!(
                "`for_user` is a name without spaces and invisible characters, of at most \
                     {PERSON_BYTES_MAX} bytes"
            );
            return Err(RequestRefusal::new(RefusalKind::BadRequest, message));
        }
        Ok(OperatorPeer { name: format!("{person} by {}", self.name), ..self.clone() })
    }
}

impl fmt::Display for OperatorPeer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (uid {})", self.name, self.uid)
    }
}

/// The peer's supplementary groups, at the time it connected.
fn groups(stream: &UnixStream) -> io::Result<Vec<u32>> {
    let mut groups = vec![0_u32; GROUPS_MAX];
    let mut bytes = (GROUPS_MAX * size_of::<u32>()) as libc::socklen_t;
    // SAFETY: `groups` has room for `bytes` bytes, both outlive the call, and any bits are a u32.
    let result = unsafe {
        let (level, option) = (libc::SOL_SOCKET, libc::SO_PEERGROUPS);
        let at = groups.as_mut_ptr().cast();
        libc::getsockopt(stream.as_raw_fd(), level, option, at, &mut bytes)
    };
    if result != 0 {
        return match io::Error::last_os_error() {
            // Too many groups, or the kernel does not report them: only the first group counts.
            error if matches!(error.raw_os_error(), Some(libc::ERANGE | libc::ENOPROTOOPT)) => {
                Ok(Vec::new())
            }
            error => Err(error),
        };
    }
    groups.truncate(bytes as usize / size_of::<u32>());
    Ok(groups)
}
