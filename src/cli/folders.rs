//! Paths of a command line: the files of a folder and the folders in it, for commands that accept
//! both files and folders; paths that are no texts.

use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, Error, Result};

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
    let (found, failed) = search_on(folder, ending);
    failed.into_iter().next().map_or(Ok(found), Err)
}

/// The files of [`search`], and the reasons why folders could not be read: for a command that goes
/// on behind them.
pub(super) fn search_on(folder: &Path, ending: &str) -> (Vec<PathBuf>, Vec<Error>) {
    let (mut found, mut failed) = (Vec::new(), Vec::new());
    walk(folder, ending, &mut found, &mut failed);
    (found, failed)
}

fn walk(folder: &Path, ending: &str, found: &mut Vec<PathBuf>, failed: &mut Vec<Error>) {
    let context = || folder.display().to_string();
    let entries = std::fs::read_dir(folder).and_then(Iterator::collect::<io::Result<Vec<_>>>);
    let mut entries = match entries.with_context(context) {
        Ok(entries) => entries,
        Err(why) => return failed.push(why),
    };
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let name = entry.file_name();
        let path = match folder == Path::new(".") {
            true => PathBuf::from(&name),
            false => entry.path(),
        };
        let name = name.to_string_lossy();
        match entry.file_type().with_context(context) {
            Err(why) => failed.push(why),
            Ok(kind) if kind.is_dir() && !name.starts_with('.') => {
                walk(&path, ending, found, failed);
            }
            Ok(kind) if (kind.is_file() || kind.is_symlink()) && name.ends_with(ending) => {
                found.push(path);
            }
            Ok(_) => {}
        }
    }
}
