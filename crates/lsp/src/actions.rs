//! Code actions that are commands: explain the name at the cursor, and explain its value in the
//! running controller.

use anyhow::Result;
use lsp_types::{CodeActionOrCommand, CodeActionParams, Command};
use serde_json::json;

#[cfg(feature = "prove")]
use super::commands::HOW;
use super::commands::{EXPLAIN, WHY};
use super::hover;
use super::operands;
use super::workspace::Workspace;

/// The commands for a place.
pub(super) fn actions(
    workspace: &mut Workspace,
    params: CodeActionParams,
) -> Result<Option<Vec<CodeActionOrCommand>>> {
    let (uri, position) = (params.text_document.uri, params.range.start);
    let Some(cursor) = workspace.cursor_at(&uri, position) else { return Ok(None) };
    let wants = |kind: &lsp_types::CodeActionKind| kind.as_str().is_empty();
    if params.context.only.is_some_and(|only| !only.iter().any(wants)) {
        return Ok(Some(Vec::new()));
    }
    let command = |title: String, command: &str| {
        let arguments = vec![json!(uri), json!(position)];
        CodeActionOrCommand::Command(Command::new(title, command.to_owned(), Some(arguments)))
    };
    let mut offered = Vec::new();
    if let Some((name, _)) = hover::explained(&cursor) {
        offered.push(command(format!("Explain `{name}`"), EXPLAIN));
    }
    if let Some(operand) = operands::asked(&cursor.project, cursor.numbered(), cursor.offset) {
        offered.push(command(format!("Why is `{operand}` what it is?"), WHY));
        #[cfg(feature = "prove")]
        offered.push(command(format!("How could `{operand}` change?"), HOW));
    }
    Ok(Some(offered))
}
