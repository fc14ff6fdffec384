//! The requests that the server answers, each with its function.

use anyhow::{Error, Result};
use lsp_server::{ErrorCode, Request};
use lsp_types::request::{
    CodeActionRequest, CodeLensRequest, Completion, DocumentHighlightRequest,
    DocumentSymbolRequest, ExecuteCommand, FoldingRangeRequest, Formatting, GotoDefinition,
    HoverRequest, InlayHintRequest, PrepareRenameRequest, References, Rename, Request as RequestOf,
    SemanticTokensFullRequest,
};
use lsp_types::{CodeActionOrCommand, CodeActionParams};
use serde_json::Value;

use super::actions;
use super::commands;
use super::complete;
use super::fixes;
use super::formatting;
use super::hints;
use super::hover;
use super::lenses;
use super::navigate;
use super::rename;
use super::symbols;
use super::tokens;
use super::workspace::Workspace;

/// The refusal of a request.
#[derive(Debug)]
pub(super) struct RefusedRequest {
    /// The error code of the protocol.
    pub code: ErrorCode,
    /// The reason, for the user.
    pub why: String,
}

/// The answer to a request.
///
/// # Errors
/// The request is unknown, its parameters cannot be read, or it fails.
pub(super) fn answer(workspace: &mut Workspace, request: Request) -> Result<Value, RefusedRequest> {
    let asked = AskedRequest { workspace, request };
    match asked.request.method.as_str() {
        GotoDefinition::METHOD => asked.by::<GotoDefinition>(navigate::definition),
        References::METHOD => asked.by::<References>(navigate::references),
        PrepareRenameRequest::METHOD => asked.by::<PrepareRenameRequest>(rename::prepare),
        Rename::METHOD => asked.by::<Rename>(rename::rename),
        DocumentHighlightRequest::METHOD => {
            asked.by::<DocumentHighlightRequest>(navigate::highlights)
        }
        Formatting::METHOD => asked.by::<Formatting>(formatting::formatting),
        FoldingRangeRequest::METHOD => asked.by::<FoldingRangeRequest>(symbols::folding),
        Completion::METHOD => asked.by::<Completion>(complete::completion),
        HoverRequest::METHOD => asked.by::<HoverRequest>(hover::hover),
        DocumentSymbolRequest::METHOD => asked.by::<DocumentSymbolRequest>(symbols::symbols),
        InlayHintRequest::METHOD => asked.by::<InlayHintRequest>(hints::hints),
        SemanticTokensFullRequest::METHOD => asked.by::<SemanticTokensFullRequest>(tokens::tokens),
        CodeLensRequest::METHOD => asked.by::<CodeLensRequest>(lenses::lenses),
        CodeActionRequest::METHOD => asked.by::<CodeActionRequest>(code_actions),
        ExecuteCommand::METHOD => asked.by::<ExecuteCommand>(commands::execute),
        other => {
            let why = format!("there is no request `{other}` here");
            Err(RefusedRequest { code: ErrorCode::MethodNotFound, why })
        }
    }
}

/// How closely an answer depends on the files on disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DiskCare {
    /// The answer changes no text.
    Shows,
    /// The answer has edits of one file, which the editor has open.
    EditsOne,
    /// The answer has edits of files that may not be open.
    EditsAll,
}

/// How closely the answer to a request depends on the files on disk.
pub(super) fn disk_care(method: &str) -> DiskCare {
    match method {
        Rename::METHOD | PrepareRenameRequest::METHOD | Formatting::METHOD => DiskCare::EditsAll,
        CodeActionRequest::METHOD => DiskCare::EditsOne,
        _ => DiskCare::Shows,
    }
}

/// The fixes of the findings at a place, and the commands for that place.
fn code_actions(
    workspace: &mut Workspace,
    params: CodeActionParams,
) -> Result<Option<Vec<CodeActionOrCommand>>> {
    let mut all = fixes::actions(workspace, params.clone())?.unwrap_or_default();
    all.extend(actions::actions(workspace, params)?.unwrap_or_default());
    Ok(Some(all))
}

struct AskedRequest<'w> {
    workspace: &'w mut Workspace,
    request: Request,
}

impl AskedRequest<'_> {
    /// Answers the request with a function.
    fn by<R: RequestOf>(
        self,
        answer: impl FnOnce(&mut Workspace, R::Params) -> Result<R::Result>,
    ) -> Result<Value, RefusedRequest> {
        let refused = |code, why| RefusedRequest { code, why };
        let params = serde_json::from_value(self.request.params).map_err(|error| {
            let why = format!("the parameters of `{}`: {error}", R::METHOD);
            refused(ErrorCode::InvalidParams, why)
        })?;
        let failed = |error: Error| refused(ErrorCode::RequestFailed, format!("{error:#}"));
        let result = answer(self.workspace, params).map_err(failed)?;
        serde_json::to_value(result).map_err(|error| failed(error.into()))
    }
}
