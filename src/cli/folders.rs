//! The files of a folder and the folders in it, for commands that accept both files and folders.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// The files whose names have this ending, in order of their names. Folders whose names begin with
/// a dot are left out. A link counts as a file, even if it leads to a folder.
///
/// # Errors
/// A folder cannot be read.
pub(super) fn search(folder: &Path, ending: &str) -> Result<Vec<PathBuf>> {
    let context = || folder.display().to_string();
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(context)? {
        entries.push(entry.with_context(context)?);
    }
    entries.sort_by_key(std::fs::DirEntry::file_name);
    let mut found = Vec::new();
    for entry in entries {
        let name = entry.file_name();
        let path = match folder == Path::new(".") {
            true => PathBuf::from(&name),
            false => entry.path(),
        };
        let name = name.to_string_lossy();
        let kind = entry.file_type().with_context(context)?;
        if kind.is_dir() && !name.starts_with('.') {
            found.extend(search(&path, ending)?);
        } else if !kind.is_dir() && name.ends_with(ending) {
            found.push(path);
        }
    }
    Ok(found)
}
