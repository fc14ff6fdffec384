//! What the server has to tell the editor beside its answers: messages, documents to show, and
//! that something shown is to be asked for again.
//!
//! Filled by `commands` and by the news of threads; `server` sends it after each event. What an
//! editor cannot do is left out, or said in another way.

use std::collections::HashMap;
use std::path::Path;

use lsp_server::{Message, Notification, Request, RequestId};
use lsp_types::notification::{Notification as _, ShowMessage};
use lsp_types::request::{
    CodeLensRefresh, InlayHintRefreshRequest, Request as _, SemanticTokensRefresh, ShowDocument,
};
use lsp_types::{ClientCapabilities, MessageType, ShowDocumentParams, ShowMessageParams};
use serde_json::Value;

use super::uri::uri_of;

/// What can be asked for again.
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
    /// Refreshes that the editor has not answered, each with whether another one shall follow. So
    /// a slow editor is never sent more than it can do.
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

    /// Whether an editor can be asked for it.
    fn is_known(self, can: &ClientCapabilities) -> bool {
        let Some(can) = &can.workspace else { return false };
        let refreshes = match self {
            Refreshed::Hints => can.inlay_hint.as_ref().and_then(|of| of.refresh_support),
            Refreshed::Tokens => can.semantic_tokens.as_ref().and_then(|of| of.refresh_support),
            Refreshed::Lenses => can.code_lens.as_ref().and_then(|of| of.refresh_support),
        };
        refreshes.unwrap_or(false)
    }
}

impl Outbox {
    /// For an editor that can do this.
    pub fn new(can: ClientCapabilities) -> Outbox {
        Outbox { can, ..Outbox::default() }
    }

    /// What is to be sent.
    pub fn take(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.messages)
    }

    /// A sentence for the person.
    pub fn say(&mut self, typ: MessageType, message: impl Into<String>) {
        let params = ShowMessageParams { typ, message: message.into() };
        let told = Notification::new(ShowMessage::METHOD.to_owned(), params);
        self.messages.push(told.into());
    }

    /// Whether the editor shows documents.
    pub fn shows_documents(&self) -> bool {
        let window = self.can.window.as_ref();
        let shows = window.and_then(|window| window.show_document.as_ref());
        shows.is_some_and(|shows| shows.support)
    }

    /// A file for the person to see; its path, if the editor cannot show it. `outside`: by the
    /// program that the desktop has for it.
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

    /// Has the editor ask for something again; once more after the last time that it was told, if
    /// it has not done that yet.
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

    /// The editor has answered a request.
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
    fn a_slow_editor_is_asked_once_more_and_no_more_than_that() {
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
    fn a_document_that_cannot_be_shown_is_named() {
        let mut outbox = Outbox::default();
        outbox.show(Path::new("/tmp/a.svg"), true);
        assert_eq!(methods(&mut outbox), ["window/showMessage"]);
    }
}
