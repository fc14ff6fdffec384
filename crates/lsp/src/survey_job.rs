//! Surveys a ladder for the editor, with the texts that it shows.
//!
//! `commands` runs it as a job, with the feature `prove`. `survey_hints` has the result.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Result, bail};

use super::jobs::{JobPlace, JobResult};
use super::survey_hints::SurveyHints;
use super::test_results::TestedTexts;
use rungd_base::scan_period::ScanPeriod;
use rungd_config::load::OpenTexts;
use rungd_lab::testing::{Suite, ladders_text, read_among};
use rungd_language::source::finding::Severity;
use rungd_language::source::span::SourceFile;
use rungd_prove::decide::DecideLimits;
use rungd_prove::survey::{Survey, survey};

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
    Ok(Some(JobResult::Survey(SurveyHints::of(root, texts, &facts))))
}

/// A test file without tests about the ladder.
fn suite(SurveyOrder { root, open, .. }: &SurveyOrder) -> Result<Suite> {
    let period = ScanPeriod::DEFAULT.to_string();
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
