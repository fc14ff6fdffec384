//! The results of the tests that were run in the editor. They are shown in the lenses, and as a
//! diagnostic at each failed step, until a text changes.
//!
//! A job of `test_job` produces them; `lenses` and `server` show them.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lsp_types::{Diagnostic, DiagnosticSeverity};

use super::file::EditorFile;
use rungd_lab::testing::{Failure, TestVerdict};
use rungd_language::source::wording::counted;

/// The source of the diagnostics.
pub(super) const SOURCE: &str = "rungd test";

/// The texts of a project, as they were when its tests were run.
pub(super) type TestedTexts = Vec<(PathBuf, Arc<str>)>;

/// The results of tests of one file.
#[derive(Debug)]
pub(super) struct FileResults {
    /// The test file.
    pub path: PathBuf,
    /// The texts that were tested.
    pub texts: TestedTexts,
    /// The verdicts.
    pub verdicts: Vec<TestVerdict>,
}

/// The last results of all tests whose texts are unchanged.
#[derive(Debug, Default)]
pub(super) struct TestResults {
    files: HashMap<PathBuf, (TestedTexts, BTreeMap<String, TestVerdict>)>,
}

impl TestResults {
    /// Adds results. The results of other tests of the file are kept.
    pub fn add(&mut self, results: FileResults) {
        let (texts, verdicts) = self.files.entry(results.path).or_default();
        *texts = results.texts;
        verdicts
            .extend(results.verdicts.into_iter().map(|verdict| (verdict.name.clone(), verdict)));
    }

    /// Removes the results whose texts have changed; `text` returns the present text of a file.
    pub fn keep(&mut self, text: impl Fn(&Path) -> Option<Arc<str>>) {
        self.files.retain(|_, (texts, _)| are_present(texts, &text));
    }

    /// The last verdict of a test.
    pub fn verdict(&self, path: &Path, test: &str) -> Option<&TestVerdict> {
        self.files.get(path)?.1.get(test)
    }

    /// The files that have results.
    pub fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        self.files.keys()
    }

    /// The diagnostics of a file.
    pub fn diagnostics(&self, file: &EditorFile) -> Vec<Diagnostic> {
        let verdicts = self.files.get(&file.path).into_iter().flat_map(|(_, all)| all.values());
        let failed = verdicts.filter_map(|verdict| Some((verdict, verdict.failure.as_deref()?)));
        failed.map(|(verdict, failure)| diagnostic(file, verdict, failure)).collect()
    }
}

/// Whether the present texts of a project equal `texts`.
pub(super) fn are_present(texts: &TestedTexts, text: impl Fn(&Path) -> Option<Arc<str>>) -> bool {
    let is_present = |(path, tested): &(PathBuf, Arc<str>)| {
        text(path).is_some_and(|now| Arc::ptr_eq(&now, tested) || now == *tested)
    };
    texts.iter().all(is_present)
}

/// A verdict in a few words: `passed, 120 scans`; `failed at step 3`.
pub(super) fn verdict_text(verdict: &TestVerdict) -> String {
    match verdict.failure.as_deref().map(|failure| failure.step) {
        None => format!("passed, {}", counted(verdict.scans, "scan")),
        Some(Some((step, _))) => format!("failed at step {step}"),
        Some(None) => "failed".to_owned(),
    }
}

/// A failure in full, as `rungd test` prints it.
pub(super) fn whole(file: &Path, verdict: &TestVerdict, failure: &Failure) -> String {
    format!("{}\n{}", verdict.line_text(), failure.text(&file.display().to_string()))
}

fn diagnostic(file: &EditorFile, verdict: &TestVerdict, failure: &Failure) -> Diagnostic {
    let (line, column) = failure.place;
    let offset = file.offset_of(line, column);
    let step = file.outline.value_at(&(offset..offset + 1)).filter(|value| value.is_string);
    let place = step.map_or_else(|| file.line(offset), |step| step.inner.clone());
    let name = file.path.file_name().map(Path::new).unwrap_or(&file.path);
    Diagnostic {
        range: file.place(place),
        severity: Some(DiagnosticSeverity::ERROR),
        source: Some(SOURCE.to_owned()),
        message: whole(name, verdict, failure),
        ..Diagnostic::default()
    }
}
