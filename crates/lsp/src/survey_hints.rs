//! What surveys have found about rungs: a hint at each line, until a text of the project changes.
//!
//! A job of `survey_job` produces them; `server` publishes them. What is as everyone expects, and
//! what is not decided, gets no hint: the whole text is that of `rungd prove --survey`.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lsp_types::{Diagnostic, DiagnosticSeverity};

use super::file::EditorFile;
use super::test_results::{TestedTexts, are_present};
use rungd_config::load::identity;
use rungd_prove::survey::Fact;

/// The source of the diagnostics.
const SOURCE: &str = "rungd survey";

/// The hints of a survey.
#[derive(Debug)]
pub(super) struct SurveyHints {
    root: PathBuf,
    texts: TestedTexts,
    hints: Vec<SurveyHint>,
}

/// What a survey has found about a rung.
#[derive(Debug)]
struct SurveyHint {
    path: PathBuf,
    /// From 1.
    line: u32,
    words: String,
}

fn hint(fact: &Fact) -> Option<SurveyHint> {
    if fact.is_ordinary() || fact.is_open() {
        return None;
    }
    let (file, line) = fact.place.rsplit_once(':')?;
    Some(SurveyHint {
        path: identity(Path::new(file)),
        line: line.parse().ok()?,
        words: fact.line()?,
    })
}

impl SurveyHints {
    /// The hints of facts. `texts`: those that were surveyed.
    pub fn of(root: PathBuf, texts: TestedTexts, facts: &[Fact]) -> SurveyHints {
        SurveyHints { root, texts, hints: facts.iter().filter_map(hint).collect() }
    }

    /// What is said when it comes.
    pub fn said(&self) -> String {
        match self.hints.len() {
            0 => "survey: everything is as expected".to_owned(),
            1 => "survey: 1 hint".to_owned(),
            count => format!("survey: {count} hints"),
        }
    }

    /// The texts that were surveyed.
    pub fn texts(&self) -> &TestedTexts {
        &self.texts
    }
}

/// The hints of the last survey of each root whose texts are unchanged.
#[derive(Debug, Default)]
pub(super) struct Surveys(HashMap<PathBuf, SurveyHints>);

impl Surveys {
    /// Adds the hints of a root, in place of those it had.
    pub fn add(&mut self, hints: SurveyHints) {
        self.0.insert(hints.root.clone(), hints);
    }

    /// Removes the hints whose texts have changed; `text` returns the present text of a file.
    pub fn keep(&mut self, text: impl Fn(&Path) -> Option<Arc<str>>) {
        self.0.retain(|_, hints| are_present(&hints.texts, &text));
    }

    /// The files that have hints.
    pub fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        self.0.values().flat_map(|of_root| of_root.hints.iter().map(|hint| &hint.path))
    }

    /// The diagnostics of a file.
    pub fn diagnostics(&self, file: &EditorFile) -> Vec<Diagnostic> {
        let hints = self.0.values().flat_map(|of_root| &of_root.hints);
        let mut said: Vec<(u32, &str)> = hints
            .filter(|hint| hint.path == file.path)
            .map(|hint| (hint.line, hint.words.as_str()))
            .collect();
        said.sort_unstable();
        said.dedup();
        said.into_iter().map(|(line, words)| diagnostic(file, line, words)).collect()
    }
}

fn diagnostic(file: &EditorFile, line: u32, words: &str) -> Diagnostic {
    let whole = file.line(file.offset_of(line, 1));
    let text = file.slice(whole.clone());
    let start = whole.start + text.len() - text.trim_start().len();
    Diagnostic {
        range: file.place(start..whole.start + text.trim_end().len()),
        severity: Some(DiagnosticSeverity::HINT),
        source: Some(SOURCE.to_owned()),
        message: words.to_owned(),
        ..Diagnostic::default()
    }
}
