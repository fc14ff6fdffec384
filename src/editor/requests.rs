//! The requests that the server answers, each with the function that does.

use anyhow::{Context, Result};
use lsp_server::Request;
use lsp_types::request::{
    Completion, DocumentHighlightRequest, DocumentSymbolRequest, FoldingRangeRequest, Formatting,
    GotoDefinition, PrepareRenameRequest, References, Rename, Request as RequestOf,
};
use serde_json::Value;

use super::complete;
use super::formatting;
use super::navigate;
use super::rename;
use super::symbols;
use super::workspace::Workspace;

/// The answer to a request; `None`: it is not known.
///
/// # Errors
/// Its parameters cannot be read, or it cannot be done.
pub(super) fn answer(workspace: &mut Workspace, request: Request) -> Result<Option<Value>> {
    let asked = Asked { workspace, request };
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
        DocumentSymbolRequest::METHOD => asked.by::<DocumentSymbolRequest>(symbols::symbols),
        _ => Ok(None),
    }
}

struct Asked<'w> {
    workspace: &'w mut Workspace,
    request: Request,
}

impl Asked<'_> {
    /// Answers by a function.
    fn by<R: RequestOf>(
        self,
        answer: impl FnOnce(&mut Workspace, R::Params) -> Result<R::Result>,
    ) -> Result<Option<Value>> {
        let params = serde_json::from_value(self.request.params)
            .with_context(|| format!("the parameters of `{}`", R::METHOD))?;
        Ok(Some(serde_json::to_value(answer(self.workspace, params)?)?))
    }
}
