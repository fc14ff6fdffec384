//! The folder of the segments: files that grow at their end and are deleted.
//!
//! `store` writes through [`RecordFolder`], so that a test can simulate a full disk, failing calls
//! and power failures. [`FolderOnDisk`] is the real folder.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::{FlockOperation, OFlags, flock};
use rustix::io::Errno;

use super::segment_read::passed_ns;
use rungd_base::regular_file;
use rungd_state::retain::file::is_named;

/// A folder with at most one file open for writing.
pub trait RecordFolder {
    /// Owns the files of a controller until the folder is dropped: no other process deletes them.
    /// It is called again after a failure.
    ///
    /// # Errors
    /// `ResourceBusy` if another process owns them; otherwise the error of the system.
    fn own(&mut self, controller: &str) -> io::Result<()>;

    /// The start times of the owned files, ns, in the order in which they were begun, as far as it
    /// was noted. A wrong clock gives wrong times, but no wrong order.
    fn order(&mut self) -> Vec<i64>;

    /// Notes the order of the owned files. If that fails, the order is that of their start times.
    fn note_order(&mut self, begun_ns: &[i64]);

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
    let no_recording = "a recording is a regular file, or a folder of files";
    regular_file::open(path).map_err(|error| match error.kind() == io::ErrorKind::InvalidInput {
        true => io::Error::new(error.kind(), format!("{error}: {no_recording}")),
        false => error,
    })
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

/// The first and the last line of an order of files in a lock file.
const ORDER_BEGIN: &str = "rungd record order";
const ORDER_END: &str = "end";
/// The maximum number of bytes of an order.
const ORDER_BYTES_MAX: u64 = 1 << 24;

/// The order of files in a lock file: a start time a line, in microseconds; `None`: there is none,
/// or it is not whole.
fn noted_order(file: &File) -> Option<Vec<i64>> {
    let length = file.metadata().ok().filter(fs::Metadata::is_file)?.len();
    let mut bytes = vec![0; length.min(ORDER_BYTES_MAX) as usize];
    file.read_exact_at(&mut bytes, 0).ok()?;
    let text = String::from_utf8(bytes).ok()?;
    let times = text.strip_prefix(ORDER_BEGIN)?.trim_end().strip_suffix(ORDER_END)?;
    let begun_ns = |line: &str| line.parse::<i64>().ok()?.checked_mul(1000);
    times.split_whitespace().map(begun_ns).collect()
}

/// Whether a lock file is empty or holds an order, whole or in part.
fn is_order(file: &File) -> bool {
    let mut begin = vec![0; ORDER_BEGIN.len()];
    let count = file.read_at(&mut begin, 0).unwrap_or(0);
    let is_begin = ORDER_BEGIN.as_bytes().starts_with(&begin[..count]);
    is_begin && file.metadata().is_ok_and(|metadata| metadata.is_file())
}

/// Writes an order of files, durably. An order that is only half written is not whole.
fn write_order(file: &File, begun_ns: &[i64]) -> io::Result<()> {
    let times: String = begun_ns.iter().map(|ns| format!("{}\n", ns / 1000)).collect();
    let text = format!("{ORDER_BEGIN}\n{times}{ORDER_END}\n");
    file.set_len(0)?;
    file.write_all_at(text.as_bytes(), 0)?;
    file.sync_data()
}

impl RecordFolder for FolderOnDisk {
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
        options.read(true).write(true).create(true).truncate(false).custom_flags(flags);
        let file = options.open(path)?;
        lock(&file)?;
        self.lock = Some(file);
        Ok(())
    }

    fn order(&mut self) -> Vec<i64> {
        self.lock.as_ref().and_then(noted_order).unwrap_or_default()
    }

    fn note_order(&mut self, begun_ns: &[i64]) {
        let Some(file) = &self.lock else { return };
        // A file of somebody else that has this name is left alone.
        if is_order(file) {
            let _ = write_order(file, begun_ns);
        }
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
