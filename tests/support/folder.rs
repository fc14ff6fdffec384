//! Temporary folders that are removed at the end. What a test leaves among the system's temporary
//! files makes each later run slower: the editor's server lists the folders above an open file.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// An empty folder that is removed, with all that it contains, when this value is dropped.
pub struct TestFolder(PathBuf);

impl TestFolder {
    /// Makes a folder `rungd-OF-PROCESS-NUMBER` below the system's temporary files.
    pub fn new(of: &str) -> TestFolder {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("rungd-{of}-{}-{number}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        TestFolder(path.canonicalize().unwrap())
    }

    /// The folder's path, without links.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for TestFolder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
