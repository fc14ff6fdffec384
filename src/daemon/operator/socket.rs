//! The socket as a file: where it belongs, whose it is, and whether somebody answers there.
//!
//! It is made under another name with its group and permissions, and then put in its place, so
//! that it is never there with others. A lock beside it is held as long as the process lives: what
//! is found without it held is left over from a process that is gone.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io;
use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt, PermissionsExt, chown};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use super::super::directories;
use super::super::failure::Failure;
use super::peer::{gid_of, lock_file, set_queue};
use crate::controller::operator::{Operator, SOCKET_BYTES_MAX};
use crate::operator::SOCKET_VARIABLE;

/// So many may wait to be let in. Who comes then waits outside, and does not stand behind thousands
/// that have gone again.
const QUEUE_MAX: i32 = 64;

/// Where the socket is to be, and for whom.
#[derive(Clone, Debug)]
pub(in super::super) struct Place {
    pub path: PathBuf,
    pub mode: u32,
    pub group: Option<String>,
    /// The controller file asks for it: without it there is no start.
    pub insists: bool,
}

/// Another controller answers there.
#[derive(Debug)]
pub(in super::super) struct Taken(String);

/// A socket that is bound; its file goes with it.
pub(super) struct Bound {
    place: Place,
    /// Its file's number, by which it knows its own.
    inode: u64,
    /// Whose it is.
    pub uid: u32,
    pub gid: u32,
    lock: File,
}

impl Place {
    /// As the controller file says; else as [`SOCKET_VARIABLE`] or systemd's runtime folder says.
    /// Without any of them, or where it is not wanted, there is none.
    pub fn of(asked: &Operator, controller: &str) -> Option<Place> {
        let named = || std::env::var_os(SOCKET_VARIABLE).filter(|value| !value.is_empty());
        let systemd = || Some(directories::runtime()?.join("rungd.sock"));
        let path = match &asked.socket {
            Some(path) => {
                let beside = Path::new(controller).parent().unwrap_or(Path::new(""));
                Some(beside.join(path))
            }
            None => named().map(PathBuf::from).or_else(systemd),
        };
        let (mode, group, insists) = (asked.mode, asked.group.clone(), asked.socket.is_some());
        path.filter(|_| asked.enabled).map(|path| Place { path, mode, group, insists })
    }

    fn failure(&self, why: &dyn std::fmt::Display) -> Failure {
        let path = self.path.display();
        // Where the controller file does not say where, nobody should look for it there.
        let asked = if self.insists { "`[operator] socket`" } else { "the operator's socket" };
        Failure::Environment(anyhow::anyhow!("{asked} cannot be {path}: {why}"))
    }
}

/// Binds it.
pub(super) fn bind(place: &Place) -> Result<(UnixListener, Bound), Failure> {
    // First of all: beside what is no socket no lock belongs either.
    is_socket_or_nothing(place)?;
    let lock = lock(place)?;
    clear(place)?;
    let (listener, meta) = make(place)?;
    let (uid, gid, inode) = (meta.uid(), meta.gid(), meta.ino());
    Ok((listener, Bound { place: place.clone(), inode, uid, gid, lock }))
}

/// Makes the socket and puts it in its place. Who has the lock does.
fn make(place: &Place) -> Result<(UnixListener, fs::Metadata), Failure> {
    let path = &place.path;
    let gid = place.group.as_deref().map(group_number).transpose()?;
    // Behind the lock this name is nobody else's.
    let fresh = beside(path, ".new");
    if path.as_os_str().len() > SOCKET_BYTES_MAX {
        return Err(place.failure(&"its path is too long for a socket"));
    }
    let _ = fs::remove_file(&fresh);
    let listener = UnixListener::bind(&fresh).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => place.failure(&format!(
            "{error}: its folder must be there (under systemd `RuntimeDirectory=rungd` makes it)"
        )),
        _ => place.failure(&error),
    })?;
    let put = || -> io::Result<fs::Metadata> {
        set_queue(&listener, QUEUE_MAX)?;
        if gid.is_some() {
            chown(&fresh, None, gid)?;
        }
        fs::set_permissions(&fresh, Permissions::from_mode(place.mode))?;
        fs::rename(&fresh, path)?;
        listener.set_nonblocking(true)?;
        fs::symlink_metadata(path)
    };
    let meta = put().map_err(|error| {
        let _ = fs::remove_file(&fresh);
        match (&place.group, error.kind()) {
            (Some(group), io::ErrorKind::PermissionDenied) => place.failure(&format!(
                "{error}; to give it to `{group}`, the user rungd runs as must be in that group"
            )),
            _ => place.failure(&error),
        }
    })?;
    Ok((listener, meta))
}

impl Bound {
    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.place.path
    }

    /// Who may open it.
    pub fn mode(&self) -> u32 {
        self.place.mode
    }

    /// Why nobody finds it any more, if it is so.
    pub fn lost(&self) -> Option<String> {
        match fs::symlink_metadata(self.path()) {
            Ok(meta) if meta.ino() == self.inode => None,
            Ok(_) => Some("something else is in its place".to_owned()),
            Err(error) => Some(error.to_string()),
        }
    }

    /// Makes it again, as it was made at the start.
    ///
    /// # Errors
    /// The same.
    pub fn again(&mut self) -> Result<UnixListener, Failure> {
        is_socket_or_nothing(&self.place)?;
        let own = self.lock.metadata().map(|meta| meta.ino()).ok();
        // Who took the socket away may have taken the lock's file, too.
        if fs::metadata(beside(self.path(), ".lock")).map(|meta| meta.ino()).ok() != own {
            self.lock = lock(&self.place)?;
        }
        clear(&self.place)?;
        let (listener, meta) = make(&self.place)?;
        (self.uid, self.gid, self.inode) = (meta.uid(), meta.gid(), meta.ino());
        Ok(listener)
    }
}

/// The path with more at its end.
fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

/// The lock beside the socket.
fn lock(place: &Place) -> Result<File, Failure> {
    let path = beside(&place.path, ".lock");
    let mut options = OpenOptions::new();
    let options = options.create(true).truncate(false).write(true).mode(0o600);
    let file = options.open(&path).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => place.failure(&format!(
            "{error}: its folder must be there (under systemd `RuntimeDirectory=rungd` makes it)"
        )),
        _ => place.failure(&format!("{}: {error}", path.display())),
    })?;
    match lock_file(&file) {
        Ok(true) => Ok(file),
        Ok(false) => Err(taken(&place.path)),
        Err(error) => Err(place.failure(&format!("{}: {error}", path.display()))),
    }
}

fn taken(path: &Path) -> Failure {
    let path = path.display();
    Failure::Environment(anyhow::Error::new(Taken(format!(
        "the operator's socket cannot be {path}: another rungd answers there; stop it (`rungd \
         status --socket {path}` shows it), or give this one another"
    ))))
}

impl std::fmt::Display for Taken {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Taken {}

fn is_socket_or_nothing(place: &Place) -> Result<(), Failure> {
    match fs::symlink_metadata(&place.path) {
        Ok(meta) if !meta.file_type().is_socket() => {
            Err(place.failure(&"something else is there, which is no socket"))
        }
        _ => Ok(()),
    }
}

/// What lies there must be a socket that nobody answers at.
fn clear(place: &Place) -> Result<(), Failure> {
    is_socket_or_nothing(place)?;
    if !place.path.exists() {
        return Ok(());
    }
    match UnixStream::connect(&place.path) {
        Ok(_) => Err(taken(&place.path)),
        // It is replaced in one step when the new one is ready.
        Err(_) => Ok(()),
    }
}

fn group_number(group: &str) -> Result<u32, Failure> {
    let known = fs::read_to_string("/etc/group").unwrap_or_default();
    gid_of(&known, group).or_else(|| group.parse().ok()).filter(|gid| *gid != u32::MAX).ok_or_else(
        || {
            Failure::Configuration(format!(
                "`[operator] group`: this machine has no group `{group}` in /etc/group; make it \
             (`groupadd {group}`), or write another's name or number"
            ))
        },
    )
}

impl Drop for Bound {
    fn drop(&mut self) {
        if self.lost().is_none() {
            let _ = fs::remove_file(self.path());
        }
    }
}
