//! `rungd prove --survey`: what a ladder can do, as text that goes into git beside it.
//!
//! This module reads the ladder, prints its survey, writes it with --lock, and compares it with
//! --check; `rungd-prove` makes it.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result};
use clap::Args;
use serde_json::{Value, json};

use super::asked_ladders::AskedLadders;
use super::exit::Exit;
use super::terminal::{one_line, plain_json, print};
use super::test::{ENDING, OpenSuite, ProgressLine, open, refused};
use rungd_lab::testing::Suite;
use rungd_prove::decide::DecideLimits;
use rungd_prove::survey::{Fact, Survey, SurveyChange, SurveyProgress, survey};

/// The time for a condition, if none is given. Its effort ends first on most machines.
pub(super) const TIME: Duration = Duration::from_secs(30);

/// How a ladder is surveyed.
#[derive(Args, Debug)]
pub struct SurveyArgs {
    /// Say what the outputs, alarms, Stages and rungs of ladders can do
    #[arg(long, conflicts_with_all = ["equal", "again", "certificate"])]
    pub survey: bool,
    /// With --survey: write it into a file, for git
    #[arg(long, value_name = "FILE", requires = "survey", conflicts_with = "check")]
    lock: Option<PathBuf>,
    /// With --survey: compare it with a file that --lock has written; exit code 1 if it differs
    #[arg(long, value_name = "FILE", requires = "survey")]
    check: Option<PathBuf>,
}

/// Surveys ladders.
///
/// # Errors
/// A file cannot be read or written.
pub(super) fn prove_survey(
    args: &SurveyArgs,
    ladders: &AskedLadders,
    limits: &DecideLimits,
    as_json: bool,
) -> Result<Exit> {
    let Some(suite) = suite(ladders)? else { return Ok(Exit::Config) };
    let names: Vec<String> = ladders.paths.iter().map(|path| path.display().to_string()).collect();
    let names = one_line(&names.join(", ")).into_owned();
    let progress = ProgressLine::new(&names);
    let show = |SurveyProgress { done, all }| {
        progress.show_text(|| format!("decided {done} of {all}"));
    };
    let survey = survey(suite, limits, &show);
    progress.clear();
    if let Some(path) = &args.check {
        let written = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        return print_changes(&survey.changes(&written), as_json);
    }
    let text = survey.text();
    match as_json {
        true => print(&format!("{}\n", plain_json(&json_of(&survey, &names).to_string())))?,
        false => print(&text)?,
    }
    if let Some(path) = &args.lock {
        std::fs::write(path, &text).with_context(|| path.display().to_string())?;
    }
    Ok(exit(&survey))
}

/// Prints what has changed.
fn print_changes(changes: &[SurveyChange], as_json: bool) -> Result<Exit> {
    match as_json {
        true => {
            let all: Vec<Value> = changes.iter().map(SurveyChange::json).collect();
            let all = json!({ "changes": all });
            print(&format!("{}\n", plain_json(&all.to_string())))?;
        }
        false if changes.is_empty() => print("unchanged\n")?,
        false => changes.iter().try_for_each(|change| print(&change.text()))?,
    }
    Ok(if changes.is_empty() { Exit::Ok } else { Exit::Refused })
}

/// The exit code of a survey.
fn exit(survey: &Survey) -> Exit {
    match () {
        () if survey.facts.iter().any(Fact::is_broken) => Exit::Refused,
        () if survey.facts.iter().any(Fact::is_open) => Exit::UNDECIDED,
        () => Exit::Ok,
    }
}

/// The ladder files, the controller file or the test file.
fn suite(ladders: &AskedLadders) -> Result<Option<Suite>> {
    let is_test = |path: &PathBuf| path.to_string_lossy().ends_with(ENDING);
    match ladders.paths {
        [path] if is_test(path) => {
            let opened = open(std::slice::from_ref(path))?;
            if refused(&opened) {
                return Ok(None);
            }
            Ok(opened.into_iter().next().and_then(|OpenSuite { read, .. }| read.suite))
        }
        paths => AskedLadders { paths, period: ladders.period, rest: "always = []\n" }.suite(),
    }
}

fn json_of(survey: &Survey, names: &str) -> Value {
    let period_ms = match survey.period.whole_ms() {
        Some(ms) => Value::from(ms),
        None => Value::from(survey.period.ms()),
    };
    json!({
        "ladder": names,
        "period_ms": period_ms,
        "facts": survey.facts.iter().map(Fact::json).collect::<Vec<_>>(),
    })
}
