//! Paths of a command line: the files of a folder and the folders in it, for commands that accept
//! both files and folders; paths that are no texts.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::exit::CommandLine;

/// Refuses the path of a project that is not a text in UTF-8. The sockets, files and folders of a
/// controller are named by texts, and lie beside its file.
///
/// # Errors
/// The path is not UTF-8.
pub(super) fn has_text_path(path: &Path) -> Result<()> {
    if path.to_str().is_some() {
        return Ok(());
    }
    let why = format!(
        "{}: the name is not UTF-8 text, and a controller names its socket and its files by \
         texts: rename the file or folder",
        path.display()
    );
    Err(CommandLine(why).into())
}

/// The files whose names have this ending, in order of their names. Folders whose names begin with
/// a dot are left out. A link counts as a file, even if it leads to a folder. Pipes, sockets and
/// devices are left out: no file of rungd is one, and reading one might never end.
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
        } else if (kind.is_file() || kind.is_symlink()) && name.ends_with(ending) {
            found.push(path);
        }
    }
    Ok(found)
}
