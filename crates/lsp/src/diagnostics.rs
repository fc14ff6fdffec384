//! Findings in the form of the protocol: one diagnostic for each, with the same code, place and
//! words.
//!
//! A file that several roots name has the findings of all these roots, each finding once.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use lsp_types::{
    Diagnostic, DiagnosticRelatedInformation, DiagnosticSeverity, DiagnosticTag, Location,
    NumberOrString,
};

use super::judge::Judgement;
use super::lines::{ColumnUnit, LineIndex};
use super::uri::uri_of;
use super::workspace::Workspace;
use rungd_config::load::identity;
use rungd_language::source::finding::{Code, Finding, Severity};
use rungd_language::source::span::{SourceFile, Span};

/// The maximum number of diagnostics of a file.
const SHOWN_MAX: usize = 1000;

/// The source of each diagnostic: the name of the program.
pub(super) const SOURCE: &str = "rungd";

/// The text of a diagnostic: the message, the label and the help of its finding.
pub(super) fn message_text(finding: &Finding) -> String {
    let mut text = finding.message.clone();
    if !finding.label.is_empty() {
        text.push_str(&format!(" ({})", finding.label));
    }
    if let Some(help) = finding.help_text() {
        text.push_str(&format!("\nhelp: {help}"));
    }
    text
}

/// The path of a judged file.
pub(super) fn path_of(file: &SourceFile) -> PathBuf {
    match file.name.starts_with(rungd_language::source::file_kind::LIBRARY) {
        true => PathBuf::from(&file.name),
        false => identity(Path::new(&file.name)),
    }
}

/// The diagnostics of all files that were judged, by path; empty for a file without findings.
pub(super) fn all(workspace: &Workspace) -> BTreeMap<PathBuf, Vec<Diagnostic>> {
    // A file that no longer belongs to rungd gets an empty list.
    let of_others = workspace.library.shown().filter(|path| workspace.roots_of(path).is_empty());
    let mut shown: BTreeMap<PathBuf, Vec<Diagnostic>> =
        of_others.map(|path| (path.clone(), Vec::new())).collect();
    let mut told: BTreeMap<(PathBuf, u32, u32, Code, &str), usize> = BTreeMap::new();
    for (root, judgement) in workspace.judged.values().enumerate() {
        let files = JudgedPlaces::of(workspace, judgement);
        for path in &files.paths {
            shown.entry(path.clone()).or_default();
        }
        for finding in &judgement.findings {
            let Span { file, start, end } = finding.span;
            let Some(path) = files.paths.get(file.0 as usize) else { continue };
            let findings = shown.entry(path.clone()).or_default();
            let key = (path.clone(), start, end, finding.code, finding.message.as_str());
            if findings.len() < SHOWN_MAX && *told.entry(key).or_insert(root) == root {
                findings.extend(files.diagnostic(finding));
            }
        }
        if let Some(failure) = &judgement.failure {
            let findings = shown.entry(judgement.root.path().to_owned()).or_default();
            findings.push(Diagnostic { message: failure.clone(), ..diagnostic(Severity::Error) });
        }
    }
    shown
}

/// The files of a judgement, to find places in them.
struct JudgedPlaces<'j> {
    files: &'j [SourceFile],
    paths: Vec<PathBuf>,
    lines: Vec<LineIndex>,
    columns: ColumnUnit,
}

impl<'j> JudgedPlaces<'j> {
    fn of(workspace: &Workspace, judgement: &'j Judgement) -> JudgedPlaces<'j> {
        let files = &judgement.files;
        let paths = files.iter().map(path_of).collect();
        let lines = files.iter().map(|file| LineIndex::of(&file.text)).collect();
        JudgedPlaces { files, paths, lines, columns: workspace.library.columns() }
    }

    fn location(&self, span: Span) -> Option<Location> {
        let number = span.file.0 as usize;
        let text = &self.files.get(number)?.text;
        let bytes = span.start as usize..span.end as usize;
        let place = self.lines[number].place(text, self.columns, bytes);
        Some(Location::new(uri_of(&self.paths[number])?, place))
    }

    fn diagnostic(&self, finding: &Finding) -> Option<Diagnostic> {
        let related = finding.related.iter().filter_map(|(span, words)| {
            let location = self.location(*span)?;
            Some(DiagnosticRelatedInformation { location, message: words.clone() })
        });
        let related: Vec<DiagnosticRelatedInformation> = related.collect();
        let is_unused = matches!(finding.code, Code::UnusedTag | Code::UnusedTemplate);
        Some(Diagnostic {
            range: self.location(finding.span)?.range,
            code: Some(NumberOrString::String(finding.code.name().to_owned())),
            message: message_text(finding),
            related_information: (!related.is_empty()).then_some(related),
            tags: is_unused.then(|| vec![DiagnosticTag::UNNECESSARY]),
            ..diagnostic(finding.severity())
        })
    }
}

fn diagnostic(severity: Severity) -> Diagnostic {
    let severity = match severity {
        Severity::Error => DiagnosticSeverity::ERROR,
        Severity::Warning => DiagnosticSeverity::WARNING,
    };
    let source = Some(SOURCE.to_owned());
    Diagnostic { severity: Some(severity), source, ..Diagnostic::default() }
}
