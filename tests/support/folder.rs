//! Temporary folders that are removed at the end. What a test leaves among the system's temporary
//! files makes each later run slower: the editor's server lists the folders above an open file.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// The folder with the list of the tests' running controllers, for `XDG_RUNTIME_DIR`: commands of the
/// user who runs the tests do not find these controllers. The entries of ended ones are removed by
/// the next controller.
pub fn list_of_controllers() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("list-of-controllers");
    let _ = std::fs::create_dir_all(&folder);
    folder
}

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
