//! Reads the values that the editor shows from running controllers, on a thread of its own. It is
//! the only part of the server with a clock.
//!
//! `server` sends the orders and receives the news; `live_view` keeps them. The thread polls about
//! twice a second, and reads values only if the running program is the one in the texts. It
//! requests only the status and values: it never writes.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, unbounded};

use rungd_client::operator::client::CallFailure;
use rungd_client::operator::poller::{PollPace, PolledController};
use rungd_client::operator::protocol::BitOrNumber;
use rungd_client::operator::socket_place::operator_socket;
use rungd_client::operator::{search, socket_of_environment};
use rungd_config::controller::OutputState;
use rungd_config::load::sha256_of;
use rungd_language::source::toml_tree::tokens;

/// Two polls of all controllers a second.
const PACE: PollPace =
    PollPace { every: Duration::from_millis(500), share: 10, retry: Duration::from_millis(500) };

/// The longest wait for an answer: values that are shown must not be older.
const ANSWER_MAX: Duration = Duration::from_secs(2);

/// The controllers to poll, and the operands to read. Without targets the thread sleeps.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct LiveOrder {
    /// The socket in the user's settings, for all projects.
    pub socket: Option<PathBuf>,
    /// The projects.
    pub targets: Vec<LiveTarget>,
}

/// A project that is shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct LiveTarget {
    /// The controller file, or the ladder alone.
    pub root: PathBuf,
    /// The texts of its ladders, in order.
    pub texts: Vec<Arc<str>>,
    /// The operands to read.
    pub operands: Vec<String>,
}

/// The result of a poll of a controller.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum LiveState {
    /// Its values.
    Values(Arc<LiveValues>),
    /// It runs a program that differs from the texts.
    Differs {
        /// The name of the running ladder.
        running: String,
    },
    /// It does not answer, for this reason.
    Silent(String),
}

/// Values of one program.
#[derive(Debug, PartialEq)]
pub(super) struct LiveValues {
    /// The texts of the program.
    pub texts: Vec<Arc<str>>,
    /// The values by operand.
    pub values: HashMap<String, LiveValue>,
}

/// The value of an operand.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LiveValue {
    /// Its value in memory.
    pub memory: BitOrNumber,
    /// The text of that value, if its tag gives one.
    pub text: Option<String>,
    /// For a Y: the state of its output.
    pub output: OutputState,
}

impl LiveValue {
    /// The value that is shown: of an output outside RUN, what is driven. The power of a contact
    /// comes from memory, so it stays where the state of the output is not known.
    pub fn held(&self) -> BitOrNumber {
        match self.output {
            OutputState::Safe(on) => BitOrNumber::Bit(on),
            OutputState::AsMemory | OutputState::Unknown(_) => self.memory,
        }
    }
}

/// The news of a project.
#[derive(Clone, Debug)]
pub(super) struct LiveNews {
    /// The project.
    pub root: PathBuf,
    /// The result of the poll.
    pub state: LiveState,
}

impl LiveValues {
    /// The value of an operand.
    pub fn get(&self, operand: &str) -> Option<&LiveValue> {
        self.values.get(operand)
    }
}

/// Whether both are the same texts in memory, not only equal texts.
pub(super) fn are_same(some: &[Arc<str>], others: &[Arc<str>]) -> bool {
    some.len() == others.len() && some.iter().zip(others).all(|(a, b)| Arc::ptr_eq(a, b))
}

/// Starts the thread. Returns the sender of its orders and the receiver of its news. The thread
/// ends when the sender is dropped.
pub(super) fn start() -> (Sender<LiveOrder>, Receiver<LiveNews>) {
    let (orders, received) = unbounded::<LiveOrder>();
    let (send, news) = unbounded();
    let builder = thread::Builder::new().name("live".to_owned());
    // Without the thread the channel is closed; `server` reports that.
    let _ = builder.spawn(move || {
        let looker = LivePoller { news: send, known: BTreeMap::new() };
        looker.run(&received);
    });
    (orders, news)
}

/// The thread.
struct LivePoller {
    news: Sender<LiveNews>,
    known: BTreeMap<PathBuf, PolledProject>,
}

/// The state of the thread for a project.
#[derive(Default)]
struct PolledProject {
    texts: Vec<Arc<str>>,
    /// SHA-256 of the texts, as `status` reports it for the running texts; then SHA-256 of their
    /// tokens.
    sha256: String,
    tokens: String,
    /// Both hashes of the last texts that ran.
    ran: Option<(String, String)>,
    /// The state that was sent last.
    told: Option<LiveState>,
}

impl LivePoller {
    fn run(mut self, orders: &Receiver<LiveOrder>) {
        let mut order = LiveOrder::default();
        let mut next = Instant::now();
        loop {
            let received = match order.targets.is_empty() {
                true => orders.recv().map_err(|_| RecvTimeoutError::Disconnected),
                false => orders.recv_deadline(next),
            };
            match received {
                // An order waits for the next poll: a fast typist causes no additional polls.
                Ok(newer) => {
                    self.known
                        .retain(|root, _| newer.targets.iter().any(|target| target.root == *root));
                    order = newer;
                }
                Err(RecvTimeoutError::Timeout) => {
                    let began = Instant::now();
                    if !self.look_at_all(&order) {
                        return;
                    }
                    next = Instant::now() + PACE.pause(began.elapsed(), true);
                }
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    /// Polls all controllers once; false if the receiver is gone.
    fn look_at_all(&mut self, order: &LiveOrder) -> bool {
        for target in &order.targets {
            let known = self.known.entry(target.root.clone()).or_default();
            let state = known.look(socket(order.socket.as_ref(), &target.root), target);
            if known.told.as_ref() == Some(&state) {
                continue;
            }
            known.told = Some(state.clone());
            if self.news.send(LiveNews { root: target.root.clone(), state }).is_err() {
                return false;
            }
        }
        true
    }
}

/// The socket of a project's controller: from the user's settings, else from the controller file,
/// else as `rungd status` finds it.
///
/// # Errors
/// None was found, or several.
pub(super) fn socket(said: Option<&PathBuf>, root: &Path) -> Result<PathBuf, CallFailure> {
    let named = || search::socket(socket_of_environment());
    said.cloned().or_else(|| operator_socket(root).path).map_or_else(named, Ok)
}

impl PolledProject {
    fn look(&mut self, socket: Result<PathBuf, CallFailure>, target: &LiveTarget) -> LiveState {
        if !are_same(&self.texts, &target.texts) {
            // The result is sent again, because it now belongs to different texts.
            *self = PolledProject { ran: self.ran.take(), ..PolledProject::default() };
            self.texts = target.texts.clone();
            self.sha256 = sha256_of(target.texts.iter().map(|text| &**text));
            self.tokens = tokens_of(&target.texts);
        }
        let controller = socket.map(|socket| PolledController { socket, answer_max: ANSWER_MAX });
        match controller.and_then(|controller| self.read(&controller, &target.operands)) {
            Ok(state) => state,
            Err(failure) => LiveState::Silent(failure.in_one_line()),
        }
    }

    /// Reads the values between two checks of the program, so that all values are of one program.
    fn read(
        &mut self,
        controller: &PolledController,
        operands: &[String],
    ) -> Result<LiveState, CallFailure> {
        if let Some(running) = self.other(controller)? {
            return Ok(LiveState::Differs { running });
        }
        let read = controller.values(operands)?;
        if let Some(running) = self.other(controller)? {
            return Ok(LiveState::Differs { running });
        }
        let values = read.values.into_iter().map(|shown| {
            let (memory, output) = (shown.value, shown.output());
            (shown.operand, LiveValue { memory, text: shown.text, output })
        });
        let (texts, values) = (self.texts.clone(), values.collect());
        Ok(LiveState::Values(Arc::new(LiveValues { texts, values })))
    }

    /// The name of the running program, if it is not the program of the texts. It is that program
    /// if the texts are equal, or if they differ from the texts that ran only in comments and
    /// spaces.
    fn other(&mut self, controller: &PolledController) -> Result<Option<String>, CallFailure> {
        let status = controller.status()?;
        let running = status.ladder.sha256;
        if running == self.sha256 {
            self.ran = Some((running, self.tokens.clone()));
            return Ok(None);
        }
        let ran = self
            .ran
            .as_ref()
            .is_some_and(|(sha256, tokens)| (sha256, tokens) == (&running, &self.tokens));
        Ok((!ran).then_some(status.ladder.name))
    }
}

/// A hash that is equal for texts that differ only in comments and spaces.
fn tokens_of(texts: &[Arc<str>]) -> String {
    // No token contains the line end that separates tokens and texts.
    let ended = |text| tokens(text).flat_map(|token| [token, "\n"]).chain(["\n"]);
    sha256_of(texts.iter().flat_map(|text| ended(text)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_spaces_do_not_change_the_tokens() {
        let of = |text: &str| tokens_of(&[Arc::from(text)]);
        let text = "[tags]\na = { at = \"X0\" }\n";
        assert_eq!(of(text), of("# all\n[tags] # here\n\n  a={at=\"X0\"}"));
        for other in ["[tags]\na = { at = \"X1\" }\n", "[tags]\na = { at = \"X0 \" }\n", ""] {
            assert_ne!(of(text), of(other), "{other}");
        }
        let two = |a: &str, b: &str| tokens_of(&[Arc::from(a), Arc::from(b)]);
        assert_ne!(two("a", "b"), two("a b", ""));
    }
}
