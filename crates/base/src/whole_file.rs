//! Replaces a small file as a whole, so that no reader sees half of it, and judges files with
//! secrets.
//!
//! Used by `web` (users, TLS), `metrics`, `mqtt` and `retain`. A file is written under a temporary
//! name beside the old one, and renamed. Only a regular file is replaced: a rename over a device or
//! a pipe would take it from every other program. This module keeps no file and no lock open by
//! itself; who changes what it has read holds a [`FolderLock`] from the reading to the writing.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, Write as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _, PermissionsExt as _, chown};
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;

/// The most links that are followed to a file.
const LINKS_MAX: usize = 40;
/// The longest wait for a lock, and the time between two attempts.
const LOCK_MAX: Duration = Duration::from_secs(10);
const LOCK_EVERY: Duration = Duration::from_millis(5);

/// The rights of a file that is written.
#[derive(Clone, Copy, Debug)]
pub enum FileRights {
    /// These permissions.
    Given(u32),
    /// Owner, group and permissions of the replaced file; for a new file these permissions.
    Kept(u32),
}

/// Replaces a file, or makes it.
///
/// # Errors
/// The system's error, or something that is not a regular file is there; the old file is not
/// changed.
pub fn replace(path: &Path, bytes: &[u8], rights: FileRights) -> io::Result<()> {
    let old = match fs::symlink_metadata(path) {
        Ok(facts) if facts.is_file() => Some(facts),
        Ok(facts) => return Err(not_a_file(&facts)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(error) => return Err(error),
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let fresh = path.with_file_name(format!(".{name}.{}.new", std::process::id()));
    let written = write_as(&fresh, bytes, old.as_ref(), rights);
    let put = written.and_then(|()| fs::rename(&fresh, path));
    if put.is_err() {
        let _ = fs::remove_file(&fresh);
    }
    put?;
    sync_folder_of(path)
}

fn not_a_file(facts: &fs::Metadata) -> io::Error {
    let what = match facts.file_type() {
        kind if kind.is_dir() => "a folder",
        kind if kind.is_symlink() => "a link",
        _ => "a device, a pipe or a socket",
    };
    io::Error::other(format!("{what} is there, and only a regular file is replaced"))
}

/// Writes a new file. `old`: the file that it will replace.
fn write_as(
    fresh: &Path,
    bytes: &[u8],
    old: Option<&fs::Metadata>,
    rights: FileRights,
) -> io::Result<()> {
    // Removes a file that a killed process has left. A link at this path is not followed.
    match fs::remove_file(fresh) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        Ok(()) | Err(_) => {}
    }
    let mut file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(fresh)?;
    file.write_all(bytes)?;
    let mode = match (old, rights) {
        (Some(old), FileRights::Kept(_)) => {
            // The owner is set first, because a change of owner may clear bits of the mode.
            chown(fresh, Some(old.uid()), Some(old.gid()))?;
            old.mode() & 0o7777
        }
        (None, FileRights::Kept(mode)) | (_, FileRights::Given(mode)) => mode,
    };
    file.set_permissions(Permissions::from_mode(mode))?;
    file.sync_all()
}

/// The file at the end of a path's links; it need not exist.
pub fn followed(path: &Path) -> PathBuf {
    let mut place = path.to_owned();
    for _ in 0..LINKS_MAX {
        let Ok(target) = fs::read_link(&place) else { return place };
        place = folder_of(&place).join(target);
    }
    path.to_owned()
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Makes the names in a file's folder durable.
///
/// # Errors
/// The system's error.
pub fn sync_folder_of(path: &Path) -> io::Result<()> {
    File::open(folder_of(path))?.sync_all()
}

/// The lock of a file's folder, for a change of the file: a lock of the file itself would stay with
/// the old file when it is replaced. It ends when this value is dropped.
#[derive(Debug)]
pub struct FolderLock {
    _folder: File,
}

impl FolderLock {
    /// Waits for the lock of the folder of a file.
    ///
    /// # Errors
    /// The system's error, or a different process has held the lock for too long.
    pub fn of(path: &Path) -> io::Result<FolderLock> {
        let (folder, began) = (File::open(folder_of(path))?, Instant::now());
        loop {
            match flock(&folder, FlockOperation::NonBlockingLockExclusive) {
                Ok(()) => return Ok(FolderLock { _folder: folder }),
                Err(Errno::WOULDBLOCK | Errno::INTR) if began.elapsed() < LOCK_MAX => {
                    sleep(LOCK_EVERY);
                }
                Err(Errno::WOULDBLOCK) => {
                    let why = "a different process has locked its folder: nothing is changed";
                    return Err(io::Error::new(io::ErrorKind::ResourceBusy, why));
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
}

/// Refuses a file with a secret (`what`, in the plural) that more than its owner and its group may
/// read, or that its group may write. The group may read it, so that a service can read a file of
/// root.
///
/// # Errors
/// What is wrong, with the remedy; the system's error.
pub fn judge_secret(path: &Path, what: &str) -> io::Result<()> {
    if fs::metadata(path)?.mode() & 0o037 == 0 {
        return Ok(());
    }
    let why = format!("others may read {what}: `chmod o=,g-wx {}` ends that", path.display());
    Err(io::Error::new(io::ErrorKind::PermissionDenied, why))
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Folder {
            let path = std::env::temp_dir().join(format!("rungd-{name}-{}", std::process::id()));
            fs::create_dir_all(&path).expect("a folder");
            Folder(path)
        }

        fn names(&self) -> Vec<String> {
            let entries = fs::read_dir(&self.0).expect("it is there");
            let name = |entry: io::Result<fs::DirEntry>| entry.expect("a name").file_name();
            let mut names: Vec<String> =
                entries.map(|entry| name(entry).into_string().expect("a text")).collect();
            names.sort();
            names
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn only_a_regular_file_is_replaced_and_no_temporary_file_remains() {
        let folder = Folder::new("whole");
        let path = folder.0.join("file");
        replace(&path, b"one", FileRights::Kept(0o640)).expect("it is made");
        assert_eq!(fs::metadata(&path).expect("it is there").mode() & 0o777, 0o640);
        fs::set_permissions(&path, Permissions::from_mode(0o604)).expect("it is changed");
        replace(&path, b"two", FileRights::Kept(0o640)).expect("it is replaced");
        assert_eq!(fs::read(&path).expect("it is there"), b"two");
        assert_eq!(fs::metadata(&path).expect("it is there").mode() & 0o777, 0o604);
        replace(&path, b"six", FileRights::Given(0o644)).expect("it is replaced");
        assert_eq!(fs::metadata(&path).expect("it is there").mode() & 0o777, 0o644);
        let (sub, link, pipe) =
            (folder.0.join("sub"), folder.0.join("link"), folder.0.join("pipe"));
        fs::create_dir(&sub).expect("a folder");
        std::os::unix::fs::symlink("file", &link).expect("a link");
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RWXU).expect("a pipe");
        for (other, what) in [(&sub, "a folder"), (&link, "a link"), (&pipe, "a device, a pipe")] {
            let refused = replace(other, b"x", FileRights::Given(0o644)).expect_err("refused");
            assert!(refused.to_string().starts_with(what), "{refused}");
        }
        assert_eq!(followed(&link), path);
        assert_eq!(followed(&folder.0.join("none")), folder.0.join("none"));
        assert_eq!(folder.names(), ["file", "link", "pipe", "sub"]);
        assert!(replace(&folder.0.join("none/file"), b"x", FileRights::Given(0o644)).is_err());
    }

    #[test]
    fn only_one_process_at_a_time_locks_a_folder() {
        let folder = Folder::new("held");
        let path = folder.0.join("file");
        let held = FolderLock::of(&path).expect("it is free");
        let waits = {
            let path = path.clone();
            std::thread::spawn(move || drop(FolderLock::of(&path).expect("it becomes free")))
        };
        sleep(Duration::from_millis(50));
        assert!(!waits.is_finished());
        drop(held);
        waits.join().expect("it ends");
    }

    #[test]
    fn a_secret_file_must_be_readable_only_by_its_owner_and_group() {
        let folder = Folder::new("secret");
        let path = folder.0.join("key");
        fs::write(&path, "x").expect("it is written");
        for (mode, is_right) in
            [(0o600, true), (0o640, true), (0o644, false), (0o604, false), (0o660, false)]
        {
            fs::set_permissions(&path, Permissions::from_mode(mode)).expect("it is changed");
            assert_eq!(judge_secret(&path, "the key").is_ok(), is_right, "{mode:o}");
        }
    }
}
