//! A settings file of a program beside the controller: its text, its findings, its settings.
//!
//! Called by `edge` and `opcua`, which read their keys.

use std::path::Path;

use rungd_config::load::decode;
use rungd_language::source::finding::{Finding, Severity};
use rungd_language::source::reader::{self, Table};
use rungd_language::source::span::{FileId, SourceFile};

/// The result of reading a settings file.
#[derive(Debug)]
pub struct ReadSettings<S> {
    /// The file.
    pub file: SourceFile,
    /// All findings, in the order of their places.
    pub findings: Vec<Finding>,
    /// The settings; `None` if a finding is an error.
    pub settings: Option<S>,
}

/// Reads a settings file. `path`: the path of the file. `read` reads its keys; paths in the file
/// are relative to the folder that it gets.
pub(crate) fn read_settings<S>(
    path: &Path,
    bytes: &[u8],
    read: impl FnOnce(Table<'_>, &Path) -> S,
) -> ReadSettings<S> {
    let (text, undecoded) = decode(bytes, FileId(0));
    let file = SourceFile { name: path.display().to_string(), text };
    let mut findings: Vec<Finding> = undecoded.into_iter().collect();
    let base = path.parent().unwrap_or(Path::new(""));
    let mut settings = None;
    if findings.is_empty() {
        let (found, more) = reader::document(&file.text, FileId(0), |root| read(root, base));
        findings.extend(more);
        settings = found;
    }
    findings.sort_by_key(|finding| {
        (finding.span.file, finding.span.start, finding.span.end, finding.code)
    });
    let is_refused = findings.iter().any(|finding| finding.severity() == Severity::Error);
    ReadSettings { file, findings, settings: settings.filter(|_| !is_refused) }
}
