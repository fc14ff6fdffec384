//! Asks the controller, on a thread of its own: the only part of the monitor with a socket.
//!
//! `run` sends orders and takes the news. The thread looks five times a second, less often if the
//! controller takes long to answer. It changes nothing in a controller but by
//! [`MonitorOrder::Change`].

use std::collections::HashSet;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, SendError, Sender, bounded, unbounded};
use serde::de::DeserializeOwned;

use super::message::{Look, MonitorNews, MonitorOrder};
use super::power_of::PowerOf;
use crate::live::{Follower, LiveProgram, LiveView};
use crate::operator::client::{self, CallFailure};
use crate::operator::protocol::{
    Change, NameList, Refusal, RefusalKind, Request, ShownValue, Status, Values,
};

/// The time between two looks.
const EVERY: Duration = Duration::from_millis(200);

/// A look may take this part of the time: a busy controller is asked less often.
const SHARE: u32 = 10;

/// The time between two looks at a controller that does not answer.
const SILENT_EVERY: Duration = Duration::from_secs(1);

/// The longest wait for a look's answer: what is shown must not be older.
const LOOK_MAX: Duration = Duration::from_secs(2);

/// The longest wait for another answer.
const ANSWER_MAX: Duration = Duration::from_secs(10);

/// News that wait to be taken: a screen that stands still stops the thread.
const NEWS_MAX: usize = 16;

/// A look, or an answer, that nobody wants any more.
type Sent = Result<(), SendError<MonitorNews>>;

/// Starts the thread: where to send orders, and where news come from. It ends when the sender is
/// dropped.
///
/// # Errors
/// The machine has no room for a thread.
pub(super) fn start(socket: PathBuf) -> io::Result<(Sender<MonitorOrder>, Receiver<MonitorNews>)> {
    let (orders, received) = unbounded();
    let (send, news) = bounded(NEWS_MAX);
    let builder = thread::Builder::new().name("monitor".to_owned());
    builder.spawn(move || {
        let asker = ControllerAsker {
            follower: Follower::new(socket.clone()),
            follows: false,
            told: String::new(),
            socket,
            news: send,
            operands: Vec::new(),
            unknown: HashSet::new(),
            program: (0, String::new()),
        };
        asker.run(&received);
    })?;
    Ok((orders, news))
}

/// The thread.
struct ControllerAsker {
    socket: PathBuf,
    /// Reads the scan log: for the ladder, its power, and `why`.
    follower: Follower,
    /// Whether the ladder's power is told at each look.
    follows: bool,
    /// The hash of the ladder that was told last.
    told: String,
    news: Sender<MonitorNews>,
    /// What to read at each look.
    operands: Vec<String>,
    /// Those of them that the program does not know.
    unknown: HashSet<String>,
    /// The process and the hash of the program, of which that is so.
    program: (u32, String),
}

impl ControllerAsker {
    fn run(mut self, orders: &Receiver<MonitorOrder>) {
        let mut next = Instant::now();
        loop {
            let sent = match orders.recv_deadline(next) {
                Ok(order) => {
                    let mut all = vec![order];
                    all.extend(orders.try_iter());
                    self.obey_all(all)
                }
                Err(RecvTimeoutError::Timeout) => {
                    let began = Instant::now();
                    let looked = self.look();
                    let every = if looked.is_ok() { EVERY } else { SILENT_EVERY };
                    let sent = self.tell(looked);
                    next = Instant::now() + every.max(began.elapsed() * SHARE);
                    sent
                }
                Err(RecvTimeoutError::Disconnected) => return,
            };
            if sent.is_err() {
                return;
            }
        }
    }

    /// Obeys orders. Of questions for names the last one alone: a fast typist causes no more.
    fn obey_all(&mut self, orders: Vec<MonitorOrder>) -> Sent {
        let is_names = |order: &MonitorOrder| matches!(order, MonitorOrder::Names(_));
        let last_names = orders.iter().rposition(is_names);
        for (at, order) in orders.into_iter().enumerate() {
            if !is_names(&order) || Some(at) == last_names {
                self.obey(order)?;
            }
        }
        Ok(())
    }

    fn obey(&mut self, order: MonitorOrder) -> Sent {
        let news = match order {
            MonitorOrder::Read(operands) => {
                self.operands = operands;
                return Ok(());
            }
            MonitorOrder::Follow(follows) => {
                self.follows = follows;
                return Ok(());
            }
            MonitorOrder::Ladder => {
                let (sha256, found) = self.ladder();
                self.told.clone_from(&sha256);
                MonitorNews::Ladder(sha256, found)
            }
            MonitorOrder::Names(prefix) => {
                let request = Request::Names { prefix: prefix.clone() };
                let names = self.ask::<NameList>(&request).map(|list| list.names);
                MonitorNews::Names(prefix, names.unwrap_or_default())
            }
            MonitorOrder::Find(operand) => {
                let found = self.ask::<Values>(&Request::Read { operands: vec![operand] });
                MonitorNews::Found(found.map(|of| of.values))
            }
            MonitorOrder::Why(operand) => {
                let answer = self.scans().and_then(|view| view.why(&operand, None));
                let text = answer.map(|answer| format!("{}{}", answer.text(), answer.hints()));
                MonitorNews::Why(operand, text)
            }
            MonitorOrder::Change(request) => {
                MonitorNews::Changed(self.ask::<Change>(&request).map(|change| said(&change)))
            }
        };
        self.news.send(news)
    }

    fn ask<T: DeserializeOwned>(&self, request: &Request) -> Result<T, String> {
        client::ask_within(&self.socket, request, ANSWER_MAX).map_err(|of| of.to_string())
    }

    /// The last scan, and those of the minute before it.
    fn scans(&mut self) -> Result<LiveView, String> {
        self.follower.look().map_err(|failure| failure.to_string())
    }

    /// The ladder of the last program in the scan log, with its hash.
    fn ladder(&mut self) -> (String, Result<Arc<LiveProgram>, String>) {
        match self.scans() {
            Ok(view) => (view.program.recorded.hash.clone(), Ok(view.program)),
            Err(why) => (String::new(), Err(why)),
        }
    }

    /// Tells a look, and with it the power of the ladder.
    fn tell(&mut self, looked: Result<Look, CallFailure>) -> Sent {
        let look = match looked {
            Ok(look) => look,
            Err(failure) => return self.news.send(MonitorNews::Silent(failure.to_string())),
        };
        self.news.send(MonitorNews::Look(Box::new(look)))?;
        if !self.follows {
            return Ok(());
        }
        let seen = self.scans();
        if let Ok(view) = &seen
            && view.program.recorded.hash != self.told
        {
            // Power is shown in the ladder of its own program alone.
            self.told.clone_from(&view.program.recorded.hash);
            let program = Arc::clone(&view.program);
            self.news.send(MonitorNews::Ladder(self.told.clone(), Ok(program)))?;
        }
        let power = seen.map(|view| Arc::new(view) as Arc<dyn PowerOf>);
        self.news.send(MonitorNews::Power(power))
    }

    fn look(&mut self) -> Result<Look, CallFailure> {
        let status: Status = client::ask_within(&self.socket, &Request::Status {}, LOOK_MAX)?;
        let program = (status.pid, status.ladder.sha256.clone());
        if program != self.program {
            self.program = program;
            self.unknown.clear();
        }
        let wanted = self.operands.iter().filter(|of| !self.unknown.contains(*of));
        let wanted: Vec<String> = wanted.cloned().collect();
        let values = self.values(wanted)?;
        let unknown = self.operands.iter().filter(|of| self.unknown.contains(*of));
        Ok(Look { status, values, unknown: unknown.cloned().collect() })
    }

    /// Reads operands; if one is refused, each by itself, and that one not again.
    fn values(&mut self, wanted: Vec<String>) -> Result<Vec<ShownValue>, CallFailure> {
        if wanted.is_empty() {
            return Ok(Vec::new());
        }
        let read = |operands: Vec<String>| {
            let request = Request::Read { operands };
            client::ask_within::<Values>(&self.socket, &request, LOOK_MAX).map(|of| of.values)
        };
        match read(wanted.clone()) {
            Err(failure) if is_unknown(&failure) => {}
            read => return read,
        }
        let mut values = Vec::new();
        let mut unknown = Vec::new();
        for operand in wanted {
            match read(vec![operand.clone()]) {
                Ok(read) => values.extend(read),
                Err(failure) if is_unknown(&failure) => unknown.push(operand),
                Err(failure) => return Err(failure),
            }
        }
        self.unknown.extend(unknown);
        Ok(values)
    }
}

/// Whether the program does not know an operand.
fn is_unknown(failure: &CallFailure) -> bool {
    let CallFailure::Refused(Refusal { kind, .. }) = failure else { return false };
    matches!(kind, RefusalKind::BadOperand | RefusalKind::BadRequest)
}

/// What a change did, as `rungd force` says it.
fn said(change: &Change) -> String {
    let forced = |is: bool| if is { ", forced" } else { "" };
    let note = change.note.as_ref().map_or(String::new(), |note| format!("; note: {note}"));
    format!(
        "{}: {}{}, was {}{}{note}",
        change.now,
        change.now.value,
        forced(change.now.forced),
        change.before,
        forced(change.was_forced)
    )
}
