//! What an edge node stores across its restarts: the log position up to which a broker has
//! everything, and the number of its last birth.
//!
//! It stores no values, only two small files, each replaced as a whole. A file that cannot be read
//! counts as missing.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use rungd_base::regular_file::read_small_text;
use rungd_client::live::LogPosition;
use rungd_net::sparkplug::Sequence;

/// The files of a node.
#[derive(Debug)]
pub(super) struct NodeCursor {
    dir: Option<PathBuf>,
    kept: Option<LogPosition>,
}

/// A position in the format of its file.
#[derive(Debug, Serialize, Deserialize)]
struct KeptPosition {
    process_start_ns: i64,
    scan: u64,
    unix_ns: i64,
}

const POSITION: &str = "position";
const BIRTH: &str = "bdseq";

impl NodeCursor {
    /// The files in a folder; `None`: nothing is stored.
    pub fn new(dir: Option<PathBuf>) -> NodeCursor {
        NodeCursor { dir, kept: None }
    }

    /// The log position up to which a broker has everything.
    pub fn position(&mut self) -> Option<LogPosition> {
        let text = read_small_text(&self.dir.as_ref()?.join(POSITION)).ok()?;
        let KeptPosition { process_start_ns, scan, unix_ns } = serde_json::from_str(&text).ok()?;
        self.kept = Some(LogPosition { process_start_ns, scan, unix_ns });
        self.kept
    }

    /// The number of the last birth; at a first start, the number before 0.
    pub fn last_birth(&self) -> Sequence {
        let read = |dir: &PathBuf| read_small_text(&dir.join(BIRTH)).ok()?.trim().parse().ok();
        let number = self.dir.as_ref().and_then(read).unwrap_or(255);
        Sequence::of(number).unwrap_or_default()
    }

    /// Stores a position, if it is new.
    ///
    /// # Errors
    /// The system's error.
    pub fn keep(&mut self, position: LogPosition) -> io::Result<()> {
        if self.kept == Some(position) {
            return Ok(());
        }
        let LogPosition { process_start_ns, scan, unix_ns } = position;
        let text = serde_json::to_string(&KeptPosition { process_start_ns, scan, unix_ns })?;
        if let Some(dir) = &self.dir {
            put(dir, POSITION, &text)?;
        }
        self.kept = Some(position);
        Ok(())
    }

    /// Stores the number of a birth.
    ///
    /// # Errors
    /// The system's error.
    pub fn keep_birth(&self, birth: Sequence) -> io::Result<()> {
        let Some(dir) = &self.dir else { return Ok(()) };
        put(dir, BIRTH, &birth.number().to_string())
    }
}

/// Replaces a file as a whole.
fn put(dir: &Path, name: &str, text: &str) -> io::Result<()> {
    let new = dir.join(format!("{name}.new"));
    fs::write(&new, format!("{text}\n"))?;
    fs::rename(new, dir.join(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_saved_position_is_loaded_again() {
        let dir = std::env::temp_dir().join(format!("rungd-cursor-{}", std::process::id()));
        fs::create_dir_all(&dir).expect("a folder");
        let mut cursor = NodeCursor::new(Some(dir.clone()));
        assert_eq!((cursor.position(), cursor.last_birth().next().number()), (None, 0));
        let position = LogPosition { process_start_ns: 5, scan: 7, unix_ns: -1 };
        cursor.keep(position).expect("a file");
        cursor.keep_birth(Sequence::of(9).unwrap_or_default()).expect("a file");
        let mut again = NodeCursor::new(Some(dir.clone()));
        assert_eq!((again.position(), again.last_birth().number()), (Some(position), 9));
        for text in ["", "{", "{\"scan\":-1}", "\u{0}"] {
            fs::write(dir.join(POSITION), text).expect("a file");
            fs::write(dir.join(BIRTH), text).expect("a file");
            assert_eq!((again.position(), again.last_birth().next().number()), (None, 0));
        }
        fs::remove_dir_all(&dir).expect("it is there");
    }
}
