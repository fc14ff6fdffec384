//! A file of a project: its text, and the data that an editor needs about it.
//!
//! `project` makes a new one for each version of a text; all requests about the file share it.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lsp_types::{Position, Range as Place};

use super::lines::{ColumnUnit, LineIndex};
use super::outline::Outline;
use super::outline_reader::read;
use super::slots::FileKind;
use super::words::FileWords;

/// One version of a file.
#[derive(Debug)]
pub(super) struct EditorFile {
    /// Its path; for a file of the library its name, such as `lib:pid`.
    pub path: PathBuf,
    /// Its text.
    pub text: Arc<str>,
    /// Its kind.
    pub kind: FileKind,
    /// What it contains.
    pub outline: Outline,
    /// The names in it.
    pub words: FileWords,
    lines: LineIndex,
    columns: ColumnUnit,
}

/// A file of a project.
#[derive(Clone, Copy, Debug)]
pub(super) struct NumberedFile<'f> {
    /// Its number in the project.
    pub number: usize,
    /// The file.
    pub file: &'f EditorFile,
}

impl EditorFile {
    /// Reads a text.
    pub fn new(path: &Path, text: Arc<str>, columns: ColumnUnit) -> EditorFile {
        let outline = read(&text);
        let kind = FileKind::of(&path.to_string_lossy(), &outline);
        let words = FileWords::of(&text, &outline, kind);
        let lines = LineIndex::of(&text);
        EditorFile { path: path.to_owned(), text, kind, outline, words, lines, columns }
    }

    /// The same file with a new text.
    pub fn with_text(&self, text: Arc<str>) -> EditorFile {
        EditorFile::new(&self.path, text, self.columns)
    }

    /// The byte at a position.
    pub fn offset(&self, position: Position) -> usize {
        self.lines.offset(&self.text, self.columns, position)
    }

    /// The byte at a line and a character of the line, both counted from 1.
    pub fn offset_of(&self, line: u32, column: u32) -> usize {
        let line = self.lines.span(&self.text, (line as usize).saturating_sub(1));
        let before = self.slice(line.clone()).chars().take((column as usize).saturating_sub(1));
        line.start + before.map(char::len_utf8).sum::<usize>()
    }

    /// The place of some bytes.
    pub fn place(&self, range: Range<usize>) -> Place {
        self.lines.place(&self.text, self.columns, range)
    }

    /// The bytes of the line that contains a byte, without the line end.
    pub fn line(&self, offset: usize) -> Range<usize> {
        self.lines.span(&self.text, self.lines.line(offset))
    }

    /// The first value of the pair with this path in an object, without quotes.
    pub fn value(&self, object: usize, keys: &[&str]) -> Option<&str> {
        self.outline.value(object, keys).map(|value| self.slice(value.inner.clone()))
    }

    /// A part of the text.
    pub fn slice(&self, range: Range<usize>) -> &str {
        self.text.get(range).unwrap_or_default()
    }
}
