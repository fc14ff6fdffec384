//! Converts paths to the URIs of the protocol, and back.
//!
//! A file of the library is not on disk. `scratch` writes its text to a file that an editor can
//! show. The name of that file contains the name of the library file, so every request about it is
//! answered as a request about the library file.

use std::fmt::Write as _;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use lsp_types::Uri;

use rungd_config::load::{identity, library};
use rungd_language::source::file_kind::LIBRARY;

/// The prefix of the names of the folders that the server creates.
pub(super) const SCRATCH: &str = "rungd-editor-files-";
/// The prefix of the names of the files that show a file of the library.
const SHOWN: &str = "lib-";

/// The name of the file that shows a file of the library.
pub(super) fn shown_name(name: &str) -> String {
    format!("{SHOWN}{name}.toml")
}

/// The name of the library file that a file shows.
fn shown(path: &Path) -> Option<PathBuf> {
    let folder = path.parent()?.file_name()?.to_str()?;
    let name = path.file_name()?.to_str()?.strip_prefix(SHOWN)?.strip_suffix(".toml")?;
    let name = format!("{LIBRARY}{name}");
    let is_known = folder.starts_with(SCRATCH) && library::named(&name)?.is_ok();
    is_known.then(|| PathBuf::from(name))
}

/// The identity of the file that a URI names; `None` if the URI names no file.
pub(super) fn path_of(uri: &Uri) -> Option<PathBuf> {
    let text = uri.as_str().strip_prefix("file://")?;
    let path = text.strip_prefix("localhost").unwrap_or(text);
    if !path.starts_with('/') {
        return None;
    }
    let mut bytes = Vec::new();
    let mut rest = path.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let high = char::from(rest.next()?).to_digit(16)?;
                u8::try_from(high * 16 + char::from(rest.next()?).to_digit(16)?).ok()?
            }
            byte => byte,
        });
    }
    let path = identity(Path::new(&std::ffi::OsString::from_vec(bytes)));
    Some(shown(&path).unwrap_or(path))
}

/// The URI of a file; `None` for a file of the library, which is not on disk.
pub(super) fn uri_of(path: &Path) -> Option<Uri> {
    if !path.is_absolute() {
        return None;
    }
    let mut text = "file://".to_owned();
    for byte in path.as_os_str().as_bytes() {
        match byte {
            b'/' | b'-' | b'_' | b'.' | b'~' => text.push(char::from(*byte)),
            byte if byte.is_ascii_alphanumeric() => text.push(char::from(*byte)),
            byte => drop(write!(text, "%{byte:02X}")),
        }
    }
    Uri::from_str(&text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_shows_a_library_file_maps_to_the_library() {
        let path = |text: &str| path_of(&Uri::from_str(text).unwrap()).unwrap();
        assert_eq!(path("file:///tmp/rungd-editor-files-7-0/lib-pid.toml"), Path::new("lib:pid"));
        for own in ["/home/me/lib-pid.toml", "/tmp/rungd-editor-files-7-0/lib-none.toml"] {
            assert_eq!(path(&format!("file://{own}")), Path::new(own));
        }
    }

    #[test]
    fn paths_convert_to_uris_and_back() {
        let path = Path::new("/no such/gr\u{fc}n%1/a.toml");
        let uri = uri_of(path).unwrap();
        assert_eq!(uri.as_str(), "file:///no%20such/gr%C3%BCn%251/a.toml");
        assert_eq!(path_of(&uri).unwrap(), path);
        assert!(uri_of(Path::new("lib:pid")).is_none());
        for wrong in ["untitled:Untitled-1", "file://host/a", "file:///a%2", "file:///a%zz"] {
            assert!(Uri::from_str(wrong).ok().and_then(|uri| path_of(&uri)).is_none(), "{wrong}");
        }
    }
}
