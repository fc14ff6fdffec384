//! The commands of the editor: run tests, simulate, survey, explain a name, explain a value, live
//! view.
//!
//! A command that takes time runs as a job (`jobs`); [`done`] receives its result. The first
//! argument is a URI. `lenses` and `actions` offer the commands with all their arguments.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context, Result, bail};
use lsp_types::{ExecuteCommandParams, MessageType, Position, Uri};
use serde_json::Value;

use super::hover;
#[cfg(feature = "prove")]
use super::how_job;
use super::jobs::{JobResult, JobSubject};
use super::operands;
use super::outbox::Refreshed;
use super::simulate_job::{self, SimulateOrder};
use super::slots::FileKind;
#[cfg(feature = "prove")]
use super::survey_hints::SurveyHints;
#[cfg(feature = "prove")]
use super::survey_job::{self, SurveyOrder};
use super::test_job::{self, TestOrder};
use super::test_results::{FileResults, TestedTexts, are_present, verdict_text, whole};
use super::uri::path_of;
use super::why_job;
use super::workspace::{Cursor, Workspace};

pub(super) const TEST: &str = "rungd.test";
pub(super) const SHOW_FAILURE: &str = "rungd.test.show";
pub(super) const SIMULATE: &str = "rungd.simulate";
pub(super) const EXPLAIN: &str = "rungd.explain";
pub(super) const WHY: &str = "rungd.why";
#[cfg(feature = "prove")]
pub(super) const HOW: &str = "rungd.how";
#[cfg(feature = "prove")]
pub(super) const SURVEY: &str = "rungd.survey";
pub(super) const LIVE_ON: &str = "rungd.live.on";
pub(super) const LIVE_OFF: &str = "rungd.live.off";

/// All commands.
pub(super) const ALL: &[&str] = &[
    TEST,
    SHOW_FAILURE,
    SIMULATE,
    EXPLAIN,
    WHY,
    #[cfg(feature = "prove")]
    HOW,
    #[cfg(feature = "prove")]
    SURVEY,
    LIVE_ON,
    LIVE_OFF,
];

/// Executes a command, or starts its job.
pub(super) fn execute(
    workspace: &mut Workspace,
    params: ExecuteCommandParams,
) -> Result<Option<Value>> {
    let arguments = Arguments(params.arguments);
    match params.command.as_str() {
        TEST => test(workspace, &arguments)?,
        SHOW_FAILURE => show_failure(workspace, &arguments)?,
        SIMULATE => simulate(workspace, &arguments)?,
        EXPLAIN => explain(workspace, &arguments)?,
        WHY => why(workspace, &arguments)?,
        #[cfg(feature = "prove")]
        HOW => how(workspace, &arguments)?,
        #[cfg(feature = "prove")]
        SURVEY => survey(workspace, &arguments)?,
        LIVE_ON => workspace.live.switch(true, &mut workspace.outbox),
        LIVE_OFF => workspace.live.switch(false, &mut workspace.outbox),
        other => bail!("there is no command `{other}`"),
    }
    Ok(None)
}

/// The arguments of a command.
struct Arguments(Vec<Value>);

impl Arguments {
    fn text(&self, at: usize) -> Option<&str> {
        self.0.get(at)?.as_str()
    }

    /// An optional text.
    fn text_if_any(&self, at: usize, what: &str) -> Result<Option<&str>> {
        match self.0.get(at) {
            None | Some(Value::Null) => Ok(None),
            Some(given) => given.as_str().map(Some).with_context(|| format!("{what}: `{given}`")),
        }
    }

    fn path(&self) -> Result<PathBuf> {
        let uri = self.text(0).and_then(|text| Uri::from_str(text).ok());
        uri.and_then(|uri| path_of(&uri)).context("the first argument is the URI of a file")
    }

    fn cursor(&self, workspace: &Workspace) -> Result<Cursor> {
        let uri = self.text(0).and_then(|text| Uri::from_str(text).ok());
        let uri = uri.context("the first argument is the URI of a file")?;
        let position = self.0.get(1).cloned().unwrap_or_default();
        let position: Position =
            serde_json::from_value(position).context("the second argument is a position")?;
        workspace.cursor_at(&uri, position).context("the file cannot be read")
    }
}

/// Arguments: `[uri, test]`. Without `test`, all tests of the file are run.
fn test(workspace: &mut Workspace, arguments: &Arguments) -> Result<()> {
    let path = arguments.path()?;
    if workspace.library.file(&path).is_some_and(|file| file.kind != FileKind::Test) {
        bail!("{}: not a test file: the name of a test file ends in `.test.toml`", path.display());
    }
    let test = arguments.text_if_any(1, "the second argument is the name of a test")?;
    let test = test.map(str::to_owned);
    let texts = project_texts(workspace, &path)?;
    let subject = JobSubject { path: Some(path.clone()), texts: texts.clone() };
    let order = TestOrder { path, test, open: workspace.library.texts(), texts };
    let name = test_job::name(&order.path, order.test.as_deref());
    workspace.jobs.start(name, subject, move |place| test_job::run(order, place))
}

fn project_texts(workspace: &Workspace, path: &Path) -> Result<TestedTexts> {
    let project = workspace.project(path).context("the file cannot be read")?;
    Ok(project.files.iter().map(|file| (file.path.clone(), file.text.clone())).collect())
}

/// Arguments: `[uri, test]`. Shows the full text of the test's failure.
fn show_failure(workspace: &mut Workspace, arguments: &Arguments) -> Result<()> {
    let path = arguments.path()?;
    let test = arguments.text(1).context("the second argument is the name of a test")?;
    let verdict = workspace.tests.verdict(&path, test);
    let failed = verdict.and_then(|verdict| Some((verdict, verdict.failure.as_deref()?)));
    let (verdict, failure) = failed.context("this test has not failed")?;
    let name = PathBuf::from(path.file_name().unwrap_or_default());
    let text = whole(&name, verdict, failure);
    show(workspace, &format!("failed-{test}.txt"), &text)
}

/// Arguments: `[uri, scans, "csv"]`; the last two are optional.
fn simulate(workspace: &mut Workspace, arguments: &Arguments) -> Result<()> {
    let path = arguments.path()?;
    let root = workspace.project(&path).context("the file cannot be read")?.root.clone();
    let texts = project_texts(workspace, &path)?;
    let scans = match arguments.0.get(1) {
        None | Some(Value::Null) => None,
        Some(given) => {
            let scans = given.as_u64().filter(|scans| *scans > 0);
            let what = || format!("the second argument is a number of scans, 1 or more: `{given}`");
            Some(scans.with_context(what)?)
        }
    };
    let is_table = match arguments.text_if_any(2, "the third argument is \"csv\"")? {
        None => false,
        Some("csv") => true,
        Some(other) => bail!("the third argument is \"csv\": `{other}`"),
    };
    let open = workspace.library.texts();
    let order = SimulateOrder { root, open, scans, is_table };
    let name = format!("simulate {}", order.root.display());
    let subject = JobSubject { path: Some(path), texts };
    workspace.jobs.start(name, subject, move |place| simulate_job::run(&order, place))
}

/// `[uri, position]`
fn explain(workspace: &mut Workspace, arguments: &Arguments) -> Result<()> {
    let cursor = arguments.cursor(workspace)?;
    let (name, text) = hover::explained(&cursor).context("there is nothing to explain here")?;
    show(workspace, &format!("{name}.txt"), &text)
}

/// `[uri, position]`
fn why(workspace: &mut Workspace, arguments: &Arguments) -> Result<()> {
    let LiveOperand { operand, socket } = LiveOperand::of(workspace, arguments)?;
    let run = move |place: &_| why_job::run(&operand, &socket, place);
    workspace.jobs.start(WHY.to_owned(), JobSubject::default(), run)
}

/// `[uri, position]`
#[cfg(feature = "prove")]
fn how(workspace: &mut Workspace, arguments: &Arguments) -> Result<()> {
    let LiveOperand { operand, socket } = LiveOperand::of(workspace, arguments)?;
    let run = move |place: &_| how_job::run(&operand, &socket, place);
    workspace.jobs.start(HOW.to_owned(), JobSubject::default(), run)
}

/// `[uri]`
#[cfg(feature = "prove")]
fn survey(workspace: &mut Workspace, arguments: &Arguments) -> Result<()> {
    let path = arguments.path()?;
    let root = workspace.project(&path).context("the file cannot be read")?.root.clone();
    if workspace.library.file(&root).is_some_and(|file| file.kind == FileKind::Test) {
        bail!("{}: no ladder and no controller file", path.display());
    }
    let texts = project_texts(workspace, &path)?;
    let open = workspace.library.texts();
    let name = format!("survey {}", root.display());
    let subject = JobSubject { path: Some(path), texts: texts.clone() };
    let order = SurveyOrder { root, open, texts };
    workspace.jobs.start(name, subject, move |place| survey_job::run(order, place))
}

/// An operand of a running controller.
struct LiveOperand {
    operand: String,
    /// The controller's.
    socket: PathBuf,
}

impl LiveOperand {
    fn of(workspace: &mut Workspace, arguments: &Arguments) -> Result<LiveOperand> {
        let cursor = arguments.cursor(workspace)?;
        let operand = operands::asked(&cursor.project, cursor.numbered(), cursor.offset);
        let operand = operand.context("there is no operand of a running controller here")?;
        let socket = workspace.live.socket(&cursor.project.root)?;
        Ok(LiveOperand { operand, socket })
    }
}

/// Shows a text: as a document if the editor can show documents, otherwise as a message.
fn show(workspace: &mut Workspace, name: &str, text: &str) -> Result<()> {
    if !workspace.outbox.shows_documents() {
        workspace.outbox.say(MessageType::INFO, text);
        return Ok(());
    }
    let path = workspace.jobs.scratch().write(name, text.as_bytes())?;
    workspace.outbox.show(&path, false);
    Ok(())
}

/// Shows the result of a job.
pub(super) fn done(workspace: &mut Workspace, made: JobResult) {
    match made {
        JobResult::Document(path, outside) => {
            match std::fs::read_to_string(&path) {
                Ok(text) if !outside && !workspace.outbox.shows_documents() => {
                    workspace.outbox.say(MessageType::INFO, text);
                }
                Ok(_) | Err(_) => workspace.outbox.show(&path, outside),
            };
        }
        JobResult::Failed(why) => workspace.outbox.say(MessageType::ERROR, why),
        JobResult::Tests(results) => tested(workspace, results),
        #[cfg(feature = "prove")]
        JobResult::Survey(hints) => surveyed(workspace, hints),
    }
}

#[cfg(feature = "prove")]
fn surveyed(workspace: &mut Workspace, hints: SurveyHints) {
    let present = |path: &Path| Some(workspace.library.file(path)?.text.clone());
    if are_present(hints.texts(), present) {
        workspace.outbox.say(MessageType::INFO, hints.said());
        workspace.surveys.add(hints);
    }
}

fn tested(workspace: &mut Workspace, results: FileResults) {
    let present = |path: &Path| Some(workspace.library.file(path)?.text.clone());
    if !are_present(&results.texts, present) {
        return;
    }
    let failed: Vec<String> = results
        .verdicts
        .iter()
        .filter(|verdict| verdict.failure.is_some())
        .map(|verdict| format!("{}: {}", verdict.name, verdict_text(verdict)))
        .collect();
    if !failed.is_empty() {
        workspace.outbox.say(MessageType::ERROR, failed.join("\n"));
    }
    workspace.tests.add(results);
    workspace.outbox.refresh(Refreshed::Lenses);
}
