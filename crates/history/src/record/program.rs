//! The program of a segment: all data that is needed to make its engine again, and the process in
//! which it ran.
//!
//! The daemon fills it in; `segment` puts it at the head of a segment; `playback` makes its engine.
//! It contains only texts: nothing here reads a ladder; `program_read` reads the bytes.

use std::sync::Arc;

use super::zip::packed;
use rungd_base::byte_source::{put_number, put_text};

/// A program in a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordedProgram {
    /// The version of rungd that recorded.
    pub version: String,
    /// When its process started, ns since 1970 (UTC). It identifies the process.
    pub process_start_ns: i64,
    /// The number of the program in that process: 0 at the start, one more with every reload.
    pub generation: u32,
    /// How it was loaded: `start`, `reload by root`.
    pub source: String,
    /// The hash of its files, by which the log names the program.
    pub hash: String,
    /// Its files: the controller file first, then the ladder files, as they were loaded.
    pub files: Vec<RecordedFile>,
}

/// A file of a program.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordedFile {
    /// The name under which it was loaded.
    pub name: String,
    /// Its text; empty in a recording of which only the heads were read.
    pub text: Arc<str>,
}

impl RecordedProgram {
    /// The program as packed bytes.
    pub(super) fn write(&self) -> Vec<u8> {
        let mut out = Vec::new();
        put_text(&mut out, &self.version);
        out.extend(self.process_start_ns.to_le_bytes());
        put_number(&mut out, self.generation.into());
        put_text(&mut out, &self.source);
        put_text(&mut out, &self.hash);
        put_number(&mut out, self.files.len() as u64);
        for RecordedFile { name, text } in &self.files {
            put_text(&mut out, name);
            put_text(&mut out, text);
        }
        packed(&out)
    }
}
