//! The list of this user's running controllers: an entry for each operator's socket.
//!
//! The daemon adds its entry when its socket is open, and removes it at its end; `search` reads the
//! list. An entry is a file in a folder that only the user may open. Its process holds a lock on it
//! as long as it lives, so an entry with a free lock is left over from a process that was killed.
//! A service adds none: the place of its socket is known.

use std::env;
use std::ffi::{OsStr, OsString};
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::{FlockOperation, OFlags, flock};
use rustix::process::geteuid;

use rungd_base::directories;

/// The most bytes of an entry: three paths.
const ENTRY_BYTES_MAX: u64 = 3 * 4097;

/// A running controller of this user.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct RunningController {
    /// Its operator's socket.
    pub socket: PathBuf,
    /// Its controller file.
    pub controller: PathBuf,
    /// The folder in which it was started.
    pub folder: PathBuf,
}

impl RunningController {
    /// A controller that this process runs.
    fn here(socket: &Path, controller: &Path) -> io::Result<RunningController> {
        let (socket, controller) = (in_real_folder(socket)?, in_real_folder(controller)?);
        Ok(RunningController { socket, controller, folder: env::current_dir()? })
    }

    /// Whether it runs in a folder: its controller file or its socket is there, or it was started
    /// there.
    pub fn is_in(&self, folder: &Path) -> bool {
        let beside = |path: &Path| path.parent() == Some(folder);
        beside(&self.controller) || beside(&self.socket) || self.folder == folder
    }

    fn bytes(&self) -> Vec<u8> {
        let RunningController { socket, controller, folder } = self;
        let paths = [socket, controller, folder].map(|path| path.as_os_str().as_bytes());
        paths.join(&0)
    }

    fn of_bytes(bytes: Vec<u8>) -> Option<RunningController> {
        let mut paths = bytes.split(|byte| *byte == 0).map(|path| {
            Some(PathBuf::from(OsString::from_vec(path.to_vec()))).filter(|path| path.is_absolute())
        });
        let (socket, controller, folder) = (paths.next()??, paths.next()??, paths.next()??);
        paths.next().is_none().then_some(RunningController { socket, controller, folder })
    }
}

/// The path with its folder as the system knows it, without links.
fn in_real_folder(path: &Path) -> io::Result<PathBuf> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = fs::canonicalize(folder.unwrap_or(Path::new(".")))?;
    Ok(folder.join(path.file_name().unwrap_or_default()))
}

/// The entry of this process in the list; dropping it removes the entry.
#[derive(Debug)]
pub struct RunningEntry {
    controller: RunningController,
    /// The entry's file, and its lock.
    made: Option<(PathBuf, File)>,
}

impl RunningEntry {
    /// Adds this process to the list. `None` for a service, and for paths that the system does not
    /// resolve.
    pub fn new(socket: &Path, controller: &Path) -> Option<RunningEntry> {
        if is_system_service() {
            return None;
        }
        let controller = RunningController::here(socket, controller).ok()?;
        let mut entry = RunningEntry { controller, made: None };
        entry.keep();
        Some(entry)
    }

    /// Makes the entry again if it is gone: the user's last session may have ended, and the folder
    /// with it. Without a usable folder there is no entry: a client then finds the socket only in
    /// its folder, or by its name.
    pub fn keep(&mut self) {
        if !self.made.as_ref().is_some_and(|(path, file)| is_file_at(file, path)) {
            self.made = make(&self.controller).ok();
        }
    }
}

impl Drop for RunningEntry {
    fn drop(&mut self) {
        if let Some((path, file)) = &self.made
            && is_file_at(file, path)
        {
            let _ = fs::remove_file(path);
        }
    }
}

/// Whether this process is a service of the system, whose socket has a place of its own. A user's
/// service has its runtime folder in the user's.
fn is_system_service() -> bool {
    let users = env::var_os("XDG_RUNTIME_DIR").filter(|path| !path.is_empty());
    directories::runtime()
        .is_some_and(|folder| !users.is_some_and(|users_folder| folder.starts_with(users_folder)))
}

fn make(controller: &RunningController) -> io::Result<(PathBuf, File)> {
    let folder = users_folder()?;
    remove_stale(&folder);
    // The place of the socket is this process's alone, and so is a name that is made from it.
    let hash = hmac_sha256::Hash::hash(controller.socket.as_os_str().as_bytes());
    let name: String = hash[..8].iter().map(|byte| format!("{byte:02x}")).collect();
    let (path, fresh) = (folder.join(&name), folder.join(format!(".{name}")));
    let _ = fs::remove_file(&fresh);
    let mut file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(&fresh)?;
    flock(&file, FlockOperation::NonBlockingLockExclusive)?;
    file.write_all(&controller.bytes())?;
    fs::rename(&fresh, &path)?;
    Ok((path, file))
}

/// The folder of this user's list, which is made if it is not there. It also has the sockets of
/// controllers that may not write beside their controller files.
///
/// # Errors
/// It cannot be made, or is open to other users.
pub(crate) fn users_folder() -> io::Result<PathBuf> {
    let folder = folders().into_iter().next().ok_or(io::ErrorKind::NotFound)?;
    match DirBuilder::new().mode(0o700).create(&folder) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => Err(error),
        Ok(()) | Err(_) if is_private(&folder) => Ok(folder),
        Ok(()) | Err(_) => Err(io::ErrorKind::PermissionDenied.into()),
    }
}

/// The folders in which the list may be, the preferred one first. Several, because not every shell
/// of a user has the same environment.
fn folders() -> Vec<PathBuf> {
    let uid = geteuid().as_raw();
    let named = env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
    let login = Some(PathBuf::from(format!("/run/user/{uid}")));
    let is_own = |path: &PathBuf| {
        path.is_absolute()
            && fs::metadata(path).is_ok_and(|folder| folder.is_dir() && folder.uid() == uid)
    };
    let mut folders: Vec<PathBuf> = Vec::new();
    for folder in [named, login].into_iter().flatten().filter(is_own) {
        folders.push(folder.join("rungd-running"));
    }
    folders.push(PathBuf::from(format!("/tmp/rungd-{uid}")));
    folders.dedup();
    folders
}

/// Whether a folder belongs to this user alone. In `/tmp` a different user could make it first.
fn is_private(folder: &Path) -> bool {
    let uid = geteuid().as_raw();
    fs::symlink_metadata(folder)
        .is_ok_and(|is| is.is_dir() && is.uid() == uid && is.mode().trailing_zeros() >= 6)
}

/// The running controllers of this user, in the order of their sockets.
pub(crate) fn running_controllers() -> Vec<RunningController> {
    let controllers_in = |folder: PathBuf| entries(&folder).filter_map(|path| read(&path));
    let mut running: Vec<RunningController> = folders()
        .into_iter()
        .filter(|folder| is_private(folder))
        .flat_map(controllers_in)
        .collect();
    running.sort();
    running.dedup();
    running
}

fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    // All of them: a list that is cut could leave out the very controller that is sought. The
    // folder is the user's own.
    let entries = fs::read_dir(folder).into_iter().flatten();
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    // The names of sockets and of unfinished entries have a dot.
    let is_entry = |name: &OsStr| !name.as_bytes().contains(&b'.');
    paths.filter(move |path| path.file_name().is_some_and(is_entry))
}

/// A controller of the list; `None` if its process has ended.
fn read(path: &Path) -> Option<RunningController> {
    let file = opened(path)?;
    if is_free(&file) {
        return None;
    }
    let mut bytes = Vec::new();
    file.take(ENTRY_BYTES_MAX).read_to_end(&mut bytes).ok()?;
    RunningController::of_bytes(bytes)
}

/// Removes the entries of processes that have ended. If a process makes its entry again at this
/// moment, [`RunningEntry::keep`] repairs it.
fn remove_stale(folder: &Path) {
    for path in entries(folder) {
        if opened(&path).is_some_and(|file| is_free(&file) && is_file_at(&file, &path)) {
            let _ = fs::remove_file(&path);
        }
    }
}

fn opened(path: &Path) -> Option<File> {
    let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits().cast_signed();
    let file = OpenOptions::new().read(true).custom_flags(flags).open(path).ok()?;
    file.metadata().is_ok_and(|is| is.is_file()).then_some(file)
}

/// Whether no process holds the lock of an entry.
fn is_free(file: &File) -> bool {
    flock(file, FlockOperation::NonBlockingLockShared).is_ok()
}

fn is_file_at(file: &File, path: &Path) -> bool {
    let key = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
    match (file.metadata(), fs::symlink_metadata(path)) {
        (Ok(own), Ok(there)) => key(own) == key(there),
        (Err(_), _) | (_, Err(_)) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_of_a_running_controller_holds_three_paths_of_any_bytes() {
        let odd = PathBuf::from(OsString::from_vec(b"/a \n\xff/s".to_vec()));
        let entry =
            RunningController { socket: odd, controller: "/a/c.toml".into(), folder: "/w".into() };
        assert_eq!(RunningController::of_bytes(entry.bytes()), Some(entry));
        let wrong: [&[u8]; 5] = [b"", b"/a\0/b", b"/a\0/b\0/c\0", b"a\0/b\0/c", b"/a\0\0/c"];
        for bytes in wrong {
            assert_eq!(RunningController::of_bytes(bytes.to_vec()), None, "{bytes:?}");
        }
    }

    #[test]
    fn a_long_list_of_running_controllers_is_read_completely() {
        let folder = std::env::temp_dir().join(format!("rungd-listed-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        for number in 0..1500 {
            File::create(folder.join(format!("{number:016x}"))).expect("an entry");
            File::create(folder.join(format!("{number}.sock"))).expect("a socket's name");
        }
        assert_eq!(entries(&folder).count(), 1500);
        remove_stale(&folder);
        assert_eq!(entries(&folder).count(), 0);
        fs::remove_dir_all(&folder).expect("removed");
    }

    #[test]
    fn a_controller_belongs_to_its_start_folder_and_the_folder_of_its_file() {
        let one = RunningController {
            socket: "/run/plant/s".into(),
            controller: "/etc/plant/c.toml".into(),
            folder: "/home/anna".into(),
        };
        let is_in = |folder: &str| one.is_in(Path::new(folder));
        assert!(is_in("/run/plant") && is_in("/etc/plant") && is_in("/home/anna"));
        assert!(!is_in("/home") && !is_in("/etc/plant/programs") && !is_in("/etc"));
    }
}
