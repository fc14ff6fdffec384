//! The operator's socket and the view socket as files: owner, lock, and whether a controller
//! answers there. `operator::socket_place` says where they are.
//!
//! The socket is made under a temporary name with its group and permissions, and then renamed to
//! its place, so it never has other permissions there. As long as the process lives, it holds a
//! lock beside the socket: a socket with a free lock is left over from a process that has ended.
//! Called by `server`.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io;
use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt, PermissionsExt, chown};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use rustix::fs::{FlockOperation, OFlags, flock};
use rustix::io::Errno;
use rustix::net::listen;

use crate::daemon::failure::StartFailure;
use rungd_client::operator::running::RunningEntry;
use rungd_client::operator::socket_place::{InsteadOf, SocketPurpose, SocketSpec, known_group};
use rungd_config::controller::operator::SOCKET_BYTES_MAX;

/// The most clients that wait to be let in. A further client waits in `connect`, instead of behind
/// thousands of clients that have left.
const QUEUE_MAX: i32 = 64;

/// A different controller answers at this place.
#[derive(Debug)]
pub(in super::super) struct SocketTaken(String);

/// The place of a socket, held by its lock: no other controller can take it.
///
/// A start claims it before it touches anything else, so that a refused start leaves nothing.
pub(in super::super) struct SocketClaim {
    spec: SocketSpec,
    lock: Option<File>,
}

/// A bound socket; dropping it removes the file.
pub(super) struct BoundSocket {
    spec: SocketSpec,
    /// The number of the socket's file, by which the file is recognised as its own.
    inode: u64,
    pub owner: SocketOwner,
    lock: Option<File>,
    /// The entry of the operator's socket in the list of running controllers.
    listed: Option<RunningEntry>,
}

/// The user and the group that a socket belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SocketOwner {
    pub uid: u32,
    pub gid: u32,
}

impl SocketOwner {
    fn of(socket: &fs::Metadata) -> SocketOwner {
        SocketOwner { uid: socket.uid(), gid: socket.gid() }
    }
}

fn failure(spec: &SocketSpec, why: &dyn std::fmt::Display) -> StartFailure {
    let path = spec.path.display();
    // The message names the controller file's key only if that key requested the socket.
    let asked = match spec.insists {
        true => format!("`{}`", spec.door.keys()[0]),
        false => spec.door.name().to_owned(),
    };
    StartFailure::Environment(anyhow::anyhow!("{asked} cannot be {path}: {why}"))
}

/// The failure if a file cannot be made; if its folder is missing, with a remedy instead of
/// `why`.
fn not_made(spec: &SocketSpec, why: &str, error: &io::Error) -> StartFailure {
    if error.kind() != io::ErrorKind::NotFound {
        return failure(spec, &why);
    }
    failure(
        spec,
        &format!(
            "{error}: its folder must be there (under systemd `RuntimeDirectory=rungd` makes it)"
        ),
    )
}

impl SocketClaim {
    /// Claims a place.
    ///
    /// # Errors
    /// A controller answers there, or the system refuses.
    pub fn new(spec: &SocketSpec) -> Result<SocketClaim, StartFailure> {
        // These checks come first: a lock belongs only beside a socket.
        if spec.path.as_os_str().len() > SOCKET_BYTES_MAX {
            let why = format!(
                "its path has more than {SOCKET_BYTES_MAX} bytes, which is too long for a socket; \
                 start rungd in a folder nearer to it, or name a different path"
            );
            return Err(failure(spec, &why));
        }
        is_socket_or_nothing(spec)?;
        let lock = spec.needs_lock().then(|| lock(spec)).transpose()?;
        clear(spec)?;
        Ok(SocketClaim { spec: spec.clone(), lock })
    }

    /// Makes the socket at its place.
    pub(super) fn bind(self) -> Result<(UnixListener, BoundSocket), StartFailure> {
        let (listener, meta) = make(&self.spec)?;
        let (owner, inode) = (SocketOwner::of(&meta), meta.ino());
        let listed = match self.spec.door {
            SocketPurpose::Operator => RunningEntry::new(&self.spec.path, &self.spec.controller),
            SocketPurpose::View => None,
        };
        Ok((listener, BoundSocket { spec: self.spec, inode, owner, lock: self.lock, listed }))
    }

    pub(super) fn spec(&self) -> &SocketSpec {
        &self.spec
    }
}

/// Makes the socket and puts it in its place. Only the holder of the lock calls this.
fn make(spec: &SocketSpec) -> Result<(UnixListener, fs::Metadata), StartFailure> {
    let path = &spec.path;
    let gid = spec.group.as_deref().map(|group| group_number(spec.door, group)).transpose()?;
    // While the lock is held, no other process uses this name.
    let fresh = beside(path, ".new");
    let _ = fs::remove_file(&fresh);
    let listener =
        UnixListener::bind(&fresh).map_err(|error| not_made(spec, &error.to_string(), &error))?;
    let put = || -> io::Result<fs::Metadata> {
        listen(&listener, QUEUE_MAX)?;
        if gid.is_some() {
            chown(&fresh, None, gid)?;
        }
        fs::set_permissions(&fresh, Permissions::from_mode(spec.mode))?;
        fs::rename(&fresh, path)?;
        listener.set_nonblocking(true)?;
        fs::symlink_metadata(path)
    };
    let meta = put().map_err(|error| {
        let _ = fs::remove_file(&fresh);
        match (&spec.group, error.kind()) {
            (Some(group), io::ErrorKind::PermissionDenied) => failure(
                spec,
                &format!(
                    "{error}; to give it to `{group}`, the user rungd runs as must be in that group"
                ),
            ),
            _ => failure(spec, &error),
        }
    })?;
    Ok((listener, meta))
}

impl BoundSocket {
    /// The path of the socket.
    pub fn path(&self) -> &Path {
        &self.spec.path
    }

    /// What the socket is for.
    pub fn door(&self) -> SocketPurpose {
        self.spec.door
    }

    /// The permissions of the socket.
    pub fn mode(&self) -> u32 {
        self.spec.mode
    }

    /// The controller file's relative path, if the socket has a different place.
    pub fn instead_of(&self) -> Option<&InsteadOf> {
        self.spec.instead_of.as_ref()
    }

    /// Repairs the entry in the list of running controllers.
    pub fn keep_listed(&mut self) {
        self.listed.iter_mut().for_each(RunningEntry::keep);
    }

    /// If the socket is lost: the reason why clients cannot find it any more.
    pub fn lost(&self) -> Option<String> {
        match fs::symlink_metadata(self.path()) {
            Ok(meta) if meta.ino() == self.inode => None,
            Ok(_) => Some("something else is in its place".to_owned()),
            Err(error) => Some(error.to_string()),
        }
    }

    /// Makes the socket again, as at the start.
    ///
    /// # Errors
    /// Those of the start.
    pub fn again(&mut self) -> Result<UnixListener, StartFailure> {
        is_socket_or_nothing(&self.spec)?;
        let own = |lock: &File| lock.metadata().map(|meta| meta.ino()).ok();
        // The lock's file may have been removed together with the socket.
        if let Some(held) = &mut self.lock
            && fs::metadata(beside(&self.spec.path, ".lock")).map(|meta| meta.ino()).ok()
                != own(held)
        {
            *held = lock(&self.spec)?;
        }
        clear(&self.spec)?;
        let (listener, meta) = make(&self.spec)?;
        (self.owner, self.inode) = (SocketOwner::of(&meta), meta.ino());
        Ok(listener)
    }
}

/// The path with an ending appended.
fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

/// The lock beside the socket.
fn lock(spec: &SocketSpec) -> Result<File, StartFailure> {
    let path = beside(&spec.path, ".lock");
    let mut options = OpenOptions::new();
    let options = options.create(true).truncate(false).write(true).mode(0o600);
    // On a FIFO, `open` would wait for its reader.
    let options = options.custom_flags(OFlags::NONBLOCK.bits().cast_signed());
    let other = "is not a file, but the socket's lock must be there: remove it";
    if fs::metadata(&path).is_ok_and(|meta| !meta.is_file()) {
        return Err(failure(spec, &format!("{} {other}", path.display())));
    }
    let file = options.open(&path).map_err(|error| {
        let refused = [io::ErrorKind::PermissionDenied, io::ErrorKind::ReadOnlyFilesystem];
        let mut why = format!("{}: {error}", path.display());
        if refused.contains(&error.kind()) {
            why += "; name a path in a folder that rungd may write to, as \
                    `/run/rungd/rungd.sock`, or remove the key: systemd gives a service its place";
        }
        not_made(spec, &why, &error)
    })?;
    match flock(&file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => Ok(file),
        Err(Errno::WOULDBLOCK) => Err(taken(spec)),
        Err(error) => Err(failure(spec, &format!("{}: {error}", path.display()))),
    }
}

fn taken(spec: &SocketSpec) -> StartFailure {
    let (path, name) = (spec.path.display(), spec.door.name());
    StartFailure::Environment(anyhow::Error::new(SocketTaken(format!(
        "{name} cannot be {path}: another rungd answers there; stop it (`rungd \
         status --socket {path}` shows it), or give this one a socket of its own"
    ))))
}

impl std::fmt::Display for SocketTaken {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for SocketTaken {}

fn is_socket_or_nothing(spec: &SocketSpec) -> Result<(), StartFailure> {
    match fs::symlink_metadata(&spec.path) {
        Ok(meta) if !meta.file_type().is_socket() => {
            Err(failure(spec, &"something that is not a socket is there"))
        }
        _ => Ok(()),
    }
}

/// Refuses a socket where a controller answers.
fn clear(spec: &SocketSpec) -> Result<(), StartFailure> {
    is_socket_or_nothing(spec)?;
    if !spec.path.exists() {
        return Ok(());
    }
    match UnixStream::connect(&spec.path) {
        Ok(_) => Err(taken(spec)),
        // The file left over is replaced in one step when the new socket is ready.
        Err(_) => Ok(()),
    }
}

fn group_number(door: SocketPurpose, group: &str) -> Result<u32, StartFailure> {
    known_group(group).ok_or_else(|| {
        let key = door.keys()[1];
        StartFailure::Configuration(format!(
            "`{key}`: this machine has no group `{group}` in /etc/group; make it (`groupadd \
             {group}`), or write the name or number of a different group"
        ))
    })
}

impl Drop for BoundSocket {
    fn drop(&mut self) {
        if self.lost().is_none() {
            let _ = fs::remove_file(self.path());
        }
    }
}
