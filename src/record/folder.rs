//! The folder of the segments: files that grow at their end and are deleted.
//!
//! `store` writes through [`Folder`], so that a test can simulate a full disk, failing calls and
//! power failures. [`FolderOnDisk`] is the real folder.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use rustix::fs::{FlockOperation, OFlags, flock};
use rustix::io::Errno;

use super::segment_read::passed_ns;
use crate::retain::file::is_named;

/// A folder with at most one file open for writing.
pub trait Folder {
    /// Owns the files of a controller until the folder is dropped: no other process deletes them.
    /// It is called again after a failure.
    ///
    /// # Errors
    /// `ResourceBusy` if another process owns them; otherwise the error of the system.
    fn own(&mut self, controller: &str) -> io::Result<()>;

    /// All files of the folder: names and sizes in bytes.
    ///
    /// # Errors
    /// The error of the system.
    fn list(&mut self) -> io::Result<Vec<(String, u64)>>;

    /// Makes a new file, and opens it instead of the previous one. After success its name is
    /// durable.
    ///
    /// # Errors
    /// `AlreadyExists`; otherwise the error of the system.
    fn create(&mut self, name: &str) -> io::Result<()>;

    /// Writes at the end of the open file; returns the number of bytes written, which may be fewer
    /// than given.
    ///
    /// # Errors
    /// The error of the system.
    fn append(&mut self, bytes: &[u8]) -> io::Result<usize>;

    /// Returns once all bytes of the open file are durable.
    ///
    /// # Errors
    /// The error of the system: the bytes written since the last success may be lost.
    fn sync(&mut self) -> io::Result<()>;

    /// Whether the open file still has this name: nobody has removed, renamed or replaced it.
    fn is_there(&mut self, name: &str) -> bool;

    /// The time that is recorded in a file, ns, by the heads of its blocks.
    ///
    /// # Errors
    /// The error of the system.
    fn passed_ns(&mut self, name: &str) -> io::Result<u64>;

    /// Closes the open file.
    fn close(&mut self);

    /// Deletes a file.
    ///
    /// # Errors
    /// The error of the system.
    fn remove(&mut self, name: &str) -> io::Result<()>;
}

/// A folder of the file system.
#[derive(Debug)]
pub struct FolderOnDisk {
    path: PathBuf,
    open: Option<File>,
    /// The locked file of the controller whose files the folder owns.
    lock: Option<File>,
}

impl FolderOnDisk {
    /// The folder at a path; the folder is created when it is needed.
    pub fn new(path: &Path) -> FolderOnDisk {
        FolderOnDisk { path: path.to_owned(), open: None, lock: None }
    }

    fn opened(&mut self) -> io::Result<&mut File> {
        self.open.as_mut().ok_or_else(|| io::Error::other("no file is open"))
    }
}

/// Opens a file of segments for reading. It waits for nothing: a pipe with the name of a recording
/// would wait for a writer, and a terminal for its user.
///
/// # Errors
/// `InvalidInput` if it is not a regular file; otherwise the error of the system.
pub(super) fn open_file(path: &Path) -> io::Result<File> {
    let flags = OFlags::NONBLOCK.bits() as i32;
    let file = OpenOptions::new().read(true).custom_flags(flags).open(path)?;
    if !file.metadata()?.is_file() {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "not a regular file: a recording is a file, or a folder of files",
        ));
    }
    Ok(file)
}

/// Locks a file against other processes. On a file system without locks it succeeds without a lock.
fn lock(file: &File) -> io::Result<()> {
    match flock(file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) | Err(Errno::NOTSUP | Errno::NOSYS | Errno::NOLCK) => Ok(()),
        Err(Errno::WOULDBLOCK) => Err(io::Error::new(
            io::ErrorKind::ResourceBusy,
            "another rungd records under the same name in this folder: stop it, or name another \
             `[record] dir`",
        )),
        Err(error) => Err(error.into()),
    }
}

impl Folder for FolderOnDisk {
    fn own(&mut self, controller: &str) -> io::Result<()> {
        fs::create_dir_all(&self.path)?;
        let path = self.path.join(format!("{controller}.lock"));
        if self.lock.as_ref().is_some_and(|held| is_named(held, &path)) {
            return Ok(());
        }
        // The file was deleted: other processes would lock a new file.
        self.lock = None;
        // The open call neither waits for a pipe nor follows a link.
        let flags = (OFlags::NONBLOCK | OFlags::NOFOLLOW).bits() as i32;
        let mut options = OpenOptions::new();
        options.write(true).create(true).truncate(false).custom_flags(flags);
        let file = options.open(path)?;
        lock(&file)?;
        self.lock = Some(file);
        Ok(())
    }

    fn list(&mut self) -> io::Result<Vec<(String, u64)>> {
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.path)? {
            let entry = entry?;
            let (name, facts) = (entry.file_name(), entry.metadata()?);
            if let Some(name) = name.to_str().filter(|_| facts.is_file()) {
                files.push((name.to_owned(), facts.len()));
            }
        }
        Ok(files)
    }

    fn create(&mut self, name: &str) -> io::Result<()> {
        self.close();
        let file = OpenOptions::new().append(true).create_new(true).open(self.path.join(name))?;
        self.open = Some(file);
        File::open(&self.path)?.sync_all()
    }

    fn append(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.opened()?.write(bytes)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.opened()?.sync_data()
    }

    fn is_there(&mut self, name: &str) -> bool {
        self.open.as_ref().is_some_and(|open| is_named(open, &self.path.join(name)))
    }

    fn passed_ns(&mut self, name: &str) -> io::Result<u64> {
        passed_ns(&mut open_file(&self.path.join(name))?)
    }

    fn close(&mut self) {
        self.open = None;
    }

    fn remove(&mut self, name: &str) -> io::Result<()> {
        fs::remove_file(self.path.join(name))
    }
}
