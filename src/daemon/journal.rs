//! The journal's own protocol: an entry is one datagram of fields.
//!
//! `log_form` fills a [`JournalEntry`]; `log_queue` sends it through a [`Socket`] from its own
//! thread. The socket never blocks: while journald does not read, only the queue's thread waits. An
//! entry that the socket cannot take goes to standard error as a line.

use std::io;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};

/// The socket on which journald listens.
pub(super) const SOCKET: &str = "/run/systemd/journal/socket";

/// journald's limit for the length of a field's name.
const NAME_MAX: usize = 64;

/// An entry under construction.
#[derive(Default)]
pub(super) struct JournalEntry(Vec<u8>);

impl JournalEntry {
    /// Adds a field. Each character of its name other than a letter, a digit or `_` becomes `_`.
    pub fn field(&mut self, name: &str, value: &str) {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
        let name: String = name.chars().take(NAME_MAX).map(plain).collect();
        self.0.extend(name.as_bytes());
        if value.contains('\n') {
            self.0.push(b'\n');
            self.0.extend((value.len() as u64).to_le_bytes());
        } else {
            self.0.push(b'=');
        }
        self.0.extend(value.as_bytes());
        self.0.push(b'\n');
    }

    pub fn bytes(self) -> Vec<u8> {
        self.0
    }
}

/// A socket that sends to journald.
pub(super) struct Socket {
    socket: UnixDatagram,
    path: PathBuf,
}

impl Socket {
    /// `None` if journald's socket does not exist.
    pub fn new(path: &Path) -> Option<Socket> {
        if !path.exists() {
            return None;
        }
        let socket = UnixDatagram::unbound().ok()?;
        socket.set_nonblocking(true).ok()?;
        Some(Socket { socket, path: path.to_owned() })
    }

    /// Sends an entry. The path is looked up each time: journald may have been restarted.
    ///
    /// # Errors
    /// `WouldBlock` while journald does not read; any other error: this entry cannot be sent.
    pub fn send(&self, entry: &[u8]) -> io::Result<()> {
        self.socket.send_to(entry, &self.path).map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(fields: &[(&str, &str)]) -> Vec<u8> {
        let mut entry = JournalEntry::default();
        fields.iter().for_each(|(name, value)| entry.field(name, value));
        entry.bytes()
    }

    #[test]
    fn a_one_line_value_is_written_after_an_equals_sign() {
        let bytes = encoded(&[("MESSAGE", "a=b"), ("RUNGD_TAG", "")]);
        assert_eq!(bytes, b"MESSAGE=a=b\nRUNGD_TAG=\n");
    }

    #[test]
    fn a_multi_line_value_is_written_after_its_length() {
        let bytes = encoded(&[("RUNGD_WHY", "a\nMESSAGE=b"), ("PRIORITY", "6")]);
        assert_eq!(bytes, b"RUNGD_WHY\n\x0b\0\0\0\0\0\0\0a\nMESSAGE=b\nPRIORITY=6\n");
    }

    #[test]
    fn field_names_are_converted_for_journald() {
        assert_eq!(encoded(&[("RUNGD_a.b-c", "1")]), b"RUNGD_A_B_C=1\n");
        let long = encoded(&[(&"X".repeat(100), "1")]);
        assert_eq!(long.len(), NAME_MAX + 3);
    }

    #[test]
    fn no_socket_is_opened_without_a_listener() {
        assert!(Socket::new(Path::new("/nonexistent/socket")).is_none());
    }
}
