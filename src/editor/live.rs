//! Reads the values that the editor shows from running controllers, on a thread of its own: the
//! only part of the server with a clock.
//!
//! `server` hands over what to read and takes the news; `live_view` keeps them. The thread looks
//! about twice a second, only if the program that runs is the one in the texts, and asks for the
//! status and for values alone: it never writes.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, unbounded};
use serde::de::DeserializeOwned;
use toml_parser::Source;
use toml_parser::lexer::{Token, TokenKind};

use crate::daemon::config::sha256_of;
use crate::daemon::operator_socket;
use crate::operator::client::{self, CallFailure};
use crate::operator::protocol::{
    Held, OPERANDS_MAX, Refusal, RefusalKind, Request, Status, Values,
};
use crate::operator::socket_of_environment;

/// The time between two looks.
const EVERY: Duration = Duration::from_millis(500);

/// A look may take this part of the time: a busy controller is asked less often.
const SHARE: u32 = 10;

/// The most requests for values of one look: to find operands that are refused may take several.
const READS_MAX: u32 = 32;

/// The longest wait for an answer: what is shown must not be older.
const ANSWER_MAX: Duration = Duration::from_secs(2);

/// Which controllers to look at, and for what. Without targets the thread sleeps.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct LiveOrder {
    /// The socket that the person names, for all.
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

/// What a look at a controller found.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum LiveState {
    /// Its values.
    Values(Arc<LiveValues>),
    /// It runs another program than that in the texts.
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
    /// By operand.
    pub values: HashMap<String, Held>,
}

/// The news of a project.
#[derive(Clone, Debug)]
pub(super) struct LiveNews {
    /// The project.
    pub root: PathBuf,
    /// What was found.
    pub state: LiveState,
}

impl LiveValues {
    /// The value of an operand.
    pub fn get(&self, operand: &str) -> Option<Held> {
        self.values.get(operand).copied()
    }
}

/// Whether these are the same texts, and not only equal ones.
pub(super) fn are_same(some: &[Arc<str>], others: &[Arc<str>]) -> bool {
    some.len() == others.len() && some.iter().zip(others).all(|(a, b)| Arc::ptr_eq(a, b))
}

/// The thread: where to send orders, and where news come from. It ends when the sender is dropped.
pub(super) fn start() -> (Sender<LiveOrder>, Receiver<LiveNews>) {
    let (orders, received) = unbounded::<LiveOrder>();
    let (send, news) = unbounded();
    let builder = thread::Builder::new().name("live".to_owned());
    // Without the thread the channel is closed, which `server` tells.
    let _ = builder.spawn(move || {
        let looker = Looker { news: send, known: BTreeMap::new() };
        looker.run(&received);
    });
    (orders, news)
}

/// The thread.
struct Looker {
    news: Sender<LiveNews>,
    known: BTreeMap<PathBuf, Known>,
}

/// What the thread knows of a project.
#[derive(Default)]
struct Known {
    texts: Vec<Arc<str>>,
    /// SHA-256 of the texts, as `status` tells it of the running ones; and that of their tokens.
    sha256: String,
    tokens: String,
    /// Those of the last texts that ran.
    ran: Option<(String, String)>,
    /// Operands that the controller does not know.
    unreadable: HashSet<String>,
    /// How many requests for values are left to this look.
    reads_left: u32,
    /// What was told last.
    told: Option<LiveState>,
}

impl Looker {
    fn run(mut self, orders: &Receiver<LiveOrder>) {
        let mut order = LiveOrder::default();
        let mut next = Instant::now();
        loop {
            let received = match order.targets.is_empty() {
                true => orders.recv().map_err(|_| RecvTimeoutError::Disconnected),
                false => orders.recv_deadline(next),
            };
            match received {
                // An order waits for its turn: a fast typist causes no more looks.
                Ok(newer) => {
                    self.known.retain(|root, _| newer.targets.iter().any(|of| of.root == *root));
                    order = newer;
                }
                Err(RecvTimeoutError::Timeout) => {
                    let began = Instant::now();
                    if !self.look_at_all(&order) {
                        return;
                    }
                    next = Instant::now() + EVERY.max(began.elapsed() * SHARE);
                }
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    /// Looks once; false if nobody listens any more.
    fn look_at_all(&mut self, order: &LiveOrder) -> bool {
        for target in &order.targets {
            let known = self.known.entry(target.root.clone()).or_default();
            let state = known.look(&socket(order.socket.as_ref(), &target.root), target);
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

/// The socket of a project's controller: as the person says, else as the controller file or the
/// environment does.
pub(super) fn socket(said: Option<&PathBuf>, root: &Path) -> PathBuf {
    let named = || client::socket(socket_of_environment());
    said.cloned().or_else(|| operator_socket(root)).unwrap_or_else(named)
}

impl Known {
    fn look(&mut self, socket: &Path, target: &LiveTarget) -> LiveState {
        if !are_same(&self.texts, &target.texts) {
            // What is found is told again: it stands beside other texts.
            *self = Known { ran: self.ran.take(), ..Known::default() };
            self.texts = target.texts.clone();
            self.sha256 = sha256_of(target.texts.iter().map(|text| &**text));
            self.tokens = tokens_of(&target.texts);
        }
        match self.read(socket, &target.operands) {
            Ok(state) => state,
            Err(failure) => LiveState::Silent(failure.to_string()),
        }
    }

    /// Reads the values between two looks at the program, so that they are of one program.
    fn read(&mut self, socket: &Path, operands: &[String]) -> Result<LiveState, CallFailure> {
        if let Some(running) = self.other(socket)? {
            return Ok(LiveState::Differs { running });
        }
        let mut values = HashMap::new();
        self.reads_left = READS_MAX;
        let wanted: Vec<String> =
            operands.iter().filter(|of| !self.unreadable.contains(*of)).cloned().collect();
        for some in wanted.chunks(OPERANDS_MAX) {
            self.read_some(socket, some, &mut values)?;
        }
        if let Some(running) = self.other(socket)? {
            return Ok(LiveState::Differs { running });
        }
        let texts = self.texts.clone();
        Ok(LiveState::Values(Arc::new(LiveValues { texts, values })))
    }

    /// The name of the running program, if it is another one. It is the same if the texts are, or
    /// if they differ from those that ran in comments and spaces alone.
    fn other(&mut self, socket: &Path) -> Result<Option<String>, CallFailure> {
        let status: Status = ask(socket, &Request::Status {})?;
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

    /// Reads some operands. One that is refused is found by halves, and not asked for again.
    fn read_some(
        &mut self,
        socket: &Path,
        some: &[String],
        values: &mut HashMap<String, Held>,
    ) -> Result<(), CallFailure> {
        if self.reads_left == 0 {
            return Ok(());
        }
        self.reads_left -= 1;
        let request = Request::Read { operands: some.to_vec() };
        match ask::<Values>(socket, &request) {
            Ok(read) => {
                values.extend(read.values.into_iter().map(|of| (of.operand, of.value)));
                Ok(())
            }
            Err(CallFailure::Refused(Refusal {
                kind: RefusalKind::BadOperand | RefusalKind::BadRequest,
                ..
            })) => {
                if let [one] = some {
                    self.unreadable.insert(one.clone());
                    return Ok(());
                }
                let (first, second) = some.split_at(some.len() / 2);
                self.read_some(socket, first, values)?;
                self.read_some(socket, second, values)
            }
            Err(failure) => Err(failure),
        }
    }
}

fn ask<T: DeserializeOwned>(socket: &Path, request: &Request) -> Result<T, CallFailure> {
    client::ask_within(socket, request, ANSWER_MAX)
}

/// A text that is equal for texts that differ in comments and spaces alone.
fn tokens_of(texts: &[Arc<str>]) -> String {
    let is_said = |token: &Token| {
        !matches!(
            token.kind(),
            TokenKind::Whitespace | TokenKind::Newline | TokenKind::Comment | TokenKind::Eof
        )
    };
    let tokens = texts.iter().flat_map(|text| {
        let said = Source::new(text).lex().filter(is_said);
        let said = said.map(|token| &text[token.span().start()..token.span().end()]);
        // What ends a token and a text is in none of them.
        said.flat_map(|token| [token, "\n"]).chain(["\n"])
    });
    sha256_of(tokens)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_spaces_change_no_tokens() {
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
