//! Sends requests to the controller, on its own thread. The only part of the monitor with a socket.
//!
//! `run` sends orders and takes the news. The thread looks at the controller five times a second,
//! and less often if the answers are slow. It changes a controller only by
//! [`ThreadOrder::Change`].

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, SendError, Sender, bounded, unbounded};
use serde::de::DeserializeOwned;

use super::message::{ControllerLook, MonitorNews, ThreadOrder};
use super::power_of::PowerOf;
use rungd_client::live::{ControllerFollower, LiveProgram, LiveView};
use rungd_client::operator::client::CallFailure;
use rungd_client::operator::poller::{PollPace, PolledController, PolledValues};
use rungd_client::operator::protocol::{
    AckList, AlarmList, AlarmShelf, ChangedOperand, NameList, OperandValues, Request, ShelfList,
    ShelvedAlarm,
};

/// Five looks a second, one a second at a controller that does not answer.
const PACE: PollPace =
    PollPace { every: Duration::from_millis(200), share: 10, retry: Duration::from_secs(1) };

/// The longest wait for the answer to a look, since older values must not be shown.
const LOOK_MAX: Duration = Duration::from_secs(2);

/// The longest wait for any other answer.
const ANSWER_MAX: Duration = Duration::from_secs(10);

/// The most news that wait to be taken. If the screen does not take them, the thread waits.
const NEWS_MAX: usize = 16;

/// The result of sending news; an error means that nobody receives them any more.
type NewsSent = Result<(), SendError<MonitorNews>>;

/// Starts the thread. Returns the sender of orders and the receiver of news. The thread ends when
/// the sender is dropped.
///
/// # Errors
/// The system cannot start a thread.
pub(super) fn start(socket: PathBuf) -> io::Result<(Sender<ThreadOrder>, Receiver<MonitorNews>)> {
    let (orders, received) = unbounded();
    let (send, news) = bounded(NEWS_MAX);
    let builder = thread::Builder::new().name("monitor".to_owned());
    builder.spawn(move || {
        let asker = RequestThread {
            controller: PolledController { socket, answer_max: LOOK_MAX },
            follower: ControllerFollower::default(),
            follows: false,
            told: String::new(),
            news: send,
            operands: Vec::new(),
        };
        asker.run(&received);
    })?;
    Ok((orders, news))
}

/// The state of the thread.
struct RequestThread {
    controller: PolledController,
    /// Reads the scan log: for the ladder, its power, and `why`.
    follower: ControllerFollower,
    /// Whether the power of the ladder is sent after each look.
    follows: bool,
    /// The hash of the ladder that was sent last.
    told: String,
    news: Sender<MonitorNews>,
    /// The operands to read at each look.
    operands: Vec<String>,
}

impl RequestThread {
    fn run(mut self, orders: &Receiver<ThreadOrder>) {
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
                    let answered = looked.is_ok();
                    let sent = self.send_look(looked);
                    next = Instant::now() + PACE.pause(began.elapsed(), answered);
                    sent
                }
                Err(RecvTimeoutError::Disconnected) => return,
            };
            if sent.is_err() {
                return;
            }
        }
    }

    /// Obeys orders. Of several requests for names, only the last one is sent, so that fast typing
    /// does not cause many requests.
    fn obey_all(&mut self, orders: Vec<ThreadOrder>) -> NewsSent {
        let is_names = |order: &ThreadOrder| matches!(order, ThreadOrder::Names(_));
        let last_names = orders.iter().rposition(is_names);
        for (at, order) in orders.into_iter().enumerate() {
            if !is_names(&order) || Some(at) == last_names {
                self.obey(order)?;
            }
        }
        Ok(())
    }

    fn obey(&mut self, order: ThreadOrder) -> NewsSent {
        let news = match order {
            ThreadOrder::Read(operands) => {
                self.operands = operands;
                return Ok(());
            }
            ThreadOrder::Follow(follows) => {
                self.follows = follows;
                return Ok(());
            }
            ThreadOrder::Ladder => {
                let (sha256, found) = self.ladder();
                self.told.clone_from(&sha256);
                MonitorNews::Ladder(sha256, found)
            }
            ThreadOrder::Names(prefix) => {
                let request = Request::Names { prefix: prefix.clone() };
                let names = self.ask::<NameList>(&request).map(|list| list.names);
                MonitorNews::Names(prefix, names.unwrap_or_default())
            }
            ThreadOrder::Find(operand) => {
                let found = self
                    .ask::<OperandValues>(&Request::Read { operands: vec![operand], each: false });
                MonitorNews::Found(found.map(|list| list.values))
            }
            ThreadOrder::Why(operand) => {
                let answer = self.scans().and_then(|view| view.why(&operand, None));
                let text = answer.map(|answer| format!("{}{}", answer.text(), answer.hints()));
                MonitorNews::Why(operand, text)
            }
            ThreadOrder::Change(request) => MonitorNews::Changed(self.change(&request)),
        };
        self.news.send(news)
    }

    fn ask<T: DeserializeOwned>(&self, request: &Request) -> Result<T, String> {
        let controller = PolledController { answer_max: ANSWER_MAX, ..self.controller.clone() };
        controller.ask(request).map_err(|failure| failure.to_string())
    }

    fn change(&self, request: &Request) -> Result<String, String> {
        if let Request::Ack { .. } = request {
            let alarms = self.ask::<AckList>(request)?.alarms;
            let said = alarms.iter().map(|alarm| {
                format!("{}: now {}{}", alarm.tag, alarm.after.name(), alarm.bit_words())
            });
            return Ok(said.collect::<Vec<_>>().join(", "));
        }
        if let Request::Shelve { .. } | Request::Unshelve { .. } = request {
            return self.ask::<ShelfList>(request).map(|list| shelf_words(&list));
        }
        self.ask::<ChangedOperand>(request).map(|change| said(&change))
    }

    /// The last scan, and the scans of the minute before it.
    fn scans(&mut self) -> Result<LiveView, String> {
        let looked = self.follower.look(&self.controller.socket);
        looked.map_err(|failure| failure.to_string())
    }

    /// The ladder of the last program in the scan log, with its hash.
    fn ladder(&mut self) -> (String, Result<Arc<LiveProgram>, String>) {
        match self.scans() {
            Ok(view) => (view.program.recorded.hash.clone(), Ok(view.program)),
            Err(why) => (String::new(), Err(why)),
        }
    }

    /// Sends the news of a look, and the power of the ladder.
    fn send_look(&mut self, looked: Result<ControllerLook, CallFailure>) -> NewsSent {
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
            // Power is shown only in the ladder of its own program.
            self.told.clone_from(&view.program.recorded.hash);
            let program = Arc::clone(&view.program);
            self.news.send(MonitorNews::Ladder(self.told.clone(), Ok(program)))?;
        }
        let power = seen.map(|view| Arc::new(view) as Arc<dyn PowerOf>);
        self.news.send(MonitorNews::Power(power))
    }

    fn look(&self) -> Result<ControllerLook, CallFailure> {
        let mut status = self.controller.status()?;
        // Those that wait for an acknowledgement, and those that are shelved, too.
        if let Ok(AlarmList { alarms, .. }) = self.controller.ask(&Request::Alarms {}) {
            status.alarms = alarms;
        }
        let PolledValues { values, refused } = self.controller.values(&self.operands)?;
        let unknown = refused.into_iter().map(|refused| refused.operand).collect();
        Ok(ControllerLook { status, values, unknown })
    }
}

/// What a shelf has done.
fn shelf_words(list: &ShelfList) -> String {
    let one = |alarm: &ShelvedAlarm| {
        let now = alarm.after.as_ref().map_or("back in the list", AlarmShelf::words);
        format!("{}: now {now}", alarm.tag)
    };
    let mut words = list.alarms.iter().map(one).collect::<Vec<_>>().join(", ");
    if let Some(why) = &list.not_kept {
        words.push_str(&format!("; a restart of rungd would forget it: {why}"));
    }
    words
}

/// The result of a change, in the words of `rungd force`.
fn said(change: &ChangedOperand) -> String {
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
