//! A cache of the disk, valid until the next change of the workspace: the TOML files of folders,
//! the stamps of files, the identities of paths.
//!
//! `project` queries it at each keystroke, for each open file and each file that it searches. Each
//! folder is read once, and each file is queried once. `workspace` clears the cache at each change.
//! The contents of files are not read here.

use std::collections::HashMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::SystemTime;

use rungd_base::locked::locked;
use rungd_config::load::identity;

/// The maximum number of TOML files that are listed per folder.
const FILES_MAX: usize = 500;

/// Identifies a version of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct FileStamp {
    /// The time of the last change of its text, which a program can set.
    modified: Option<SystemTime>,
    /// The time of the last change of the file, which no program can set: seconds, nanoseconds.
    changed: (i64, i64),
    size: u64,
    /// A file that takes the place of another one has a different number.
    inode: u64,
}

impl FileStamp {
    /// The stamp of a file on disk; `None` if the file does not exist.
    pub fn of(path: &Path) -> Option<FileStamp> {
        let about = std::fs::metadata(path).ok()?;
        Some(FileStamp {
            modified: about.modified().ok(),
            changed: (about.ctime(), about.ctime_nsec()),
            size: about.len(),
            inode: about.ino(),
        })
    }
}

/// Cached answers by path.
type ByPath<V> = Mutex<HashMap<PathBuf, V>>;

/// The answers of the system since the last change.
#[derive(Debug, Default)]
pub(super) struct DiskView {
    folders: ByPath<Arc<[PathBuf]>>,
    stamps: ByPath<Option<FileStamp>>,
    identities: ByPath<PathBuf>,
}

impl DiskView {
    /// The TOML files of a folder, sorted; empty if the folder cannot be read.
    pub fn toml_files(&self, folder: &Path) -> Arc<[PathBuf]> {
        once(&self.folders, folder, || listed(folder).into())
    }

    /// The stamp of a file; `None` if the file does not exist.
    pub fn stamp(&self, path: &Path) -> Option<FileStamp> {
        once(&self.stamps, path, || FileStamp::of(path))
    }

    /// Whether the answers of this view about folders and stamps are those of the disk now.
    pub fn is_present(&self) -> bool {
        let (stamps, folders) = (locked(&self.stamps), locked(&self.folders));
        stamps.iter().all(|(path, stamp)| FileStamp::of(path) == *stamp)
            && folders.iter().all(|(folder, files)| listed(folder) == **files)
    }

    /// The identity of a file, the same for all spellings of its path.
    pub fn identity(&self, path: &Path) -> PathBuf {
        once(&self.identities, path, || identity(path))
    }
}

fn listed(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let is_toml = |path: &PathBuf| path.extension().is_some_and(|end| end == "toml");
    let mut paths: Vec<PathBuf> = paths.filter(is_toml).take(FILES_MAX).collect();
    paths.sort_unstable();
    paths
}

/// Returns the cached answer; without one, asks the system and caches the answer.
fn once<V: Clone>(known: &ByPath<V>, path: &Path, ask: impl FnOnce() -> V) -> V {
    let mut known = locked(known);
    if let Some(answer) = known.get(path) {
        return answer.clone();
    }
    let answer = ask();
    known.insert(path.to_owned(), answer.clone());
    answer
}

#[cfg(test)]
mod tests {
    use super::super::scratch::Scratch;
    use super::*;

    #[test]
    fn each_view_reads_the_disk_only_once() {
        let scratch = Scratch::default();
        let other = scratch.write("a.txt", b"a").unwrap();
        let (folder, path) = (other.parent().unwrap(), other.with_file_name("a.toml"));
        let view = DiskView::default();
        assert_eq!((view.toml_files(folder).len(), view.stamp(&path)), (0, None));
        scratch.write("a.toml", b"a").unwrap();
        assert_eq!((view.toml_files(folder).len(), view.stamp(&path)), (0, None));
        let view = DiskView::default();
        assert_eq!(view.toml_files(folder).to_vec(), [path.as_path()]);
        assert_eq!(view.stamp(&path).map(|stamp| stamp.size), Some(1));
    }
}
