//! Reads the bytes of regular files, 256 MiB at most.
//!
//! Reading a FIFO without a writer, a device or a socket could wait without end. So the controller
//! file of the daemon, and every file that is named in a file, must be a regular file. A file that
//! the caller of a command has already opened (`/dev/stdin`, `/dev/fd/63` of `<(…)`) may be a pipe.
//! Two paths of the same file have the same [`identity`].

use std::collections::HashMap;
use std::fs::{File, FileType, OpenOptions};
use std::io::{Error, ErrorKind, Read, Result};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The size limit: a file must be smaller than this.
const FILE_BYTES_MAX: u64 = 256 << 20;

/// The paths of files that the caller opened for this process.
const GIVEN: [&str; 3] = ["/dev/stdin", "/dev/fd/", "/proc/self/fd/"];

/// The identity of a file, which is the same for all spellings of its path. A file that does not
/// exist yet has one too.
pub(crate) fn identity(path: &Path) -> PathBuf {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let folder = parent.unwrap_or(Path::new(".")).canonicalize();
    let made = || Some(folder.ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(made).unwrap_or_else(|| path.to_owned())
}

/// Reads a file that the caller of a command names, 256 MiB at most.
///
/// # Errors
/// The file cannot be read, is larger, or is not a regular file.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    if GIVEN.iter().any(|given| path.to_str().is_some_and(|path| path.starts_with(given))) {
        return read(File::open(path)?);
    }
    read_regular(path)
}

/// The texts that an editor has open, by the identities of their files, in place of the files on
/// disk. Without any, all files are read from disk.
#[derive(Clone, Debug, Default)]
pub struct OpenTexts(Arc<HashMap<PathBuf, Arc<str>>>);

impl OpenTexts {
    /// Makes the set of these open texts.
    pub fn new(texts: impl IntoIterator<Item = (PathBuf, Arc<str>)>) -> OpenTexts {
        OpenTexts(Arc::new(texts.into_iter().collect()))
    }

    /// The same texts, but with `text` for one file.
    pub fn with(&self, path: &Path, text: Arc<str>) -> OpenTexts {
        let mut texts = HashMap::clone(&self.0);
        texts.insert(path.to_owned(), text);
        OpenTexts(Arc::new(texts))
    }

    /// The bytes of the open text of a file; without an open text, of the regular file on disk.
    ///
    /// # Errors
    /// As [`read_bytes`].
    pub(crate) fn read(&self, path: &Path) -> Result<Vec<u8>> {
        let open = if self.0.is_empty() { None } else { self.0.get(&identity(path)) };
        open.map_or_else(|| read_regular(path), |text| Ok(text.as_bytes().to_vec()))
    }
}

/// Reads a regular file of 256 MiB at most.
///
/// # Errors
/// As [`read_bytes`].
pub(super) fn read_regular(path: &Path) -> Result<Vec<u8>> {
    // Checked before opening: opening a device can have an effect on it.
    refuse(std::fs::metadata(path)?.file_type())?;
    let file = OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK).open(path)?;
    // Checked again after opening: a different file may have taken its place.
    refuse(file.metadata()?.file_type())?;
    read(file)
}

fn refuse(kind: FileType) -> Result<()> {
    let what = match kind {
        kind if kind.is_file() => return Ok(()),
        kind if kind.is_dir() => "a directory",
        kind if kind.is_fifo() => "a pipe (FIFO)",
        kind if kind.is_socket() => "a socket",
        _ => "a device",
    };
    Err(Error::new(ErrorKind::InvalidInput, format!("it is {what}, not a regular file")))
}

fn read(file: File) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(FILE_BYTES_MAX).read_to_end(&mut bytes)?;
    if bytes.len() as u64 == FILE_BYTES_MAX {
        let message = "the file is larger than 256 MiB";
        return Err(Error::new(ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// Whether everybody may read a file. The permissions of the file and of its folders decide.
/// Everybody may read a file of the library.
pub(crate) fn may_all_read(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    if path.to_str().is_some_and(|name| super::library::named(name).is_some()) {
        return true;
    }
    let Ok(path) = path.canonicalize() else { return false };
    let allows = |path: &Path, bits: u32| {
        std::fs::metadata(path).is_ok_and(|of| of.permissions().mode() & bits == bits)
    };
    allows(&path, 0o004) && path.ancestors().skip(1).all(|folder| allows(folder, 0o001))
}
