//! The messages that the server sends to the editor besides its answers: texts for the user,
//! documents to show, and refreshes of something that is shown.
//!
//! Filled by `commands` and by the news of threads; `server` sends the messages after each event.
//! A message that the editor does not support is left out or replaced.

use std::collections::HashMap;
use std::path::Path;

use lsp_server::{Message, Notification, Request, RequestId};
use lsp_types::notification::{DidChangeWatchedFiles, Notification as _, ShowMessage};
use lsp_types::request::{
    CodeLensRefresh, InlayHintRefreshRequest, RegisterCapability, Request as _,
    SemanticTokensRefresh, ShowDocument,
};
use lsp_types::{ClientCapabilities, MessageType, ShowDocumentParams, ShowMessageParams};
use serde_json::{Value, json};

use super::uri::uri_of;

/// What the editor can refresh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Refreshed {
    /// Inlay hints.
    Hints,
    /// Semantic tokens.
    Tokens,
    /// Code lenses.
    Lenses,
}

/// Messages on their way to the editor.
#[derive(Debug, Default)]
pub(super) struct Outbox {
    can: ClientCapabilities,
    messages: Vec<Message>,
    number: u64,
    /// Refreshes that the editor has not answered, each with whether one more must follow. So a
    /// slow editor never has more than one open refresh of a kind.
    asked: HashMap<RequestId, (Refreshed, bool)>,
}

impl Refreshed {
    fn method(self) -> &'static str {
        match self {
            Refreshed::Hints => InlayHintRefreshRequest::METHOD,
            Refreshed::Tokens => SemanticTokensRefresh::METHOD,
            Refreshed::Lenses => CodeLensRefresh::METHOD,
        }
    }

    /// Whether an editor supports this refresh.
    fn is_known(self, can: &ClientCapabilities) -> bool {
        let Some(can) = &can.workspace else { return false };
        let refreshes = match self {
            Refreshed::Hints => can.inlay_hint.as_ref().and_then(|hints| hints.refresh_support),
            Refreshed::Tokens => {
                can.semantic_tokens.as_ref().and_then(|tokens| tokens.refresh_support)
            }
            Refreshed::Lenses => can.code_lens.as_ref().and_then(|lenses| lenses.refresh_support),
        };
        refreshes.unwrap_or(false)
    }
}

impl Outbox {
    /// An outbox for an editor with these capabilities.
    pub fn new(can: ClientCapabilities) -> Outbox {
        Outbox { can, ..Outbox::default() }
    }

    /// Takes the messages to send.
    pub fn take(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.messages)
    }

    /// Adds a text for the user.
    pub fn say(&mut self, typ: MessageType, message: impl Into<String>) {
        let params = ShowMessageParams { typ, message: message.into() };
        let told = Notification::new(ShowMessage::METHOD.to_owned(), params);
        self.messages.push(told.into());
    }

    /// Whether the editor can show documents.
    pub fn shows_documents(&self) -> bool {
        let window = self.can.window.as_ref();
        let shows = window.and_then(|window| window.show_document.as_ref());
        shows.is_some_and(|shows| shows.support)
    }

    /// Shows a file to the user; if the editor cannot show it, shows its path. `outside`: in the
    /// desktop's program for the file.
    pub fn show(&mut self, path: &Path, outside: bool) {
        match uri_of(path).filter(|_| self.shows_documents()) {
            Some(uri) => {
                let (external, take_focus) = (Some(outside), Some(true));
                let params = ShowDocumentParams { uri, external, take_focus, selection: None };
                self.ask(ShowDocument::METHOD, serde_json::to_value(params).unwrap_or_default());
            }
            None => self.say(MessageType::INFO, path.display().to_string()),
        }
    }

    /// Asks the editor to report changes of TOML files on disk, if it can.
    pub fn watch(&mut self) {
        let abilities = self
            .can
            .workspace
            .as_ref()
            .and_then(|workspace| workspace.did_change_watched_files.as_ref());
        if abilities.is_none_or(|watching| watching.dynamic_registration != Some(true)) {
            return;
        }
        let options = json!({ "watchers": [{ "globPattern": "**/*.toml" }] });
        let method = DidChangeWatchedFiles::METHOD;
        let registration = json!({ "id": "files", "method": method, "registerOptions": options });
        self.ask(RegisterCapability::METHOD, json!({ "registrations": [registration] }));
    }

    /// Asks the editor to refresh something. If it has not answered the last such request yet, one
    /// more request follows its answer.
    pub fn refresh(&mut self, what: Refreshed) {
        if !what.is_known(&self.can) {
            return;
        }
        if let Some((_, again)) = self.asked.values_mut().find(|(asked, _)| *asked == what) {
            *again = true;
            return;
        }
        let id = self.ask(what.method(), Value::Null);
        self.asked.insert(id, (what, false));
    }

    /// Handles the editor's answer to a request.
    pub fn answered(&mut self, id: &RequestId) {
        if let Some((what, true)) = self.asked.remove(id) {
            self.refresh(what);
        }
    }

    fn ask(&mut self, method: &str, params: Value) -> RequestId {
        self.number += 1;
        let id = RequestId::from(format!("rungd-{}", self.number));
        let request = Request { id: id.clone(), method: method.to_owned(), params };
        self.messages.push(request.into());
        id
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn methods(outbox: &mut Outbox) -> Vec<String> {
        let method = |message: Message| match message {
            Message::Request(of) => of.method,
            Message::Notification(of) => of.method,
            Message::Response(_) => String::new(),
        };
        outbox.take().into_iter().map(method).collect()
    }

    #[test]
    fn a_slow_editor_gets_at_most_one_pending_refresh_of_a_kind() {
        let can = r#"{"workspace":{"inlayHint":{"refreshSupport":true}}}"#;
        let mut outbox = Outbox::new(serde_json::from_str(can).unwrap());
        outbox.refresh(Refreshed::Tokens);
        (0..3).for_each(|_| outbox.refresh(Refreshed::Hints));
        assert_eq!(methods(&mut outbox), ["workspace/inlayHint/refresh"]);
        outbox.answered(&RequestId::from("rungd-1".to_owned()));
        assert_eq!(methods(&mut outbox), ["workspace/inlayHint/refresh"]);
        outbox.answered(&RequestId::from("rungd-2".to_owned()));
        assert!(methods(&mut outbox).is_empty());
    }

    #[test]
    fn a_document_that_cannot_be_opened_is_named_in_a_message() {
        let mut outbox = Outbox::default();
        outbox.show(Path::new("/tmp/a.svg"), true);
        assert_eq!(methods(&mut outbox), ["window/showMessage"]);
    }
}
