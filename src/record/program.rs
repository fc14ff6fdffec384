//! The program of a segment: all data that is needed to make its engine again, and the process in
//! which it ran.
//!
//! The daemon fills it in; `segment` puts it at the head of a segment; `replay` passes it to a
//! caller that can load files. It contains only texts: nothing here reads a ladder.

use super::bytes::{ByteSource, put_number, put_text};
use super::zip::{packed, unpacked};

/// The maximum number of bytes of a program before packing.
const PROGRAM_BYTES_MAX: usize = 1 << 28;

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
    /// Its text.
    pub text: String,
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

    /// Reads a program that fills all of the packed `bytes`.
    pub(super) fn read(bytes: &[u8]) -> Option<RecordedProgram> {
        let bytes = unpacked(bytes, PROGRAM_BYTES_MAX)?;
        let mut bytes = ByteSource(&bytes);
        let version = bytes.text()?;
        let process_start_ns = bytes.i64()?;
        let generation = bytes.small()?;
        let (source, hash) = (bytes.text()?, bytes.text()?);
        let mut files = Vec::new();
        for _ in 0..bytes.number()? {
            files.push(RecordedFile { name: bytes.text()?, text: bytes.text()? });
        }
        let program =
            RecordedProgram { version, process_start_ns, generation, source, hash, files };
        bytes.0.is_empty().then_some(program)
    }
}
