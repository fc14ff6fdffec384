//! Code lenses: run a test and show its result; simulate or survey a ladder; turn the live view on
//! and off.

use std::ops::Range;

use anyhow::Result;
use lsp_types::{CodeLens, CodeLensParams, Command};
use serde_json::{Value, json};

#[cfg(feature = "prove")]
use super::commands::SURVEY;
use super::commands::{LIVE_OFF, LIVE_ON, SHOW_FAILURE, SIMULATE, TEST};
use super::file::EditorFile;
use super::slots::FileKind;
use super::test_results::{TestResults, verdict_text};
use super::workspace::Workspace;

/// The lenses of a file.
pub(super) fn lenses(
    workspace: &mut Workspace,
    params: CodeLensParams,
) -> Result<Option<Vec<CodeLens>>> {
    let uri = params.text_document.uri;
    let Some(file) = workspace.file(&uri) else { return Ok(None) };
    let uri = json!(uri);
    Ok(Some(match file.kind {
        FileKind::Test => of_tests(&file, &uri, &workspace.tests),
        FileKind::Ladder => of_ladder(&file, &uri, workspace.live.is_on()),
        FileKind::Controller => Vec::new(),
    }))
}

fn of_tests(file: &EditorFile, uri: &Value, results: &TestResults) -> Vec<CodeLens> {
    let mut lenses = Vec::new();
    for (at, object) in file.outline.objects.iter().enumerate() {
        if !matches!(object.kind.as_str(), "scenario" | "random") {
            continue;
        }
        let Some(name) = file.value(at, &["name"]) else { continue };
        let place = object.extent.start..object.extent.start;
        let arguments = vec![uri.clone(), json!(name)];
        lenses.push(lens(file, place.clone(), titled("run", TEST, arguments.clone())));
        let Some(verdict) = results.verdict(&file.path, name) else { continue };
        let command = if verdict.failure.is_some() { SHOW_FAILURE } else { TEST };
        lenses.push(lens(file, place, titled(&verdict_text(verdict), command, arguments)));
    }
    if !lenses.is_empty() {
        lenses.insert(0, lens(file, 0..0, titled("run all", TEST, vec![uri.clone()])));
    }
    lenses
}

fn of_ladder(file: &EditorFile, uri: &Value, is_live: bool) -> Vec<CodeLens> {
    let main = file.outline.objects.iter().enumerate().find(|(at, object)| {
        object.kind == "program" && file.value(*at, &["name"]) == Some("Main")
    });
    let Some((_, main)) = main else { return Vec::new() };
    let place = main.extent.start..main.extent.start;
    let live = match is_live {
        true => titled("hide live values", LIVE_OFF, Vec::new()),
        false => titled("show live values", LIVE_ON, Vec::new()),
    };
    vec![
        lens(file, place.clone(), titled("simulate", SIMULATE, vec![uri.clone()])),
        #[cfg(feature = "prove")]
        lens(file, place.clone(), titled("survey", SURVEY, vec![uri.clone()])),
        lens(file, place, live),
    ]
}

/// A command of the server, with its title.
fn titled(title: &str, command: &str, arguments: Vec<Value>) -> Command {
    Command::new(title.to_owned(), command.to_owned(), Some(arguments))
}

fn lens(file: &EditorFile, place: Range<usize>, command: Command) -> CodeLens {
    CodeLens { range: file.place(place), command: Some(command), data: None }
}
