//! A real file as a device: locks it, makes it under a temporary name, moves a file of unknown
//! content aside.
//!
//! Called by `keeper` and by `rungd retain show`. This module returns errors; the keeper decides
//! how the controller reacts to them. If the path is a symbolic link, new files are made beside its
//! target, and the link stays.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::unix::fs::{FileExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::{Advice, FlockOperation, RenameFlags, fadvise, flock, renameat_with};

use super::device::Storage;
use rungd_base::whole_file::{followed, sync_folder_of};

/// An open file of retentive memory. With [`Access::Own`] it is locked against other processes.
#[derive(Debug)]
pub struct FileDevice {
    path: PathBuf,
    file: File,
}

/// The file's metadata: it changes if a different process writes, shortens or replaces the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileMetadata {
    identity: FileIdentity,
    length: u64,
    /// The last change of the content.
    modified: FileTime,
    /// The last change of the content or of the metadata.
    changed: FileTime,
}

/// The device and inode: they stay the same when the file is renamed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FileIdentity {
    device: u64,
    inode: u64,
}

/// A time in the metadata.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct FileTime {
    s: i64,
    ns: i64,
}

/// The access of a process to the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Read and write it, and lock it against other processes.
    Own,
    /// Only read it.
    Read,
}

impl FileDevice {
    /// Opens a file that exists.
    ///
    /// # Errors
    /// The error of the system; `ResourceBusy` if a different process owns the file.
    pub fn open(path: &Path, access: Access) -> io::Result<FileDevice> {
        let mut options = OpenOptions::new();
        // So a pipe does not block here, and a terminal does not become the controlling terminal.
        let flags = rustix::fs::OFlags::NONBLOCK | rustix::fs::OFlags::NOCTTY;
        options.read(true).write(access == Access::Own).custom_flags(flags.bits() as i32);
        let file = options.open(path)?;
        if !file.metadata()?.is_file() {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file"));
        }
        if access == Access::Own {
            lock(&file)?;
        }
        Ok(FileDevice { path: path.to_owned(), file })
    }

    /// The identity of the file.
    ///
    /// # Errors
    /// The error of the system.
    pub(crate) fn identity(&self) -> io::Result<FileIdentity> {
        Ok(identity(&self.file.metadata()?))
    }

    /// The metadata of the file that has this name now. Every change of the file changes it; a read
    /// does not.
    pub(crate) fn trace(&self) -> Option<FileMetadata> {
        let named = fs::metadata(&self.path).ok()?;
        Some(FileMetadata {
            identity: identity(&named),
            length: named.len(),
            modified: FileTime { s: named.mtime(), ns: named.mtime_nsec() },
            changed: FileTime { s: named.ctime(), ns: named.ctime_nsec() },
        })
    }

    /// Makes an empty file beside the path, for [`FileDevice::put_in_place`].
    ///
    /// # Errors
    /// The error of the system; `ResourceBusy` if a different process is making the file.
    pub(crate) fn create_beside(path: &Path) -> io::Result<FileDevice> {
        let path = with_ending(&followed(path), ".new");
        // A file that a different process is making is locked; an abandoned file is not.
        let left = OpenOptions::new().read(true).custom_flags(AS_IT_IS.bits() as i32).open(&path);
        let is_there = !matches!(&left, Err(error) if error.kind() == io::ErrorKind::NotFound);
        if let Ok(left) = &left {
            lock(left)?;
            if !is_named(left, &path) {
                return Err(busy());
            }
        }
        // A file that did not exist a moment ago is not removed: a different process may be making
        // it now.
        if is_there
            && let Err(error) = fs::remove_file(&path)
            && error.kind() != io::ErrorKind::NotFound
        {
            let why = format!("{} is in the way: {error}", path.display());
            return Err(io::Error::new(error.kind(), why));
        }
        let mut options = OpenOptions::new();
        let file = options.read(true).write(true).create_new(true).mode(0o640).open(&path);
        let named = |error: io::Error| {
            // A different process made the file since the check above.
            if error.kind() == io::ErrorKind::AlreadyExists {
                return busy();
            }
            io::Error::new(error.kind(), format!("{}: {error}", path.display()))
        };
        let file = file.map_err(named)?;
        lock(&file)?;
        if !is_named(&file, &path) {
            return Err(busy());
        }
        Ok(FileDevice { path, file })
    }

    /// Deletes the file that [`FileDevice::create_beside`] made.
    pub(crate) fn discard_beside(path: &Path) {
        let _ = fs::remove_file(with_ending(&followed(path), ".new"));
    }

    /// Renames the file, which is whole and durable now, to `path`. `replaces`: this process owns
    /// the file at `path`, and replaces it.
    ///
    /// # Errors
    /// The error of the system; `ResourceBusy` if a different process has made a file at `path`.
    pub(crate) fn put_in_place(&mut self, path: &Path, replaces: bool) -> io::Result<()> {
        let place = followed(path);
        match rename_anew(&self.path, &place) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && replaces => {
                fs::rename(&self.path, &place)?;
            }
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => return Err(busy()),
            other => other?,
        }
        path.clone_into(&mut self.path);
        sync_folder_of(&place)
    }
}

/// Flags that open the directory entry itself: the call does not block, and follows no link.
const AS_IT_IS: rustix::fs::OFlags =
    rustix::fs::OFlags::NONBLOCK.union(rustix::fs::OFlags::NOFOLLOW);

fn lock(file: &File) -> io::Result<()> {
    match flock(file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => Ok(()),
        Err(rustix::io::Errno::WOULDBLOCK) => Err(busy()),
        Err(error) => Err(error.into()),
    }
}

fn busy() -> io::Error {
    io::Error::new(
        io::ErrorKind::ResourceBusy,
        "another rungd uses this file: stop that rungd, or name a different `[retain] file`",
    )
}

fn identity(metadata: &fs::Metadata) -> FileIdentity {
    FileIdentity { device: metadata.dev(), inode: metadata.ino() }
}

/// Whether a path is the path of an open file.
pub fn is_named(file: &File, path: &Path) -> bool {
    match (file.metadata(), fs::symlink_metadata(path)) {
        (Ok(own), Ok(named)) => identity(&own) == identity(&named),
        (Ok(_) | Err(_), Ok(_) | Err(_)) => false,
    }
}

/// Renames a file to a name that no file has.
fn rename_anew(from: &Path, to: &Path) -> io::Result<()> {
    let here = rustix::fs::CWD;
    match renameat_with(here, from, here, to, RenameFlags::NOREPLACE) {
        // The file system does not support a rename that never replaces a file.
        Err(rustix::io::Errno::INVAL) if !to.exists() => fs::rename(from, to),
        Err(rustix::io::Errno::INVAL) => Err(io::ErrorKind::AlreadyExists.into()),
        other => Ok(other?),
    }
}

impl Storage for FileDevice {
    fn size(&mut self) -> io::Result<u64> {
        Ok(self.file.metadata()?.len())
    }

    fn read_at(&mut self, at: u64, into: &mut [u8]) -> io::Result<usize> {
        FileExt::read_at(&self.file, into, at)
    }

    fn write_at(&mut self, at: u64, from: &[u8]) -> io::Result<usize> {
        FileExt::write_at(&self.file, from, at)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.file.sync_data()?;
        // If the file has lost its name, its bytes cannot be read after a restart.
        self.in_place()
    }

    fn in_place(&mut self) -> io::Result<()> {
        let (own, named) = (self.file.metadata()?, fs::metadata(&self.path)?);
        if (own.dev(), own.ino()) != (named.dev(), named.ino()) {
            let message = "a different file has its name now";
            return Err(io::Error::new(io::ErrorKind::NotFound, message));
        }
        Ok(())
    }

    fn settle(&mut self) {
        let _ = self.file.sync_data();
        let _ = fadvise(&self.file, 0, None, Advice::DontNeed);
    }

    fn reopen(&mut self) -> io::Result<()> {
        // The lock is released first, because `open` takes it again. No other process waits for it:
        // a process that does not get the lock ends.
        flock(&self.file, FlockOperation::Unlock)?;
        match FileDevice::open(&self.path, Access::Own) {
            Ok(opened) => *self = opened,
            Err(error) => {
                let _ = lock(&self.file);
                return Err(error);
            }
        }
        Ok(())
    }
}

/// Renames a file to a free name, so that it is never overwritten. The file must have the identity
/// `seen`, and no other process may own it.
///
/// # Errors
/// The error of the system; `ResourceBusy` if a different process owns or has replaced the file.
pub(crate) fn keep_aside(path: &Path, seen: FileIdentity) -> io::Result<PathBuf> {
    let held = FileDevice::open(path, Access::Own)?;
    if held.identity()? != seen {
        return Err(busy());
    }
    rename_aside(path)
}

/// As [`keep_aside`], for a file that this process owns.
///
/// # Errors
/// The error of the system.
pub fn rename_aside(path: &Path) -> io::Result<PathBuf> {
    let path = &followed(path);
    for number in 1..10_000 {
        let aside = with_ending(path, &format!(".aside-{number}"));
        match rename_anew(path, &aside) {
            Ok(()) => {
                sync_folder_of(path)?;
                return Ok(aside);
            }
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::new(io::ErrorKind::AlreadyExists, "too many files are kept aside already"))
}

fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;
    use std::thread;

    use super::*;

    /// Makes a file from four threads at the same moment, many times. Returns the maximum number of
    /// threads that got the file.
    fn most_that_own_it(left: Option<&str>) -> usize {
        let folder = std::env::temp_dir().join(format!(
            "rungd-file-{}-{}",
            std::process::id(),
            left.is_some()
        ));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("memory");
        let begin = Barrier::new(4);
        let turn = || {
            begin.wait();
            FileDevice::create_beside(&path)
        };
        let mut most = 0;
        for _ in 0..500 {
            if let Some(left) = left {
                fs::write(folder.join("memory.new"), left).unwrap();
            }
            let made: Vec<_> = thread::scope(|scope| {
                let threads: Vec<_> = (0..4).map(|_| scope.spawn(turn)).collect();
                threads.into_iter().map(|one| one.join().unwrap()).collect()
            });
            for refused in made.iter().filter_map(|one| one.as_ref().err()) {
                assert_eq!(refused.kind(), io::ErrorKind::ResourceBusy, "{refused}");
            }
            most = most.max(made.iter().flatten().count());
            for one in made.iter().flatten() {
                assert!(is_named(&one.file, &folder.join("memory.new")), "it was taken away");
            }
            drop(made);
            FileDevice::discard_beside(&path);
        }
        fs::remove_dir_all(&folder).unwrap();
        most
    }

    #[test]
    fn only_one_of_several_concurrent_creators_owns_the_file() {
        assert_eq!(most_that_own_it(None), 1);
        assert_eq!(most_that_own_it(Some("half a file")), 1);
    }
}
