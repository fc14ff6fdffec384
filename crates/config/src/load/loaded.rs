//! The result of a load, and what has been found so far.
//!
//! Filled by `load` and the files beside this one. No file is read here, and no rule applied.

use std::ops::Range;

use super::files::{OpenTexts, decode};
use super::sides::LoadedSide;
use crate::controller::Controller;
use rungd_base::progress::Progress;
use rungd_language::resolve::program::Program;
use rungd_language::source::finding::{Finding, Severity};
use rungd_language::source::lost::LostTexts;
use rungd_language::source::span::{FileId, SourceFile};

/// The result of a load. It has a program and a controller exactly if no finding is an error.
#[derive(Debug, Default)]
pub struct Loaded {
    /// All files that were read, by their numbers.
    pub files: Vec<SourceFile>,
    /// All findings, in order of place.
    pub findings: Vec<Finding>,
    /// The program, resolved and checked by the rules.
    pub program: Option<Program>,
    /// The controller file's settings, if one was loaded.
    pub controller: Option<Controller>,
    /// The texts that could not be read in files that are not TOML as a whole.
    pub(super) lost: LostTexts,
    pub(super) progress: Progress,
    /// The texts that replace files on disk.
    pub(super) texts: OpenTexts,
    /// The number of the program's ladder files: they follow a controller file. The files of the
    /// ladders beside it are behind them.
    pub ladders: usize,
    /// The ladders beside the program that are not judged yet.
    pub(super) sides: Vec<LoadedSide>,
}

impl Loaded {
    /// Adds a file and returns its number.
    pub(super) fn add(&mut self, name: String, bytes: &[u8]) -> FileId {
        let id = FileId(self.files.len() as u32);
        let (text, finding) = decode(bytes, id);
        self.findings.extend(finding);
        self.files.push(SourceFile { name, text });
        id
    }

    /// Whether a file that is not UTF-8 is among these: it would only cause further findings with
    /// the same reason.
    pub(super) fn has_finding_in(&self, files: &Range<usize>) -> bool {
        self.findings.iter().any(|finding| files.contains(&(finding.span.file.0 as usize)))
    }

    pub(super) fn has_error(&self) -> bool {
        has_error(&self.findings)
    }

    /// Keeps only findings that missing parts of the files do not cause, in order of place.
    pub(super) fn put_in_order(&mut self) {
        self.lost.keep_sure(&mut self.findings);
        self.findings.sort_by_key(|f| (f.span.file, f.span.start, f.span.end, f.code));
    }

    /// Whether nothing may be executed.
    pub(super) fn is_refused(&self) -> bool {
        self.has_error() || !self.lost.is_empty() || self.progress.is_over()
    }
}

/// Whether a finding is an error.
pub(super) fn has_error(findings: &[Finding]) -> bool {
    findings.iter().any(|finding| finding.severity() == Severity::Error)
}
