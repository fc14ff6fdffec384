//! The operator's socket and the view socket as files: place, owner, and whether a controller
//! answers there.
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

use rustix::fs::{Access, FlockOperation, OFlags, access, flock};
use rustix::io::Errno;
use rustix::net::listen;
use rustix::process::{Gid, getegid, geteuid, getgroups};

use super::accounts::gid_of;
use crate::controller;
use crate::controller::operator::{Operator, SOCKET_BYTES_MAX, ViewSocket};
use crate::daemon::failure::StartFailure;
use crate::directories;
use crate::load;
use crate::operator::running::{RunningEntry, users_folder};
use crate::operator::{VIEW_GROUP_VARIABLE, socket_of_environment, view_socket_beside};
use crate::source::finding::Severity;
use crate::source::span::FileId;

/// The most clients that wait to be let in. A further client waits in `connect`, instead of behind
/// thousands of clients that have left.
const QUEUE_MAX: i32 = 64;

/// What a socket is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Door {
    /// Looks and changes: the operator's socket.
    Operator,
    /// Looks alone: the view socket.
    View,
}

impl Door {
    /// Its name, for the log.
    pub(super) fn name(self) -> &'static str {
        match self {
            Door::Operator => "the operator's socket",
            Door::View => "the view socket",
        }
    }

    /// The keys of the controller file for its path and its group.
    pub(super) fn keys(self) -> [&'static str; 2] {
        match self {
            Door::Operator => ["[operator] socket", "[operator] group"],
            Door::View => ["[operator] view-socket", "[operator] view-group"],
        }
    }
}

/// The place of a socket, its group and permissions.
#[derive(Clone, Debug)]
pub(in super::super) struct SocketSpec {
    pub door: Door,
    pub path: PathBuf,
    pub mode: u32,
    pub group: Option<String>,
    /// The controller file requires the socket: without it the start fails.
    pub insists: bool,
    /// The controller file's relative path, if the socket has a different place.
    pub instead_of: Option<InsteadOf>,
    /// The controller file.
    pub controller: PathBuf,
}

/// The reason why the socket is not at the controller file's relative path.
#[derive(Clone, Debug)]
pub(in super::super) enum InsteadOf {
    /// A service uses its own place.
    Service(String),
    /// The user may not write beside the controller file.
    ReadOnly(String),
}

/// A different controller answers at this place.
#[derive(Debug)]
pub(in super::super) struct SocketTaken(String);

/// The place of a socket, held by its lock: no other controller can take it.
///
/// A start claims it before it touches anything else, so that a refused start leaves nothing.
pub(in super::super) struct Claim {
    spec: SocketSpec,
    lock: Option<File>,
}

/// A bound socket; dropping it removes the file.
pub(super) struct Bound {
    spec: SocketSpec,
    /// The number of the socket's file, by which the file is recognised as its own.
    inode: u64,
    pub owner: Owner,
    lock: Option<File>,
    /// The entry of the operator's socket in the list of running controllers.
    listed: Option<RunningEntry>,
}

/// The user and the group that a socket belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Owner {
    pub uid: u32,
    pub gid: u32,
}

impl Owner {
    fn of(socket: &fs::Metadata) -> Owner {
        Owner { uid: socket.uid(), gid: socket.gid() }
    }
}

/// The operator's socket that a controller file or systemd's environment names.
#[derive(Clone, Debug)]
pub struct SocketPlace {
    /// Its path; `None` if the file wants no socket, or nothing names one.
    pub path: Option<PathBuf>,
    /// False if the file cannot be read or has an error: an error may hide the key that names the
    /// path.
    pub is_certain: bool,
}

/// The operator's socket of a controller file. If the file cannot be read as a controller file,
/// this is the environment's socket: the file's controller may still be running.
pub fn operator_socket(controller: &Path) -> SocketPlace {
    let bytes = load::read_bytes(controller).ok();
    let text = bytes.and_then(|bytes| String::from_utf8(bytes).ok());
    let (written, mut findings) = controller::read(&text.unwrap_or_default(), FileId(0));
    let written = written.filter(|written| written.lost.is_none());
    let is_whole = written.is_some();
    let asked = written
        .and_then(|written| written.operator)
        .map(|written| controller::operator::resolve(&written, &mut findings))
        .unwrap_or_default();
    // An empty text has an error: it names no ladder.
    let is_certain = is_whole && findings.iter().all(|f| f.severity() != Severity::Error);
    let spec = SocketSpec::of(&asked, &controller.display().to_string());
    SocketPlace { path: spec.map(|spec| spec.path), is_certain }
}

impl SocketSpec {
    /// The place is that of the controller file, else that of the environment or of systemd's
    /// runtime folder. `None` if there is no place, or if the controller file wants no socket. A
    /// relative path applies only to a start by hand: a service, which has a runtime folder, may
    /// not write beside its file. A user who may not write there, as beside an example of a
    /// package, has the socket in the user's own folder.
    pub fn of(asked: &Operator, controller: &str) -> Option<SocketSpec> {
        let systemd = || Some(directories::runtime()?.join("rungd.sock"));
        let is_service = directories::runtime().is_some();
        let gives_way = |path: &&String| is_service && Path::new(path).is_relative();
        let mut instead_of =
            asked.socket.as_ref().filter(gives_way).cloned().map(InsteadOf::Service);
        let path = match &asked.socket {
            Some(path) if instead_of.is_none() => {
                let beside = Path::new(controller).parent().unwrap_or(Path::new("")).join(path);
                let elsewhere = users_place(path, &beside);
                instead_of = elsewhere.is_some().then(|| InsteadOf::ReadOnly(path.clone()));
                Some(elsewhere.unwrap_or(beside))
            }
            Some(_) | None => socket_of_environment().or_else(systemd),
        };
        let (mode, group, insists) = (asked.mode, asked.group.clone(), asked.socket.is_some());
        let path = path.filter(|_| asked.enabled)?;
        let door = Door::Operator;
        let controller = PathBuf::from(controller);
        Some(SocketSpec { door, path, mode, group, insists, instead_of, controller })
    }

    /// The view socket: at the place that the controller file names, by the rules of
    /// [`SocketSpec::of`], else beside the operator's socket, which is `self`.
    pub fn view(&self, asked: &Operator, controller: &str) -> SocketSpec {
        let is_service = directories::runtime().is_some();
        let ViewSocket { socket, mode, group } = &asked.view;
        let gives_way = |path: &&String| is_service && Path::new(path).is_relative();
        let instead_of = socket.as_ref().filter(gives_way).cloned().map(InsteadOf::Service);
        let path = match socket {
            Some(path) if instead_of.is_none() => {
                Path::new(controller).parent().unwrap_or(Path::new("")).join(path)
            }
            Some(_) | None => view_socket_beside(&self.path),
        };
        let group = group.clone().or_else(group_of_environment).or_else(|| asked.group.clone());
        let (mode, insists) = (mode.unwrap_or(asked.mode), socket.is_some());
        SocketSpec {
            door: Door::View,
            path,
            mode,
            group,
            insists,
            instead_of,
            controller: self.controller.clone(),
        }
    }

    /// Whether the place needs a lock of its own. A view socket that nothing names is beside the
    /// operator's socket, whose lock holds for both.
    fn needs_lock(&self) -> bool {
        match self.door {
            Door::Operator => true,
            Door::View => self.insists,
        }
    }

    fn failure(&self, why: &dyn std::fmt::Display) -> StartFailure {
        let path = self.path.display();
        // The message names the controller file's key only if that key requested the socket.
        let asked = match self.insists {
            true => format!("`{}`", self.door.keys()[0]),
            false => self.door.name().to_owned(),
        };
        StartFailure::Environment(anyhow::anyhow!("{asked} cannot be {path}: {why}"))
    }

    /// The failure if a file cannot be made; if its folder is missing, with a remedy instead of
    /// `why`.
    fn not_made(&self, why: &str, error: &io::Error) -> StartFailure {
        if error.kind() != io::ErrorKind::NotFound {
            return self.failure(&why);
        }
        self.failure(&format!(
            "{error}: its folder must be there (under systemd `RuntimeDirectory=rungd` makes it)"
        ))
    }
}

/// The place in the user's own folder of a socket whose relative path is in a folder that the user
/// may not write to; `None` if the user may.
fn users_place(path: &str, beside: &Path) -> Option<PathBuf> {
    let folder = beside.parent().filter(|folder| !folder.as_os_str().is_empty());
    match access(folder.unwrap_or(Path::new(".")), Access::WRITE_OK) {
        Err(Errno::ACCESS | Errno::ROFS) if Path::new(path).is_relative() => {
            let name = Path::new(path).file_stem()?.to_str()?;
            Some(users_folder().ok()?.join(format!("{name}.sock")))
        }
        Ok(()) | Err(_) => None,
    }
}

impl Claim {
    /// Claims a place.
    ///
    /// # Errors
    /// A controller answers there, or the system refuses.
    pub fn new(spec: &SocketSpec) -> Result<Claim, StartFailure> {
        // These checks come first: a lock belongs only beside a socket.
        if spec.path.as_os_str().len() > SOCKET_BYTES_MAX {
            return Err(spec.failure(&format!(
                "its path has more than {SOCKET_BYTES_MAX} bytes, which is too long for a socket; \
                 start rungd in a folder nearer to it, or name a different path"
            )));
        }
        is_socket_or_nothing(spec)?;
        let lock = spec.needs_lock().then(|| lock(spec)).transpose()?;
        clear(spec)?;
        Ok(Claim { spec: spec.clone(), lock })
    }

    /// Makes the socket at its place.
    pub(super) fn bind(self) -> Result<(UnixListener, Bound), StartFailure> {
        let (listener, meta) = make(&self.spec)?;
        let (owner, inode) = (Owner::of(&meta), meta.ino());
        let listed = match self.spec.door {
            Door::Operator => RunningEntry::new(&self.spec.path, &self.spec.controller),
            Door::View => None,
        };
        Ok((listener, Bound { spec: self.spec, inode, owner, lock: self.lock, listed }))
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
        UnixListener::bind(&fresh).map_err(|error| spec.not_made(&error.to_string(), &error))?;
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
            (Some(group), io::ErrorKind::PermissionDenied) => spec.failure(&format!(
                "{error}; to give it to `{group}`, the user rungd runs as must be in that group"
            )),
            _ => spec.failure(&error),
        }
    })?;
    Ok((listener, meta))
}

impl Bound {
    /// The path of the socket.
    pub fn path(&self) -> &Path {
        &self.spec.path
    }

    /// What the socket is for.
    pub fn door(&self) -> Door {
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
        (self.owner, self.inode) = (Owner::of(&meta), meta.ino());
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
        return Err(spec.failure(&format!("{} {other}", path.display())));
    }
    let file = options.open(&path).map_err(|error| {
        let refused = [io::ErrorKind::PermissionDenied, io::ErrorKind::ReadOnlyFilesystem];
        let mut why = format!("{}: {error}", path.display());
        if refused.contains(&error.kind()) {
            why += "; name a path in a folder that rungd may write to, as \
                    `/run/rungd/rungd.sock`, or remove the key: systemd gives a service its place";
        }
        spec.not_made(&why, &error)
    })?;
    match flock(&file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => Ok(file),
        Err(Errno::WOULDBLOCK) => Err(taken(spec)),
        Err(error) => Err(spec.failure(&format!("{}: {error}", path.display()))),
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
            Err(spec.failure(&"something that is not a socket is there"))
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

fn group_number(door: Door, group: &str) -> Result<u32, StartFailure> {
    known_group(group).ok_or_else(|| {
        let key = door.keys()[1];
        StartFailure::Configuration(format!(
            "`{key}`: this machine has no group `{group}` in /etc/group; make it (`groupadd \
             {group}`), or write the name or number of a different group"
        ))
    })
}

fn known_group(group: &str) -> Option<u32> {
    let known = fs::read_to_string("/etc/group").unwrap_or_default();
    gid_of(&known, group).or_else(|| group.parse().ok()).filter(|gid| *gid != u32::MAX)
}

/// The group of the view socket that the environment names, if this machine has it and this process
/// may give a file to it: the shipped unit and the container image name a group that an
/// administrator may have left out.
fn group_of_environment() -> Option<String> {
    let group = std::env::var(VIEW_GROUP_VARIABLE).ok()?;
    known_group(&group).filter(|gid| may_give_to(*gid)).map(|_| group)
}

fn may_give_to(gid: u32) -> bool {
    let is_it = |group: Gid| group.as_raw() == gid;
    geteuid().is_root() || is_it(getegid()) || getgroups().is_ok_and(|of| of.into_iter().any(is_it))
}

impl Drop for Bound {
    fn drop(&mut self) {
        if self.lost().is_none() {
            let _ = fs::remove_file(self.path());
        }
    }
}
