//! Opens and reads regular files, up to a size.
//!
//! Reading a FIFO without a writer, a device or a socket could wait without end. So every file that
//! is named in a file or on the command line must be a regular file. A file that the caller of a
//! command has already opened (`/dev/stdin`, `/dev/fd/63` of `<(…)`) may be a pipe. Used by `load`,
//! `web`, `mqtt`, `edge`, `cli` and `record`.

use std::fs::{File, FileType, OpenOptions};
use std::io::{Error, ErrorKind, Read, Result};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

/// The size limit of a file with a program or with data: a file must be smaller than this.
const FILE_BYTES_MAX: u64 = 256 << 20;
/// The size limit of a small file: users, keys, certificates, passwords.
const SMALL_BYTES_MAX: u64 = 4 << 20;

/// The paths of files that the caller opened for this process.
const GIVEN: [&str; 3] = ["/dev/stdin", "/dev/fd/", "/proc/self/fd/"];

/// Opens a regular file for reading, without waiting.
///
/// # Errors
/// The file cannot be opened, or is not a regular file.
pub fn open(path: &Path) -> Result<File> {
    // Checked before opening: opening a device can have an effect on it.
    refuse(std::fs::metadata(path)?.file_type())?;
    let file = OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK).open(path)?;
    // Checked again after opening: a different file may have taken its place.
    refuse(file.metadata()?.file_type())?;
    Ok(file)
}

/// Reads a file that the caller of a command names, 256 MiB at most.
///
/// # Errors
/// The file cannot be read, is larger, or is not a regular file.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    read(opened_or_given(path)?, FILE_BYTES_MAX)
}

/// Reads a small file that the caller of a command names, 4 MiB at most.
///
/// # Errors
/// As [`read_bytes`].
pub fn read_small(path: &Path) -> Result<Vec<u8>> {
    read(opened_or_given(path)?, SMALL_BYTES_MAX)
}

/// Reads a small text that the caller of a command names, 4 MiB at most.
///
/// # Errors
/// As [`read_bytes`], or it is not UTF-8.
pub fn read_small_text(path: &Path) -> Result<String> {
    let not_text = |_| Error::new(ErrorKind::InvalidData, "it is not a text in UTF-8");
    String::from_utf8(read_small(path)?).map_err(not_text)
}

/// Reads a regular file of 256 MiB at most.
///
/// # Errors
/// As [`read_bytes`].
pub fn read_regular(path: &Path) -> Result<Vec<u8>> {
    read(open(path)?, FILE_BYTES_MAX)
}

fn opened_or_given(path: &Path) -> Result<File> {
    let is_given = |given: &&str| path.to_str().is_some_and(|path| path.starts_with(given));
    if GIVEN.iter().any(is_given) { File::open(path) } else { open(path) }
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

fn read(file: File, bytes_max: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(bytes_max).read_to_end(&mut bytes)?;
    if bytes.len() as u64 == bytes_max {
        let message = format!("the file is larger than {} MiB", bytes_max >> 20);
        return Err(Error::new(ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Reader = fn(&Path) -> Result<Vec<u8>>;

    #[test]
    fn only_regular_files_are_read_and_a_pipe_does_not_block() {
        let folder = std::env::temp_dir().join(format!("rungd-regular-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let (file, pipe) = (folder.join("file"), folder.join("pipe"));
        std::fs::write(&file, "text").expect("written");
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RWXU).expect("a pipe");
        assert_eq!(read_bytes(&file).expect("read"), b"text");
        for read in [read_bytes as Reader, read_regular] {
            for (path, what) in [
                (&pipe, "a pipe (FIFO)"),
                (&folder, "a directory"),
                (&"/dev/null".into(), "a device"),
            ] {
                let why = read(path).expect_err("refused").to_string();
                assert!(why.contains(what), "{why}");
            }
        }
        assert_eq!(read(File::open(&file).expect("open"), 5).expect("read"), b"text");
        let why = read(File::open(&file).expect("open"), 4).expect_err("too large");
        assert_eq!(why.kind(), ErrorKind::FileTooLarge);
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}
