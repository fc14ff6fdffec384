//! Creates a file that a command writes: never over an existing one.
//!
//! Used by `record`, whose output could be the recording itself or a ladder, and by `read`.

use std::fs::File;
use std::io::ErrorKind;
use std::path::Path;

use anyhow::{Context, Result, bail};

/// Creates a file that does not exist yet.
///
/// # Errors
/// There is a file already, or the error of the system.
pub(super) fn new_file(path: &Path) -> Result<File> {
    match File::create_new(path) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            bail!("{} is there already: name another file", path.display())
        }
        file => file.with_context(|| path.display().to_string()),
    }
}
