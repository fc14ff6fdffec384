//! The live view: whether it is on, the observed projects, and their values.
//!
//! `server` passes the settings and the news of the live thread to it; `hints` and `tokens` get the
//! values from it. Values are shown only if the texts are those that the controller runs.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lsp_types::MessageType;
use serde_json::Value;

use super::live_poller::{
    LiveNews, LiveOrder, LiveState, LiveTarget, LiveValues, are_same, socket,
};
use super::outbox::{Outbox, Refreshed};
use rungd_client::operator::client::CallFailure;

/// The live view.
#[derive(Debug, Default)]
pub(super) struct EditorLiveView {
    is_on: bool,
    /// The socket in the user's settings.
    socket: Option<PathBuf>,
    /// The last order to the live thread: the observed projects.
    order: LiveOrder,
    /// The last state of each project.
    found: BTreeMap<PathBuf, LiveState>,
    /// The bytes of each file that the editor shows, as far as they are known.
    visible: HashMap<PathBuf, Range<usize>>,
    /// Whether the targets must be computed again.
    is_stale: bool,
}

impl EditorLiveView {
    /// Applies settings: `{"live": true, "socket": "/run/rungd/rungd.sock"}`, or the same below a
    /// key `rungd`.
    pub fn configure(&mut self, settings: &Value, outbox: &mut Outbox) {
        let settings = settings.get("rungd").unwrap_or(settings);
        if let Some(socket) = settings.get("socket") {
            let path = socket.as_str().filter(|path| !path.is_empty());
            self.socket = path.map(PathBuf::from);
            self.is_stale = true;
        }
        if let Some(on) = settings.get("live").and_then(Value::as_bool) {
            self.switch(on, outbox);
        }
    }

    /// Turns the view on or off.
    pub fn switch(&mut self, on: bool, outbox: &mut Outbox) {
        if self.is_on == on {
            return;
        }
        (self.is_on, self.is_stale) = (on, true);
        self.found.clear();
        show_again(outbox);
        outbox.refresh(Refreshed::Lenses);
    }

    /// The socket of a project's controller.
    ///
    /// # Errors
    /// None was found, or several.
    pub fn socket(&self, root: &Path) -> Result<PathBuf, CallFailure> {
        socket(self.socket.as_ref(), root)
    }

    /// Whether it is on.
    pub fn is_on(&self) -> bool {
        self.is_on
    }

    /// Records that the editor shows this part of a file.
    pub fn shows(&mut self, path: &Path, bytes: Range<usize>) {
        if self.visible.get(path) != Some(&bytes) {
            self.visible.insert(path.to_owned(), bytes);
            self.is_stale = true;
        }
    }

    /// The first byte of a file that the editor shows.
    pub fn visible(&self, path: &Path) -> usize {
        self.visible.get(path).map_or(0, |bytes| bytes.start)
    }

    /// Records that files have changed.
    pub fn changed(&mut self) {
        self.is_stale |= self.is_on;
    }

    /// Whether [`EditorLiveView::aim`] is due.
    pub fn is_stale(&self) -> bool {
        self.is_stale
    }

    /// Sets the observed projects. Returns an order for the live thread, if they have changed.
    pub fn aim(&mut self, targets: Vec<LiveTarget>, outbox: &mut Outbox) -> Option<LiveOrder> {
        self.is_stale = false;
        let order = LiveOrder { socket: self.socket.clone(), targets };
        let same_texts =
            |(a, b): (&LiveTarget, &LiveTarget)| a.root == b.root && are_same(&a.texts, &b.texts);
        let is_same = order.targets.len() == self.order.targets.len()
            && order.targets.iter().zip(&self.order.targets).all(same_texts);
        if is_same && order == self.order {
            return None;
        }
        self.order = order;
        self.found.retain(|root, _| self.order.targets.iter().any(|target| target.root == *root));
        if !is_same {
            show_again(outbox);
        }
        Some(self.order.clone())
    }

    /// Handles news of the live thread. Sends a message to the user when the kind of state changes.
    pub fn hear(&mut self, news: LiveNews, outbox: &mut Outbox) {
        if !self.is_on || !self.order.targets.iter().any(|target| target.root == news.root) {
            return;
        }
        let name = news.root.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let before = self.found.insert(news.root, news.state.clone());
        let was = before.as_ref();
        match &news.state {
            LiveState::Values(_) => {
                if was.is_some_and(|was| !matches!(was, LiveState::Values(_))) {
                    let text = format!("{name}: the controller runs this program: values are live");
                    outbox.say(MessageType::INFO, text);
                }
            }
            LiveState::Differs { running } => {
                if !matches!(was, Some(LiveState::Differs { .. })) {
                    let text = format!(
                        "{name}: no live values: the controller runs a different program \
                         (`{running}`): `rungd reload` loads the saved files"
                    );
                    outbox.say(MessageType::WARNING, text);
                }
            }
            LiveState::Silent(why) => {
                if !matches!(was, Some(LiveState::Silent(_))) {
                    outbox.say(MessageType::WARNING, format!("{name}: no live values: {why}"));
                }
            }
        }
        show_again(outbox);
    }

    /// The values of a project, if the controller runs its present texts.
    pub fn values(&self, root: &Path) -> Option<Arc<LiveValues>> {
        let target = self.order.targets.iter().find(|target| target.root == root)?;
        match self.found.get(root)? {
            LiveState::Values(values) => {
                let is_present = self.is_on && are_same(&values.texts, &target.texts);
                is_present.then(|| values.clone())
            }
            LiveState::Differs { .. } | LiveState::Silent(_) => None,
        }
    }
}

fn show_again(outbox: &mut Outbox) {
    outbox.refresh(Refreshed::Hints);
    outbox.refresh(Refreshed::Tokens);
}
