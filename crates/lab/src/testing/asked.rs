//! A single condition about a program, as a test file would ask it.
//!
//! `rungd how` asks about recorded programs, of which there are no files. Commands that get ladders
//! instead of a test file write one of them.

use std::path::{Path, PathBuf};

use anyhow::Result;

use super::condition::Condition;
use super::names::{Observation, TestNames};
use super::proving::limited;
use super::suite::{FreeOperand, ProofSettings, Suite, TestProgram};
use super::written_prove::{ProofEvent, WrittenProve};
use rungd_config::load::OpenTexts;
use rungd_config::load::test_ladders::{InputKind, input_kind};
use rungd_language::resolve::LoadOptions;
use rungd_language::source::condition::condition;
use rungd_language::source::finding::Finding;
use rungd_language::source::span::{FileId, SourceFile, Span};
use rungd_language::source::was;

/// What is asked.
#[derive(Clone, Copy, Debug)]
pub struct AskedCondition<'a> {
    /// The condition.
    pub condition: &'a str,
    /// The names of what an operator may write.
    pub writes: &'a [String],
}

/// A test file with the condition as its one line of `can`.
///
/// # Errors
/// What is wrong with the condition or with the names, as sentences.
pub fn asked_suite(program: TestProgram, asked: AskedCondition) -> Result<Suite, String> {
    let options = LoadOptions::default();
    let mut names = TestNames::of(&program, &Observation::default(), &options);
    let asked_condition = asked_condition(&mut names, asked.condition)?;
    let writable: Result<Vec<FreeOperand>, String> =
        asked.writes.iter().map(|name| writable(&names, name)).collect();
    let writable = writable?;
    drop(names);
    let events = if writable.is_empty() { Vec::new() } else { vec![ProofEvent::Writes] };
    let unasked = WrittenProve::default();
    let proof = ProofSettings {
        inputs: None,
        assume: Vec::new(),
        can: vec![asked_condition],
        outside: Vec::new(),
        late_max: unasked.late_max,
        from_retained: false,
        events,
        writable,
        any: Vec::new(),
        states: None,
        depth: None,
        time_ms: unasked.time_ms,
    };
    let file = SourceFile { name: "condition".to_owned(), text: asked.condition.to_owned() };
    Ok(Suite {
        name: file.name.clone(),
        file,
        programs: vec![program],
        always: vec![Vec::new()],
        interlocked: 0,
        devices: Vec::new(),
        scenarios: Vec::new(),
        randoms: Vec::new(),
        proof,
    })
}

/// The first lines of a test file about ladder files, or about one controller file. `period`: the
/// scan period of ladder files.
///
/// # Errors
/// The first file cannot be read.
pub fn ladders_text(paths: &[PathBuf], period: &str, texts: &OpenTexts) -> Result<String> {
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    let quoted = serde_json::to_string(&names)?;
    let first = paths.first().map_or(Path::new(""), PathBuf::as_path);
    Ok(match input_kind(first, texts).map_err(anyhow::Error::msg)? {
        InputKind::Controller => format!("controller = {}\n", quoted.trim_matches(['[', ']'])),
        InputKind::Ladder => {
            format!("ladder = {quoted}\nperiod = {}\n", serde_json::to_string(period)?)
        }
    })
}

fn asked_condition(names: &mut TestNames, text: &str) -> Result<Condition, String> {
    let written = condition(text, whole(text)).map_err(|finding| sentence(&finding))?;
    if let Some(was) = was::names(&written.contact).first() {
        return Err(format!("`{}`: only a test file remembers the scan before", was.value));
    }
    names.condition(&written).map_err(|findings| {
        let all: Vec<String> = findings.iter().map(sentence).collect();
        all.join("; ")
    })
}

fn writable(names: &TestNames, name: &str) -> Result<FreeOperand, String> {
    let span = whole(name);
    let target = names.written(name, span).and_then(|target| limited(target, name, span));
    target.map_err(|finding| sentence(&finding))
}

fn whole(text: &str) -> Span {
    Span { file: FileId(0), start: 0, end: text.len() as u32 }
}

fn sentence(finding: &Finding) -> String {
    match finding.help_text() {
        Some(help) => format!("{}: {help}", finding.message),
        None => finding.message.clone(),
    }
}
