//! The thread that calls the controller. It requests the changes of tags, the status and the past,
//! and passes on the writes of commands. Its calls block, so it is separate from `shell`, which
//! uses it.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;
use tokio::sync::mpsc;

use super::facts::{NodeFact, of_controller};
use super::journal::{EdgeLines, LineSubject, say};
use super::settings::EdgeSettings;
use super::tags::chooser;
use rungd_client::live::{
    ChangeFollower, ChangeHistory, ChooseCells, HistorySpan, LogEvent, LogPosition, LookFailure,
    RecordedFolder, recorded_folder,
};
use rungd_client::operator::client::CallFailure;
use rungd_client::operator::poller::{ControllerPoller, PollPace};
use rungd_client::operator::protocol::{GivenValue, Request};
use rungd_client::operator::socket_of_environment;
use rungd_net::sparkplug::{MetricValue, vocabulary};

/// The time between two requests for the status.
const STATUS_EVERY: Duration = Duration::from_secs(1);
/// The pause before the next request to a controller that does not answer.
const RETRY: Duration = Duration::from_secs(1);
/// The longest wait for an answer.
const ANSWER_MAX: Duration = Duration::from_secs(5);
/// A write that has waited longer than this is refused: its sender does not expect it any more.
const WRITE_WAIT_MAX: Duration = Duration::from_secs(2);
/// The length of the queue of reports.
const QUEUE: usize = 16;
/// The user that the controller logs for a command.
const COMMANDER: &str = "sparkplug";

/// A request to the thread.
#[derive(Debug)]
pub(super) enum LogRequest {
    /// Begin to read this part of the past, and forget the previous part. The reports have this
    /// number.
    Replay(u64, HistorySpan),
    /// Read the next piece of this part.
    Next,
    /// Write a tag. The time is that of the request.
    Write(String, GivenValue, Instant),
}

/// A report of the thread.
#[derive(Debug)]
pub(super) enum LogReport {
    /// The events up to a scan.
    Live(Vec<LogEvent>, LogPosition),
    /// Facts about the controller.
    Facts(Vec<NodeFact>),
    /// A piece of the past with this number, up to a log position.
    Past(u64, Vec<LogEvent>, LogPosition),
    /// The past with this number is complete.
    PastDone(u64),
    /// The past with this number cannot be read now. It is to be requested again later.
    PastFailed(u64),
}

/// The two channels of the thread.
pub(super) struct LogThread {
    /// The requests to the thread.
    pub asks: Sender<LogRequest>,
    /// The reports of the thread.
    pub told: mpsc::Receiver<LogReport>,
}

impl LogThread {
    /// Starts the thread. It ends when this value is dropped.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(settings: &EdgeSettings, lines: EdgeLines) -> std::io::Result<LogThread> {
        let (asks, inbox) = channel();
        let (tell, told) = mpsc::channel(QUEUE);
        let choose = chooser(settings);
        let named = settings.socket.clone().or_else(socket_of_environment);
        let worker = LogWorker {
            is_set: settings.socket.is_some(),
            poller: ControllerPoller::new(named.clone(), ANSWER_MAX),
            named,
            pace: PollPace { every: settings.interval, share: 0, retry: RETRY },
            follower: ChangeFollower::new(choose.clone()),
            choose,
            history: (0, None),
            folder: None,
            tell,
            unread: None,
            lines,
        };
        let builder = thread::Builder::new().name("log".to_owned());
        builder.spawn(move || worker.work(&inbox))?;
        Ok(LogThread { asks, told })
    }
}

struct LogWorker {
    /// Whether EDGE.toml names the socket.
    is_set: bool,
    named: Option<PathBuf>,
    poller: ControllerPoller,
    pace: PollPace,
    choose: ChooseCells,
    follower: ChangeFollower,
    /// The past that is being read, with its number.
    history: (u64, Option<ChangeHistory>),
    folder: Option<RecordedFolder>,
    tell: mpsc::Sender<LogReport>,
    /// The last logged line about a past that could not be read.
    unread: Option<String>,
    lines: EdgeLines,
}

/// The receiver of the reports is gone.
struct Abandoned;

impl LogWorker {
    fn work(mut self, inbox: &Receiver<LogRequest>) {
        let (mut look_at, mut status_at) = (Instant::now(), Instant::now());
        loop {
            let now = Instant::now();
            if now >= look_at {
                let looked = self.look();
                let Ok(is_seen) = looked else { return };
                look_at = Instant::now() + self.pace.pause(now.elapsed(), is_seen);
            }
            if now >= status_at {
                if self.status().is_err() {
                    return;
                }
                status_at = now + STATUS_EVERY;
            }
            let wait = look_at.min(status_at).saturating_duration_since(Instant::now());
            match inbox.recv_timeout(wait) {
                Ok(ask) => {
                    if self.obey_all(ask, inbox).is_err() {
                        return;
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn send_report(&self, told: LogReport) -> Result<(), Abandoned> {
        self.tell.blocking_send(told).map_err(|_| Abandoned)
    }

    /// Requests the changes and reports them. Returns whether the request succeeded.
    fn look(&mut self) -> Result<bool, Abandoned> {
        let looked = self.new_events();
        let is_seen = looked.is_ok();
        if self.poller.has_turned(is_seen) {
            say(&match &looked {
                Ok(_) => format!("the controller at {} answers", self.poller),
                Err(failure) => format!("the controller does not answer: {}", self.why(failure)),
            });
        }
        match looked {
            Ok(events) => {
                if let Some(at) = self.follower.position() {
                    self.send_report(LogReport::Live(events, at))?;
                }
            }
            Err(LookFailure::Call(_)) => {
                let facts = vec![(vocabulary::CONTROLLER, MetricValue::Bool(false))];
                self.send_report(LogReport::Facts(facts))?;
            }
            Err(LookFailure::Unusable(_)) => {}
        }
        Ok(is_seen)
    }

    fn new_events(&mut self) -> Result<Vec<LogEvent>, LookFailure> {
        let controller = self.poller.controller()?;
        let events = self.follower.look(&controller.socket)?;
        self.poller.keep(&controller);
        Ok(events)
    }

    fn status(&mut self) -> Result<(), Abandoned> {
        let asked = self.poller.controller().and_then(|controller| controller.status_and_alarms());
        let Ok((status, alarms)) = asked else { return Ok(()) };
        self.folder = recorded_folder(&status);
        self.send_report(LogReport::Facts(of_controller(&status, &alarms)))
    }

    /// Carries out a request and the requests that wait behind it. A request for changes may take
    /// long, and a waiting command would be too old after it. After a piece of the past, the
    /// changes of the present come first.
    fn obey_all(
        &mut self,
        first: LogRequest,
        inbox: &Receiver<LogRequest>,
    ) -> Result<(), Abandoned> {
        let mut next = Some(first);
        while let Some(ask) = next {
            let is_past = matches!(ask, LogRequest::Replay(..) | LogRequest::Next);
            self.obey(ask)?;
            next = if is_past { None } else { inbox.try_recv().ok() };
        }
        Ok(())
    }

    fn obey(&mut self, ask: LogRequest) -> Result<(), Abandoned> {
        match ask {
            LogRequest::Replay(number, span) => {
                self.history = (number, self.replay(span));
                match self.history.1 {
                    Some(_) => self.next(),
                    None => self.send_report(LogReport::PastFailed(number)),
                }
            }
            LogRequest::Next => self.next(),
            LogRequest::Write(operand, value, asked) => {
                self.write(operand, value, asked);
                Ok(())
            }
        }
    }

    fn replay(&mut self, span: HistorySpan) -> Option<ChangeHistory> {
        let folder = self.folder.as_ref();
        let controller = self.poller.controller().map_err(LookFailure::Call);
        let opened = controller.and_then(|controller| {
            ChangeHistory::open(&controller.socket, folder, span, self.choose.clone())
        });
        match opened {
            Ok((history, note)) => {
                note.iter().for_each(|note| say(note));
                self.unread = None;
                Some(history)
            }
            Err(failure) => {
                let line = format!("the past cannot be read yet: {}", self.why(&failure));
                // The request is repeated; the same line is logged only once.
                if self.unread.as_ref() != Some(&line) {
                    say(&line);
                }
                self.unread = Some(line);
                None
            }
        }
    }

    fn next(&mut self) -> Result<(), Abandoned> {
        let (number, history) = &mut self.history;
        let number = *number;
        let Some(known) = history else { return self.send_report(LogReport::PastDone(number)) };
        match known.next_section() {
            Some(events) => {
                let at = known.position();
                self.send_report(LogReport::Past(number, events, at))
            }
            None => {
                *history = None;
                self.send_report(LogReport::PastDone(number))
            }
        }
    }

    fn write(&self, operand: String, value: GivenValue, asked: Instant) {
        let line = format!("a host writes {operand}");
        let waited = asked.elapsed();
        if waited > WRITE_WAIT_MAX {
            let waited = waited.as_secs();
            let why = format!("it has waited {waited} s for the controller and is too old");
            return self
                .lines
                .say(LineSubject::OldWrite, &format!("{line}, and is refused: {why}"));
        }
        let for_user = Some(COMMANDER.to_owned());
        let request = Request::Write { operand, value, for_user, from_page: false, reason: None };
        match self.poller.controller().and_then(|controller| controller.ask::<Value>(&request)) {
            Ok(_) => self.lines.say(LineSubject::Write, &line),
            Err(failure @ CallFailure::Broken(..)) => {
                let line = format!("{line}; whether it was done is not known: {failure}");
                self.lines.say(LineSubject::RefusedWrite, &line);
            }
            Err(failure) => {
                let why = self.why(&LookFailure::Call(failure));
                self.lines
                    .say(LineSubject::RefusedWrite, &format!("{line}, and is refused: {why}"));
            }
        }
    }

    /// The reason why the controller does not answer, in terms of the keys of EDGE.toml.
    fn why(&self, failure: &LookFailure) -> String {
        let (path, error) = match failure {
            LookFailure::Call(CallFailure::NotRunning(path, error)) => (path, error),
            LookFailure::Call(failure @ CallFailure::NotFound(_)) => {
                let why = failure.in_one_line();
                return format!("`[node] socket` is not given, and {why}");
            }
            LookFailure::Call(_) | LookFailure::Unusable(_) => return failure.to_string(),
        };
        let named = match (self.is_set, &self.named) {
            (true, _) => "`[node] socket` names this place",
            (false, Some(_)) => "RUNGD_SOCKET names this place; `[node] socket` takes precedence",
            (false, None) => {
                "`[node] socket` is not given, so rungd takes the controller that runs in the \
                 current folder, else the user's only one, else the service's"
            }
        };
        format!(
            "no rungd answers at {}: {error}; is it running? ({named}, and `[operator] socket` of \
             the controller file says where the socket is)",
            path.display()
        )
    }
}
