//! The folder for files that the server makes to be looked at: pictures, texts, files of the library.
//!
//! Made at the first file, for its owner alone, and gone with the server.

use std::fs::{self, DirBuilder, Permissions};
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result};

use super::uri::{SCRATCH, shown_name};
use crate::load::library::LibraryFile;

/// How often a name is tried that may be another's.
const TRIES_MAX: u32 = 1000;

/// A folder that goes with its last holder.
#[derive(Debug, Default)]
pub(super) struct Scratch(Mutex<Option<PathBuf>>);

impl Scratch {
    /// Writes a file, in place of an older one of the name; its path.
    ///
    /// # Errors
    /// The system's.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<PathBuf> {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
        let name: String = name.chars().map(|c| if is_plain(c) { c } else { '_' }).collect();
        let path = self.folder()?.join(name);
        fs::write(&path, content).with_context(|| path.display().to_string())?;
        Ok(path)
    }

    /// The file that shows one of the library, which nobody can write; its path.
    ///
    /// # Errors
    /// The system's.
    pub fn library(&self, file: &LibraryFile) -> Result<PathBuf> {
        let path = self.folder()?.join(shown_name(file.name));
        if !path.exists() {
            fs::write(&path, file.text).with_context(|| path.display().to_string())?;
            fs::set_permissions(&path, Permissions::from_mode(0o444))?;
        }
        Ok(path)
    }

    fn folder(&self) -> Result<PathBuf> {
        let mut folder = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = &*folder {
            return Ok(known.clone());
        }
        let path = made()?;
        *folder = Some(path.clone());
        Ok(path)
    }
}

fn made() -> Result<PathBuf> {
    let (temp, own) = (std::env::temp_dir(), std::process::id());
    for number in 0..TRIES_MAX {
        let path = temp.join(format!("{SCRATCH}{own}-s{number}"));
        match DirBuilder::new().mode(0o700).create(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
            made => return made.map(|()| path.clone()).with_context(|| path.display().to_string()),
        }
    }
    anyhow::bail!("no folder of its own in {}", temp.display())
}

impl Drop for Scratch {
    fn drop(&mut self) {
        if let Some(path) = self.0.get_mut().unwrap_or_else(PoisonError::into_inner) {
            let _ = fs::remove_dir_all(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_is_the_owners_and_goes() {
        let scratch = Scratch::default();
        let path = scratch.write("why ../a.txt", b"x").unwrap();
        let folder = path.parent().unwrap().to_owned();
        assert_eq!(path.file_name().unwrap(), "why_.._a.txt");
        assert_eq!(folder.metadata().unwrap().permissions().mode() & 0o777, 0o700);
        drop(scratch);
        assert!(!folder.exists());
    }
}
