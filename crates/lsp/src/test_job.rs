//! Runs the tests of a file, or one of them, with the texts that the editor shows.
//!
//! `commands` runs it as a job. `testing` executes the tests, as for `rungd test`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use super::jobs::{JobPlace, JobResult};
use super::test_results::{FileResults, TestedTexts};
use rungd_config::load::{OpenTexts, decode};
use rungd_lab::testing::{self, ReadSuite, RunOptions, Suite, TestVerdict};
use rungd_language::source::finding::Severity;
use rungd_language::source::span::{FileId, SourceFile};

/// What to run.
#[derive(Debug)]
pub(super) struct TestOrder {
    /// The test file.
    pub path: PathBuf,
    /// The name of one test; `None` for all tests.
    pub test: Option<String>,
    /// The texts that the editor shows.
    pub open: OpenTexts,
    /// The texts of the project.
    pub texts: TestedTexts,
}

/// Runs tests; `None` if a newer job has replaced this one.
///
/// # Errors
/// The tests of the file cannot be run.
pub(super) fn run(order: TestOrder, place: &JobPlace) -> Result<Option<JobResult>> {
    let mut suite = suite(&order)?;
    if let Some(test) = &order.test {
        suite.scenarios.retain(|scenario| scenario.name == *test);
        suite.randoms.retain(|random_test| random_test.name == *test);
        if suite.scenarios.is_empty() && suite.randoms.is_empty() {
            bail!("the file has no test `{test}`");
        }
    }
    let Some(verdicts) = verdicts(&mut suite, place) else { return Ok(None) };
    let TestOrder { path, texts, .. } = order;
    Ok(Some(JobResult::Tests(FileResults { path, texts, verdicts })))
}

fn suite(TestOrder { path, open, .. }: &TestOrder) -> Result<Suite> {
    let bytes = open.read(path).with_context(|| path.display().to_string())?;
    let (text, undecoded) = decode(&bytes, FileId(0));
    let file = SourceFile { name: path.display().to_string(), text };
    let ReadSuite { files, findings, suite } = testing::read_among(path, file, undecoded, open);
    let error = findings.iter().find(|finding| finding.severity() == Severity::Error);
    match (suite, error) {
        (Some(suite), _) => Ok(suite),
        (None, Some(error)) => {
            let file = files.get(error.span.file.0 as usize).map(|file| Path::new(&file.name));
            let name = file.and_then(Path::file_name).unwrap_or_default().to_string_lossy();
            bail!("the tests cannot be run: {name}: {}", error.message)
        }
        (None, None) => bail!("the file has no tests"),
    }
}

/// Runs all tests one after the other and returns their verdicts; `None` if the job is replaced.
fn verdicts(suite: &mut Suite, place: &JobPlace) -> Option<Vec<TestVerdict>> {
    let programs = testing::programs(suite);
    let jobs = std::thread::available_parallelism().map_or(1, usize::from);
    let options =
        RunOptions { jobs, filter: None, progress: &|_, _| (), given_up: Some(place.flag()) };
    let scenarios = std::mem::take(&mut suite.scenarios);
    let randoms = std::mem::take(&mut suite.randoms);
    let mut all = Vec::new();
    let mut run = |suite: &Suite| {
        all.extend(testing::run(suite, &programs, &options));
        (!place.is_replaced()).then_some(())
    };
    for scenario in scenarios {
        suite.scenarios = vec![scenario];
        run(suite)?;
    }
    suite.scenarios.clear();
    for random in randoms {
        suite.randoms = vec![random];
        run(suite)?;
    }
    Some(all)
}

/// The name of a job of tests: one for each file and test.
pub(super) fn name(path: &Path, test: Option<&str>) -> String {
    format!("test {} {}", path.display(), test.unwrap_or_default())
}
