//! The files of a program, as `regular_file` reads them, or as an editor has them open.
//!
//! Two paths of the same file have the same [`identity`].

use std::collections::HashMap;
use std::io::Result;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use rungd_base::regular_file::read_bytes;
pub(super) use rungd_base::regular_file::read_regular;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::span::{FileId, Span};

/// The identity of a file, which is the same for all spellings of its path. A file that does not
/// exist yet has one too.
pub fn identity(path: &Path) -> PathBuf {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let folder = parent.unwrap_or(Path::new(".")).canonicalize();
    let made = || Some(folder.ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(made).unwrap_or_else(|| path.to_owned())
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
    pub fn read(&self, path: &Path) -> Result<Vec<u8>> {
        let open = if self.0.is_empty() { None } else { self.0.get(&identity(path)) };
        open.map_or_else(|| read_regular(path), |text| Ok(text.as_bytes().to_vec()))
    }
}

/// Whether everybody may read a file. The permissions of the file and of its folders decide.
/// Everybody may read a file of the library.
pub fn may_all_read(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    if path.to_str().is_some_and(|name| super::library::named(name).is_some()) {
        return true;
    }
    let Ok(path) = path.canonicalize() else { return false };
    let allows = |path: &Path, bits: u32| {
        std::fs::metadata(path).is_ok_and(|metadata| metadata.permissions().mode() & bits == bits)
    };
    allows(&path, 0o004) && path.ancestors().skip(1).all(|folder| allows(folder, 0o001))
}

/// The text of a file. If it is not UTF-8, replacement characters stand for the invalid bytes, and
/// a finding names the first of them.
pub fn decode(bytes: &[u8], file: FileId) -> (String, Option<Finding>) {
    match std::str::from_utf8(bytes) {
        Ok(text) => (text.to_owned(), None),
        Err(error) => {
            let at = error.valid_up_to() as u32;
            let span = Span { file, start: at, end: at };
            let byte = bytes.get(at as usize).copied().unwrap_or(0);
            let message = format!("the file is not UTF-8 text: byte {at} is 0x{byte:02X}");
            let finding =
                Finding::new(Code::TomlSyntax, span, message).label("here").help(match bytes {
                    [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] => {
                        "save the file as UTF-8; now it is UTF-16"
                    }
                    _ => "save the file as UTF-8; now it may be Latin-1, or not a text",
                });
            (String::from_utf8_lossy(bytes).into_owned(), Some(finding))
        }
    }
}
