//! Paths as the URIs of the protocol, and back.

use std::fmt::Write as _;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use lsp_types::Uri;

use crate::load::identity;

/// The identity of the file that a URI names; `None` for one that is no file's.
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
    Some(identity(Path::new(&std::ffi::OsString::from_vec(bytes))))
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
    fn paths_go_there_and_back() {
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
