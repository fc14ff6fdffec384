//! The folder for files that the server writes for the editor to show: pictures, texts, copies of
//! library files.
//!
//! The folder is created with the first file, is accessible only to its owner, and is removed when
//! the server ends. A server that is killed leaves its folder; the next server removes it, because
//! nobody holds its lock.

use std::fs::{self, DirBuilder, File, OpenOptions, Permissions};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result};
use rustix::fs::{FlockOperation, OFlags, flock};

use super::uri::{SCRATCH, shown_name};
use rungd_base::locked::locked;
use rungd_config::load::library::LibraryFile;

/// The maximum number of names that are tried: a name may be in use already.
const TRIES_MAX: u32 = 1000;

/// The file whose lock shows that the server is running.
const LOCK: &str = ".lock";

/// A folder that is removed when its last holder is dropped.
#[derive(Debug, Default)]
pub(super) struct Scratch(Mutex<Option<ScratchFolder>>);

#[derive(Debug)]
struct ScratchFolder {
    path: PathBuf,
    /// Held as long as the server runs.
    _lock: File,
}

impl Scratch {
    /// Writes a file, in place of an older file of the same name. Returns its path.
    ///
    /// # Errors
    /// The system cannot create the folder or write the file.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<PathBuf> {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
        let name: String = name.chars().map(|c| if is_plain(c) { c } else { '_' }).collect();
        let path = self.folder()?.join(name);
        fs::write(&path, content).with_context(|| path.display().to_string())?;
        Ok(path)
    }

    /// Writes the read-only file that shows a file of the library. Returns its path.
    ///
    /// # Errors
    /// The system cannot create the folder or write the file.
    pub fn library(&self, file: &LibraryFile) -> Result<PathBuf> {
        let path = self.folder()?.join(shown_name(file.name));
        if !path.exists() {
            fs::write(&path, file.text).with_context(|| path.display().to_string())?;
            fs::set_permissions(&path, Permissions::from_mode(0o444))?;
        }
        Ok(path)
    }

    fn folder(&self) -> Result<PathBuf> {
        let mut folder = locked(&self.0);
        if let Some(known) = &*folder {
            return Ok(known.path.clone());
        }
        let temp = std::env::temp_dir();
        remove_abandoned(&temp);
        let made = made(&temp)?;
        let path = made.path.clone();
        *folder = Some(made);
        Ok(path)
    }
}

fn made(temp: &Path) -> Result<ScratchFolder> {
    let own = std::process::id();
    for number in 0..TRIES_MAX {
        let path = temp.join(format!("{SCRATCH}{own}-{number}"));
        match DirBuilder::new().mode(0o700).create(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => continue,
            made => made.with_context(|| path.display().to_string())?,
        }
        let lock = File::create(path.join(LOCK)).with_context(|| path.display().to_string())?;
        // A different server may be about to remove the folder, because it had no lock yet.
        if flock(&lock, FlockOperation::NonBlockingLockExclusive).is_ok() {
            return Ok(ScratchFolder { path, _lock: lock });
        }
    }
    anyhow::bail!("no folder for temporary files can be created in {}", temp.display())
}

/// Removes the folders of servers that no longer run. A folder that cannot be removed belongs to a
/// different user, or does not have its lock yet.
fn remove_abandoned(temp: &Path) {
    let entries = fs::read_dir(temp).into_iter().flatten().flatten();
    let of_servers =
        entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(SCRATCH));
    for path in of_servers.map(|entry| entry.path()) {
        // The flags protect against a link or a FIFO in the place of the lock.
        let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits().cast_signed();
        let lock = OpenOptions::new().write(true).custom_flags(flags).open(path.join(LOCK));
        let Ok(lock) = lock else { continue };
        if flock(&lock, FlockOperation::NonBlockingLockExclusive).is_ok() {
            let _ = fs::remove_dir_all(path);
        }
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        if let Some(folder) = self.0.get_mut().unwrap_or_else(PoisonError::into_inner) {
            let _ = fs::remove_dir_all(&folder.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scratch_folder_is_private_and_is_removed_at_the_end() {
        // In the common folder a different test may take the same name once it is free.
        let own = Scratch::default();
        let temp = own.write("temp/..", b"x").unwrap().parent().unwrap().to_owned();
        let scratch = Scratch(Mutex::new(Some(made(&temp).unwrap())));
        let path = scratch.write("why ../a.txt", b"x").unwrap();
        let folder = path.parent().unwrap().to_owned();
        assert_eq!(path.file_name().unwrap(), "why_.._a.txt");
        assert_eq!(folder.metadata().unwrap().permissions().mode() & 0o777, 0o700);
        drop(scratch);
        assert!(!folder.exists());
    }

    #[test]
    fn the_scratch_folder_of_a_dead_server_is_removed() {
        let own = Scratch::default();
        let temp = own.write("temp/..", b"x").unwrap().parent().unwrap().to_owned();
        let lives = made(&temp).unwrap();
        let ScratchFolder { path: abandoned, _lock } = made(&temp).unwrap();
        drop(_lock);
        let unmade = temp.join(format!("{SCRATCH}1-0"));
        fs::create_dir(&unmade).unwrap();
        remove_abandoned(&temp);
        assert!(lives.path.exists() && unmade.exists() && !abandoned.exists());
    }
}
