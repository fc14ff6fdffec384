//! The metrics as a file, for a collector of text files. The file is written under a temporary
//! name, then renamed, so that nobody reads an incomplete file.

use std::fs::{self, OpenOptions, Permissions};
use std::io::{self, Write as _};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};

/// Writes a file that every user may read.
///
/// # Errors
/// The system's error; the previous file is not changed.
pub(super) fn write(path: &Path, text: &str) -> Result<()> {
    let beside = beside(path);
    let written = put(&beside, path, text);
    if written.is_err() {
        let _ = fs::remove_file(&beside);
    }
    written.with_context(|| path.display().to_string())
}

fn put(beside: &Path, path: &Path, text: &str) -> io::Result<()> {
    // Removes a file that a killed process has left. A link at this path is not followed.
    match fs::remove_file(beside) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        Ok(()) | Err(_) => {}
    }
    let mut file = OpenOptions::new().write(true).create_new(true).open(beside)?;
    file.write_all(text.as_bytes())?;
    file.set_permissions(Permissions::from_mode(0o644))?;
    file.sync_all()?;
    fs::rename(beside, path)
}

/// A path in the same folder, with an ending that no collector reads.
fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.new", std::process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_whole_and_readable_and_nothing_stays_beside_it() {
        let folder = std::env::temp_dir().join(format!("rungd-textfile-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("rungd.prom");
        for text in ["rungd_up 1\n", "rungd_up 0\n"] {
            write(&path, text).expect("it is written");
            assert_eq!(fs::read_to_string(&path).expect("it is there"), text);
        }
        let mode = fs::metadata(&path).expect("it is there").permissions().mode();
        assert_eq!(mode & 0o777, 0o644);
        fs::create_dir(folder.join("taken")).expect("a folder");
        assert!(write(&folder.join("taken"), "x").is_err(), "a folder is not replaced");
        assert!(write(&folder.join("none/rungd.prom"), "x").is_err());
        assert_eq!(fs::read_dir(&folder).expect("it is there").count(), 2);
        fs::remove_dir_all(&folder).expect("it was made here");
    }
}
