//! Surveys a ladder for the editor, and shows what was found about its rungs as hints.
//!
//! `commands` runs it as a job, with the feature `prove`; `server` publishes the hints until a text
//! of the project changes. What is as everyone expects, and what is not decided, gets no hint: the
//! whole text is that of `rungd prove --survey`.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Result, bail};
use lsp_types::{Diagnostic, DiagnosticSeverity};

use super::file::EditorFile;
use super::jobs::{JobPlace, JobResult};
use super::test_results::{TestedTexts, are_present};
use rungd_config::load::{OpenTexts, identity};
use rungd_lab::rig::simulation::DEFAULT_PERIOD_MS;
use rungd_lab::testing::{Suite, ladders_text, read_among};
use rungd_language::source::finding::Severity;
use rungd_language::source::span::SourceFile;
use rungd_prove::decide::DecideLimits;
use rungd_prove::survey::{Fact, Survey, survey};

/// The source of the diagnostics.
const SOURCE: &str = "rungd survey";
/// The time for each question; the counted effort of a survey seldom needs it.
const TIME: Duration = Duration::from_secs(10);
/// The memory for each question, bytes.
const MEMORY: usize = 1 << 29;

/// What to survey.
#[derive(Debug)]
pub(super) struct SurveyOrder {
    /// The controller file, or the ladder alone.
    pub root: PathBuf,
    /// The texts that the editor shows.
    pub open: OpenTexts,
    /// The texts of the project.
    pub texts: TestedTexts,
}

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

/// Surveys; `None` if a newer job has replaced this one, or a text has changed.
///
/// # Errors
/// The ladder has errors.
pub(super) fn run(order: SurveyOrder, place: &JobPlace) -> Result<Option<JobResult>> {
    let suite = suite(&order)?;
    let limits = DecideLimits { time: TIME, memory: MEMORY, given_up: place.shared_flag() };
    let Survey { facts, .. } = survey(suite, &limits, &|_| {});
    if place.is_replaced() {
        return Ok(None);
    }
    let SurveyOrder { root, texts, .. } = order;
    let hints = facts.iter().filter_map(hint).collect();
    Ok(Some(JobResult::Survey(SurveyHints { root, texts, hints })))
}

/// A test file without tests about the ladder.
fn suite(SurveyOrder { root, open, .. }: &SurveyOrder) -> Result<Suite> {
    let period = format!("{DEFAULT_PERIOD_MS}ms");
    let ladders = ladders_text(std::slice::from_ref(root), &period, open)?;
    let path = root.with_file_name("asked.test.toml");
    let file = SourceFile { name: path.display().to_string(), text: ladders + "always = []\n" };
    let read = read_among(&path, file, None, open);
    if let Some(suite) = read.suite {
        return Ok(suite);
    }
    let mut findings = read.findings.iter();
    let error = findings.find(|finding| finding.severity() == Severity::Error);
    bail!("the ladder cannot be surveyed: {}", error.map_or("it has no program", |it| &it.message))
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
