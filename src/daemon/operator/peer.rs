//! Who is at the other end: as the kernel says, not as a client says.
//!
//! Who can open the socket may read. Who may change things: root, the user rungd runs as, and
//! members of the socket's group. The system calls that std does not offer stand here too.
#![allow(unsafe_code)]

use std::fmt;
use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::net::UnixListener;

use tokio::net::UnixStream;

use super::socket::Bound;

/// The most groups that are asked for; who is in more has the first of them looked at.
const GROUPS_MAX: usize = 1024;

/// A client.
#[derive(Clone, Debug)]
pub(super) struct Peer {
    pub uid: u32,
    pub pid: i32,
    /// The user's name, where `/etc/passwd` has one; else the number.
    pub name: String,
    pub may_change: bool,
}

impl Peer {
    /// Who connected.
    pub fn of(stream: &UnixStream, socket: &Bound) -> io::Result<Peer> {
        let cred = stream.peer_cred()?;
        let (uid, gid) = (cred.uid(), cred.gid());
        let own = uid == 0 || uid == socket.uid;
        let may_change = own || gid == socket.gid || groups(stream)?.contains(&socket.gid);
        let name = name_of(&std::fs::read_to_string("/etc/passwd").unwrap_or_default(), uid);
        let name = name.unwrap_or_else(|| uid.to_string());
        Ok(Peer { uid, pid: cred.pid().unwrap_or(0), name, may_change })
    }
}

impl fmt::Display for Peer {
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
            // More than anybody has, or a kernel that does not tell: the first group counts.
            error if matches!(error.raw_os_error(), Some(libc::ERANGE | libc::ENOPROTOOPT)) => {
                Ok(Vec::new())
            }
            error => Err(error),
        };
    }
    groups.truncate(bytes as usize / size_of::<u32>());
    Ok(groups)
}

/// Takes the lock of a file for as long as it is open; false if another process has it.
pub(super) fn lock_file(file: &File) -> io::Result<bool> {
    // SAFETY: takes numbers alone, and the descriptor is open.
    if unsafe { libc::flock(file.as_raw_fd(), libc::LOCK_EX | libc::LOCK_NB) } == 0 {
        return Ok(true);
    }
    match io::Error::last_os_error() {
        error if error.kind() == io::ErrorKind::WouldBlock => Ok(false),
        error => Err(error),
    }
}

/// How many may wait at a listener to be accepted.
pub(super) fn set_queue(listener: &UnixListener, count_max: i32) -> io::Result<()> {
    // SAFETY: takes numbers alone, and the descriptor is open.
    match unsafe { libc::listen(listener.as_raw_fd(), count_max) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

/// The name of a user in the text of `/etc/passwd`.
fn name_of(passwd: &str, uid: u32) -> Option<String> {
    let user = passwd.lines().find(|line| line.split(':').nth(2) == Some(&uid.to_string()))?;
    let name = user.split(':').next()?;
    (!name.is_empty()).then(|| super::super::narration::one_line(name))
}

/// The number of a group in the text of `/etc/group`.
pub(super) fn gid_of(group: &str, name: &str) -> Option<u32> {
    let row = group.lines().find(|line| line.split(':').next() == Some(name))?;
    row.split(':').nth(2)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_numbers() {
        let passwd = "root:x:0:0:root:/root:/bin/sh\nanna:x:1000:1000::/home/anna:/bin/sh\n";
        assert_eq!(name_of(passwd, 1000).as_deref(), Some("anna"));
        assert_eq!((name_of(passwd, 7), name_of("", 0)), (None, None));
        let group = "root:x:0:\nplant:x:990:anna,ben\nbroken:x\n";
        assert_eq!((gid_of(group, "plant"), gid_of(group, "anna")), (Some(990), None));
        assert_eq!(gid_of(group, "broken"), None);
    }
}
