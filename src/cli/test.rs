//! `rungd test`: runs the tests of test files and prints a verdict for each. It runs in virtual
//! time, without waiting.
//!
//! This module finds and reads the files, chooses the form of the result, and shows progress on a
//! terminal; `testing` runs the tests. Standard output contains only the result, with the same
//! bytes on every run.

use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{Context, Result};
use clap::Args;

use super::check::style;
use super::exit::{CommandLine, Exit};
use super::folders::search;
use super::terminal::{one_line, plain_json, print, say, say_drawn, say_findings};
use super::test_trace;
use rungd_lab::testing::{
    self, Coverage, CoverageOptions, FileVerdicts, ReadSuite, RunOptions, Suite, TestVerdict,
    read_suite,
};
use rungd_language::source::render::{refuses, render};

/// The time after which the progress is shown on a terminal.
const SHOW_AFTER: Duration = Duration::from_millis(500);

/// The time between two checks of the files with `--watch`, and between two progress lines.
pub(super) const LOOK_EVERY: Duration = Duration::from_millis(250);

/// The maximum lag of a file's modification time behind the clock: the system's time has ticks.
const TICK_MAX: Duration = Duration::from_millis(20);

/// The ending of a test file.
pub(super) const ENDING: &str = ".test.toml";

/// Runs the tests of ladders
#[derive(Args, Debug)]
pub struct TestArgs {
    /// Test files, and folders that are searched for *.test.toml (default: this folder)
    #[arg(value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// Run only tests whose names contain this text
    #[arg(long, value_name = "TEXT")]
    filter: Option<String>,
    /// Number of threads (default: one for each processor)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Print a line for each test that passed too
    #[arg(long, short)]
    verbose: bool,
    /// Print the coverage of the tests: rungs, contacts, Stages, alarms
    #[arg(long)]
    coverage: bool,
    /// With --coverage: the runs of random tests count too
    #[arg(long, requires = "coverage")]
    random: bool,
    /// Write a trace of each scenario into this folder, as CSV
    #[arg(long, value_name = "DIR")]
    trace: Option<PathBuf>,
    /// Write the verdicts to this file, as JUnit's XML
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
    /// Run again when a file changes, until interrupted
    #[arg(long)]
    watch: bool,
}

/// A test file that was read.
pub(super) struct OpenSuite {
    /// Its name in messages.
    pub name: String,
    /// Its content.
    pub read: ReadSuite,
}

/// Runs the tests.
///
/// # Errors
/// A path cannot be read, or a file cannot be written.
pub fn test(args: &TestArgs) -> Result<Exit> {
    loop {
        let begun = SystemTime::now();
        let paths = find(&args.paths)?;
        let suites = open(&paths)?;
        let exit = run_all(args, &suites)?;
        if !args.watch {
            return Ok(exit);
        }
        wait_for_change(args, &suites, &paths, begun)?;
        say("\n");
    }
}

fn run_all(args: &TestArgs, suites: &[OpenSuite]) -> Result<Exit> {
    if refused(suites) {
        return Ok(Exit::Config);
    }
    let mut files = Vec::new();
    let mut coverage = Coverage::default();
    for OpenSuite { name, read } in suites {
        let Some(suite) = &read.suite else { continue };
        let verdicts = run_one(args, suite, name, &mut coverage)?;
        if !args.json {
            print(&file_text(name, &verdicts, args.verbose))?;
        }
        files.push(FileVerdicts { file: name.clone(), verdicts });
    }
    finish(args, &files, &coverage)
}

/// Prints the findings of test files. Returns true if the tests cannot be run.
pub(super) fn refused(suites: &[OpenSuite]) -> bool {
    let style = style(false);
    let mut is_refused = false;
    for OpenSuite { read, .. } in suites {
        if !read.findings.is_empty() {
            say_findings(&render(&read.findings, &read.files, style));
        }
        is_refused |= refuses(&read.findings, style) || read.suite.is_none();
    }
    is_refused
}

/// The number of threads: as given, else one for each processor.
pub(super) fn jobs(given: Option<u16>) -> usize {
    let processors = || std::thread::available_parallelism().map_or(1, usize::from);
    given.map_or_else(processors, usize::from)
}

fn finish(args: &TestArgs, files: &[FileVerdicts], coverage: &Coverage) -> Result<Exit> {
    if let Some(path) = &args.junit {
        let text = testing::junit(files);
        std::fs::write(path, text).with_context(|| path.display().to_string())?;
    }
    let failed: usize = files.iter().map(FileVerdicts::failed).sum();
    let tests: usize = files.iter().map(|file| file.verdicts.len()).sum();
    if args.json {
        let mut json = testing::json(files);
        if args.coverage {
            json["coverage"] = coverage.json();
        }
        print(&format!("{}\n", plain_json(&json.to_string())))?;
    } else {
        if args.coverage {
            print(&coverage.text())?;
        }
        print(&summary(files, tests, failed))?;
    }
    if tests == 0 && args.filter.is_some() {
        say("warning: no test's name contains the text of --filter\n");
    }
    Ok(if failed == 0 { Exit::Ok } else { Exit::Refused })
}

/// Runs the tests of one file.
fn run_one(
    args: &TestArgs,
    suite: &Suite,
    name: &str,
    coverage: &mut Coverage,
) -> Result<Vec<TestVerdict>> {
    let programs = testing::programs(suite);
    let progress = ProgressLine::new(name);
    let show = |done, all| progress.show(done, all);
    let options = RunOptions {
        jobs: jobs(args.jobs),
        filter: args.filter.as_deref(),
        progress: &show,
        given_up: None,
    };
    let verdicts = testing::run(suite, &programs, &options);
    progress.clear();
    if args.coverage {
        let (filter, with_random) = (args.filter.as_deref(), args.random);
        coverage.add(suite, &programs, CoverageOptions { filter, with_random });
    }
    if let Some(folder) = &args.trace {
        test_trace::write(folder, suite, &programs, args.filter.as_deref())?;
    }
    Ok(verdicts)
}

/// The lines about one file, with all failures in full.
fn file_text(name: &str, verdicts: &[TestVerdict], verbose: bool) -> String {
    let failed = verdicts.iter().filter(|verdict| verdict.failure.is_some()).count();
    let mut text = format!("{}: {}\n", one_line(name), counts(verdicts.len(), failed));
    for verdict in verdicts {
        if verbose || verdict.failure.is_some() {
            if verdict.failure.is_some() {
                text.push('\n');
            }
            text += &format!("{}\n", one_line(&verdict.line_text()));
        }
        let unmoved = verdict.unmoved_text();
        if !unmoved.is_empty() {
            text += &format!("{}\n", one_line(&unmoved));
        }
        if let Some(failure) = &verdict.failure {
            text += &failure.text(name);
        }
    }
    text
}

/// `3 passed`, `1 FAILED, 2 passed`.
fn counts(tests: usize, failed: usize) -> String {
    match failed {
        0 => format!("{tests} passed"),
        failed => format!("{failed} FAILED, {} passed", tests - failed),
    }
}

fn summary(files: &[FileVerdicts], tests: usize, failed: usize) -> String {
    if files.len() == 1 {
        return String::new();
    }
    format!("{} files: {}\n", files.len(), counts(tests, failed))
}

/// The test files of the paths, in order. The files of a folder are in order of their names.
pub(super) fn find(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let here = [PathBuf::from(".")];
    let paths = if paths.is_empty() { &here[..] } else { paths };
    let mut found = Vec::new();
    for path in paths {
        if !path.is_dir() {
            found.push(path.clone());
            continue;
        }
        let in_folder = search(path, ENDING)?;
        if in_folder.is_empty() {
            let name = path.display();
            let message = format!("{name}: no file in this folder is named *{ENDING}");
            return Err(CommandLine(message).into());
        }
        found.extend(in_folder);
    }
    Ok(found)
}

pub(super) fn open(paths: &[PathBuf]) -> Result<Vec<OpenSuite>> {
    let open = |path: &PathBuf| {
        let name = path.display().to_string();
        Ok(OpenSuite { read: read_suite(path)?, name })
    };
    paths.iter().map(open).collect()
}

/// Waits until a file that was read has changed, or a test file was added or removed. `begun`: when
/// the files were read.
fn wait_for_change(
    args: &TestArgs,
    suites: &[OpenSuite],
    paths: &[PathBuf],
    begun: SystemTime,
) -> Result<()> {
    let changed =
        |path: &str| std::fs::metadata(path).and_then(|metadata| metadata.modified()).ok();
    let names = suites.iter().flat_map(|suite| suite.read.paths());
    let known: BTreeMap<String, Option<SystemTime>> = names
        .map(|name| (name.clone(), changed(&name).filter(|at| *at + TICK_MAX < begun)))
        .collect();
    say(&format!("watching {} files: Ctrl+C ends\n", known.len()));
    loop {
        std::thread::sleep(LOOK_EVERY);
        // A file that is being replaced may be missing for a moment.
        let is_changed = |(name, was): (&String, &Option<SystemTime>)| {
            changed(name).is_some_and(|at| Some(at) != *was)
        };
        if known.iter().any(is_changed) || find(&args.paths).is_ok_and(|now| now != paths) {
            return Ok(());
        }
    }
}

/// A line on a terminal with the progress of the tests of a file.
pub(super) struct ProgressLine<'a> {
    name: &'a str,
    begun: Instant,
    /// The time at which the line was last written; `None` if it was never written.
    shown: Mutex<Option<Instant>>,
    is_terminal: bool,
}

impl<'a> ProgressLine<'a> {
    /// Makes a progress line, and shows nothing yet.
    pub fn new(name: &'a str) -> ProgressLine<'a> {
        let is_terminal = std::io::stderr().is_terminal();
        ProgressLine { name, begun: Instant::now(), shown: Mutex::new(None), is_terminal }
    }

    /// Shows the progress, if enough time has passed since the last line.
    pub fn show(&self, done: u64, all: u64) {
        self.show_text(|| format!("{} %", done * 100 / all.max(1)));
    }

    /// As [`ProgressLine::show`], with the progress as a text.
    pub fn show_text(&self, progress: impl FnOnce() -> String) {
        if !self.is_terminal || self.begun.elapsed() < SHOW_AFTER {
            return;
        }
        let Ok(mut shown) = self.shown.try_lock() else { return };
        if shown.is_some_and(|at| at.elapsed() < LOOK_EVERY) {
            return;
        }
        *shown = Some(Instant::now());
        let (name, progress) = (one_line(self.name), progress());
        say_drawn(&format!("\r{name}: {progress}\u{1b}[K"));
    }

    /// Removes the line.
    pub fn clear(&self) {
        if self.shown.lock().is_ok_and(|shown| shown.is_some()) {
            say_drawn("\r\u{1b}[K");
        }
    }
}
