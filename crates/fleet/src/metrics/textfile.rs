//! The metrics as a file, for a collector of text files, which never sees an incomplete file.

use std::path::Path;

use anyhow::{Context as _, Result};

use rungd_base::whole_file::{self, FileRights};

/// Writes a file that every user may read. Only a regular file is replaced: a link could be a
/// different user's, and a device is everybody's.
///
/// # Errors
/// The system's error; the previous file is not changed.
pub(super) fn write(path: &Path, text: &str) -> Result<()> {
    let written = whole_file::replace(path, text.as_bytes(), FileRights::Given(0o644));
    written.with_context(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    #[test]
    fn a_textfile_is_replaced_whole_without_temporary_files() {
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
        let device = folder.join("null");
        std::os::unix::fs::symlink("/dev/null", &device).expect("a link");
        for other in [device.as_path(), Path::new("/dev/null")] {
            let refused = format!("{:#}", write(other, "x").expect_err("refused"));
            assert!(refused.contains("only a regular file is replaced"), "{refused}");
        }
        assert_eq!(fs::read_dir(&folder).expect("it is there").count(), 3);
        fs::remove_dir_all(&folder).expect("it was made here");
    }
}
