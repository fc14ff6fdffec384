//! The chain of the audit trail: each of its lines has a link, which is made of the link before it
//! and of the line itself. A line that is changed, removed or inserted breaks the chain.
//!
//! The thread that writes the log adds a link to each line of the trail, and keeps the newest one
//! in a small file, so that the next start goes on behind it. `rungd audit --verify` makes the
//! links again. Whoever may write both the log and that file can make a whole new chain: only a
//! copy of a link elsewhere shows that.

use std::fmt::{self, Write as _};
use std::fs::{File, OpenOptions};
use std::io::{self, Read as _};
use std::os::unix::fs::{FileExt as _, OpenOptionsExt as _};
use std::path::Path;

use rustix::fs::{FlockOperation, flock};

/// The most bytes of the file that are read.
const FILE_BYTES_MAX: u64 = 256;

/// A link: the number of a line of the trail, from 1, and a hash of all lines up to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ChainLink {
    pub number: u64,
    hash: [u8; 32],
}

impl ChainLink {
    /// The link before the first line.
    pub const NONE: ChainLink = ChainLink { number: 0, hash: [0; 32] };

    /// The link of the line behind this one: SHA-256 of this link's hash, the number (eight bytes,
    /// the greatest first) and the line.
    pub fn next(&self, line: &[u8]) -> ChainLink {
        let number = self.number.saturating_add(1);
        let bytes = [&self.hash[..], &number.to_be_bytes(), line].concat();
        ChainLink { number, hash: hmac_sha256::Hash::hash(&bytes) }
    }

    /// Reads `12:3f9a…`, 64 hexadecimal digits in small letters.
    pub fn parse(text: &str) -> Option<ChainLink> {
        let (number, digits) = text.split_once(':')?;
        let is_hex = digits.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
        if digits.len() != 64 || !is_hex || !number.bytes().all(|byte| byte.is_ascii_digit()) {
            return None;
        }
        let mut hash = [0; 32];
        for (byte, at) in hash.iter_mut().zip((0..64).step_by(2)) {
            *byte = u8::from_str_radix(&digits[at..at + 2], 16).ok()?;
        }
        Some(ChainLink { number: number.parse().ok()?, hash })
    }
}

impl fmt::Display for ChainLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut digits = String::new();
        self.hash.iter().try_for_each(|byte| write!(digits, "{byte:02x}"))?;
        write!(f, "{}:{digits}", self.number)
    }
}

/// How a line has its link, which is always at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChainedForm {
    /// ` chain=…`, behind the whole line.
    Text,
    /// A last member of the object.
    Json,
    /// ` chain=…` behind the line without its priority; a field of its own in an entry.
    Journal,
}

/// The text in front of a link at the end of a line.
pub(super) const TEXT_LINK: &str = " chain=";
pub(super) const JSON_LINK: &str = ",\"chain\":\"";

impl ChainedForm {
    /// The part of a line for which the link stands: without the end of the line, a priority, and
    /// the end of the object.
    fn covered(self, line: &[u8]) -> &[u8] {
        let line = line.strip_suffix(b"\n").unwrap_or(line);
        match self {
            ChainedForm::Text => line,
            ChainedForm::Json => line.strip_suffix(b"}").unwrap_or(line),
            ChainedForm::Journal => match line.iter().position(|byte| *byte == b'>') {
                Some(at) if line.starts_with(b"<") => &line[at + 1..],
                _ => line,
            },
        }
    }

    /// Adds a link to a line.
    fn add(self, line: &mut Vec<u8>, link: ChainLink) {
        let end = match self {
            ChainedForm::Text | ChainedForm::Journal => format!("{TEXT_LINK}{link}\n"),
            ChainedForm::Json => format!("{JSON_LINK}{link}\"}}\n"),
        };
        let end_bytes = if self == ChainedForm::Json { 2 } else { 1 };
        line.truncate(line.len().saturating_sub(end_bytes));
        line.extend(end.into_bytes());
    }
}

/// A chain that goes on, and the file with its newest link.
#[derive(Debug)]
pub(super) struct LogChain {
    file: File,
    last: ChainLink,
    /// Whether the newest link is not on the disk yet.
    is_dirty: bool,
}

/// What the file of a chain had at the start.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum ChainBegin {
    /// Nothing: the chain begins.
    New,
    /// The chain goes on behind this link.
    Behind(ChainLink),
    /// Something else: a new chain begins.
    Damaged,
}

impl LogChain {
    /// Opens the file of a chain, or makes it. It stays locked.
    ///
    /// # Errors
    /// It cannot be read and written, or a second process has it.
    pub fn open(path: &Path) -> io::Result<(LogChain, ChainBegin)> {
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false).mode(0o600);
        let mut file = options.custom_flags(libc::O_NONBLOCK).open(path)?;
        if !file.metadata()?.is_file() {
            return Err(io::Error::other("it is no regular file"));
        }
        flock(&file, FlockOperation::NonBlockingLockExclusive)
            .map_err(|_| io::Error::other("a second rungd writes a log with this chain"))?;
        let mut text = String::new();
        let is_text = file.by_ref().take(FILE_BYTES_MAX).read_to_string(&mut text).is_ok();
        let (last, begin) = match ChainLink::parse(text.trim_end()) {
            Some(link) => (link, ChainBegin::Behind(link)),
            None if is_text && text.is_empty() => (ChainLink::NONE, ChainBegin::New),
            None => (ChainLink::NONE, ChainBegin::Damaged),
        };
        Ok((LogChain { file, last, is_dirty: false }, begin))
    }

    /// A line with its link, and an entry for the journal with it, if there is one. The chain goes
    /// on behind it only once it is [`kept`](LogChain::keep).
    pub fn chained(&self, form: ChainedForm, line: &[u8], entry: &[u8]) -> ChainedLine {
        let link = self.last.next(form.covered(line));
        let (mut line, mut entry) = (line.to_vec(), entry.to_vec());
        form.add(&mut line, link);
        if !entry.is_empty() {
            entry.extend(format!("RUNGD_CHAIN={link}\n").into_bytes());
        }
        ChainedLine { link, line, entry }
    }

    /// Goes on behind a line that has been written.
    ///
    /// # Errors
    /// The file cannot be written; the chain goes on nevertheless.
    pub fn keep(&mut self, link: ChainLink) -> io::Result<()> {
        (self.last, self.is_dirty) = (link, true);
        // A number never gets shorter, so nothing of the old text stays behind the new one, except
        // behind a text that was no link.
        let text = format!("{link}\n");
        self.file.write_all_at(text.as_bytes(), 0)?;
        self.file.set_len(text.len() as u64)
    }

    /// Whether the newest link is on the disk.
    #[cfg(test)]
    pub fn is_synced(&self) -> bool {
        !self.is_dirty
    }

    /// Writes the newest link to the disk.
    ///
    /// # Errors
    /// The disk fails.
    pub fn sync(&mut self) -> io::Result<()> {
        if std::mem::take(&mut self.is_dirty) { self.file.sync_data() } else { Ok(()) }
    }
}

/// A line with its link.
pub(super) struct ChainedLine {
    pub link: ChainLink,
    pub line: Vec<u8>,
    pub entry: Vec<u8>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(test: &str) -> std::path::PathBuf {
        let path = std::env::temp_dir().join(format!("rungd-chain-{test}-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        path
    }

    #[test]
    fn a_link_is_made_of_the_link_before_it_and_the_line() {
        let one = ChainLink::NONE.next(b"one");
        assert_eq!(ChainLink::parse(&one.to_string()), Some(one));
        assert!(one.to_string().starts_with("1:"));
        assert_ne!(one.next(b"two"), ChainLink::NONE.next(b"other").next(b"two"));
        assert_ne!(one.next(b"two"), one.next(b"Two"));
        for wrong in ["", "1", "1:ab", "x:y", &format!("1:{}", "A".repeat(64)), "-1:"] {
            assert_eq!(ChainLink::parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_link_stands_at_the_end_of_a_line_in_each_form() {
        let file = path("forms");
        let chain = LogChain::open(&file).unwrap().0;
        let link = |text: &[u8]| ChainLink::NONE.next(text);
        let shown = |form, line: &str, entry: &str| {
            let ChainedLine { line, entry, .. } =
                chain.chained(form, line.as_bytes(), entry.as_bytes());
            [line, entry].map(|bytes| String::from_utf8(bytes).unwrap())
        };
        let [text, _] = shown(ChainedForm::Text, "a who=b\n", "");
        assert_eq!(text, format!("a who=b chain={}\n", link(b"a who=b")));
        let [json, _] = shown(ChainedForm::Json, "{\"a\":1}\n", "");
        assert_eq!(json, format!("{{\"a\":1,\"chain\":\"{}\"}}\n", link(b"{\"a\":1")));
        let [line, entry] = shown(ChainedForm::Journal, "<6>a\n", "MESSAGE=a\n");
        assert_eq!(line, format!("<6>a chain={}\n", link(b"a")));
        assert_eq!(entry, format!("MESSAGE=a\nRUNGD_CHAIN={}\n", link(b"a")));
        let _ = std::fs::remove_file(file);
    }

    #[test]
    fn the_next_start_goes_on_behind_the_newest_link_and_only_one_process_has_the_chain() {
        let file = path("start");
        let (mut chain, begin) = LogChain::open(&file).unwrap();
        assert_eq!(begin, ChainBegin::New);
        assert!(LogChain::open(&file).unwrap_err().to_string().contains("a second rungd"));
        let link = chain.chained(ChainedForm::Text, b"one\n", b"").link;
        chain.keep(link).and_then(|()| chain.sync()).unwrap();
        drop(chain);
        assert_eq!(LogChain::open(&file).unwrap().1, ChainBegin::Behind(link));
        for damaged in ["nonsense", "1:ab\n", "\u{fffd}"] {
            std::fs::write(&file, damaged).unwrap();
            assert_eq!(LogChain::open(&file).unwrap().1, ChainBegin::Damaged, "{damaged}");
        }
        std::fs::write(&file, [0xff; 300]).unwrap();
        let (mut chain, begin) = LogChain::open(&file).unwrap();
        assert_eq!(begin, ChainBegin::Damaged);
        chain.keep(link).unwrap();
        assert_eq!(std::fs::read_to_string(&file).unwrap(), format!("{link}\n"));
        let _ = std::fs::remove_file(file);
    }
}
