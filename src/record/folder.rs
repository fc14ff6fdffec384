//! The folder of the segments: files that grow at their end and are deleted.
//!
//! `store` writes through [`Folder`], so that a test can be a disk that fills up, whose calls fail
//! and whose power fails. [`FolderOnDisk`] is the real one.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A folder with one file open for writing at most.
pub trait Folder {
    /// All of its files: names and bytes.
    ///
    /// # Errors
    /// The system's.
    fn list(&mut self) -> io::Result<Vec<(String, u64)>>;

    /// Makes a new file, and opens it in place of the one before. Its name is durable, if this
    /// succeeds.
    ///
    /// # Errors
    /// `AlreadyExists`; else the system's.
    fn create(&mut self, name: &str) -> io::Result<()>;

    /// Writes at the end of the open file; returns the number of bytes written, which may be fewer
    /// than given.
    ///
    /// # Errors
    /// The system's.
    fn append(&mut self, bytes: &[u8]) -> io::Result<usize>;

    /// Returns once all bytes of the open file are durable.
    ///
    /// # Errors
    /// The system's: what was written since the last success may be lost.
    fn sync(&mut self) -> io::Result<()>;

    /// Closes the open file.
    fn close(&mut self);

    /// Deletes a file.
    ///
    /// # Errors
    /// The system's.
    fn remove(&mut self, name: &str) -> io::Result<()>;
}

/// A folder of the file system.
#[derive(Debug)]
pub struct FolderOnDisk {
    path: PathBuf,
    open: Option<File>,
}

impl FolderOnDisk {
    /// The folder at a path; it is made when it is needed.
    pub fn new(path: &Path) -> FolderOnDisk {
        FolderOnDisk { path: path.to_owned(), open: None }
    }

    fn opened(&mut self) -> io::Result<&mut File> {
        self.open.as_mut().ok_or_else(|| io::Error::other("no file is open"))
    }
}

impl Folder for FolderOnDisk {
    fn list(&mut self) -> io::Result<Vec<(String, u64)>> {
        fs::create_dir_all(&self.path)?;
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

    fn close(&mut self) {
        self.open = None;
    }

    fn remove(&mut self, name: &str) -> io::Result<()> {
        fs::remove_file(self.path.join(name))
    }
}
