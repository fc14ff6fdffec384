//! The thread that follows the controller. While a page is open, it looks at the controller five
//! times a second, and passes each result to all viewers.
//!
//! While no page is open, it sends the controller no requests. Only at the start it sends one, so
//! that the program is known when the first viewer comes. After a slow answer the pause before the
//! next request is longer.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};

use serde_json::Value;
use tokio::sync::watch;
use tokio::time::timeout;

use super::journal::say;
use rungd_client::live::{ControllerFollower, LiveView, LookFailure};
use rungd_client::operator::client::CallFailure;
use rungd_client::operator::poller::{ControllerPoller, PollPace};
use rungd_client::operator::protocol::Request;

/// Five looks a second, one a second at a controller that does not answer.
const PACE: PollPace =
    PollPace { every: Duration::from_millis(200), share: 1, retry: Duration::from_secs(1) };
/// The time between two requests for the status.
const STATUS_EVERY: Duration = Duration::from_secs(1);
/// The time that the thread continues after the last request of a viewer.
const VIEWED: Duration = Duration::from_secs(10);
/// The greatest age of a result that is shown to a new viewer.
const FRESH: Duration = Duration::from_secs(2);
/// The longest wait for a look.
const WAIT_MAX: Duration = Duration::from_secs(8);
/// The longest wait for a status.
const ANSWER_MAX: Duration = Duration::from_secs(5);

/// The result of one look.
#[derive(Clone, Debug)]
pub(super) struct LookResult {
    /// The time of the look.
    pub at: Instant,
    /// The socket of the controller that the pages show; `None` until one has answered.
    pub socket: Option<PathBuf>,
    /// The controller, or why the look failed.
    pub view: Result<LiveView, String>,
    /// The controller's status and alarms, in the form of `rungd status --json`.
    pub status: Option<Arc<Value>>,
}

/// The thread, and its last result.
#[derive(Clone)]
pub(super) struct FollowThread {
    seen: watch::Receiver<Arc<LookResult>>,
    began: Instant,
    /// The time of the last request of a viewer, ms after `began`.
    viewed_ms: Arc<AtomicU64>,
    thread: Thread,
}

impl FollowThread {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(named: Option<PathBuf>) -> std::io::Result<FollowThread> {
        let began = Instant::now();
        let view = Err("the controller has not been contacted yet".into());
        let none = LookResult { at: began, socket: None, view, status: None };
        let (tell, seen) = watch::channel(Arc::new(none));
        let viewed_ms = Arc::new(AtomicU64::new(0));
        let asked = Arc::clone(&viewed_ms);
        let is_viewed = move || {
            let last = Duration::from_millis(asked.load(Ordering::Relaxed));
            last > Duration::ZERO && began.elapsed() < last + VIEWED
        };
        let builder = thread::Builder::new().name("follow".to_owned());
        let thread =
            builder.spawn(move || follow(named.as_ref(), &tell, &is_viewed))?.thread().clone();
        Ok(FollowThread { seen, began, viewed_ms, thread })
    }

    /// A `FollowThread` without a controller.
    pub fn of_nothing() -> FollowThread {
        let began = Instant::now();
        let view = Err("there is no controller".into());
        let none = LookResult { at: began, socket: None, view, status: None };
        let (_, seen) = watch::channel(Arc::new(none));
        let viewed_ms = Arc::new(AtomicU64::new(0));
        FollowThread { seen, began, viewed_ms, thread: thread::current() }
    }

    /// Notes the request of a viewer.
    fn touch(&self) {
        let now = self.began.elapsed().as_millis() as u64;
        self.viewed_ms.store(now.max(1), Ordering::Relaxed);
        self.thread.unpark();
    }

    /// The last result, however old it is.
    pub fn latest(&self) -> Arc<LookResult> {
        Arc::clone(&self.seen.borrow())
    }

    /// A fresh result.
    pub async fn now(&self) -> Arc<LookResult> {
        self.when(&|_| true).await
    }

    /// A fresh result with the minute before it.
    pub async fn with_minute(&self) -> Arc<LookResult> {
        self.when(&|seen| seen.view.as_ref().map_or(true, |view| view.has_minute)).await
    }

    async fn when(&self, fits: &(dyn Fn(&LookResult) -> bool + Sync)) -> Arc<LookResult> {
        self.touch();
        let mut seen = self.seen.clone();
        let is_fresh = |seen: &Arc<LookResult>| {
            seen.at > self.began && seen.at.elapsed() < FRESH && fits(seen)
        };
        let fresh = timeout(WAIT_MAX, seen.wait_for(is_fresh)).await;
        match fresh {
            Ok(Ok(seen)) => Arc::clone(&seen),
            Ok(Err(_)) | Err(_) => Arc::clone(&self.seen.borrow()),
        }
    }

    /// The next result.
    pub async fn next(
        &self,
        seen: &mut watch::Receiver<Arc<LookResult>>,
    ) -> Option<Arc<LookResult>> {
        self.touch();
        match timeout(VIEWED / 2, seen.changed()).await {
            Ok(Err(_)) => None,
            Ok(Ok(())) | Err(_) => Some(Arc::clone(&seen.borrow_and_update())),
        }
    }

    /// The socket of the controller that the pages show; `None` until one has answered.
    pub fn socket(&self) -> Option<PathBuf> {
        self.seen.borrow().socket.clone()
    }

    /// The receiver for [`FollowThread::next`].
    pub fn watcher(&self) -> watch::Receiver<Arc<LookResult>> {
        self.seen.clone()
    }
}

/// The controller that the pages show. If no socket is named, it is searched for until one answers:
/// a controller may start later than the pages. After that its socket stays the same.
struct FollowedController {
    poller: ControllerPoller,
    follower: ControllerFollower,
}

impl FollowedController {
    fn look(&mut self) -> Result<LiveView, LookFailure> {
        let controller = self.poller.controller()?;
        let view = self.follower.look(&controller.socket)?;
        self.poller.keep(&controller);
        Ok(view)
    }

    /// Says what came of a look, if it is something else than before.
    fn log_look(&self, looked: &Result<LiveView, LookFailure>) {
        say(&match looked {
            Ok(_) => format!("the controller at {} answers", self.poller),
            Err(LookFailure::Call(failure)) => {
                format!("the controller cannot be shown: {}", failure.in_one_line())
            }
            Err(failure @ LookFailure::Unusable(_)) => {
                format!("the controller cannot be shown: {failure}")
            }
        });
    }

    /// The status, with all listed alarms: active ones, and returned ones that nobody has
    /// acknowledged.
    fn status(&self) -> Option<Value> {
        self.poller.kept()?;
        let controller = self.poller.controller().ok()?;
        let mut status: Value = controller.ask(&Request::Status {}).ok()?;
        if let Ok(listed) = controller.ask::<Value>(&Request::Alarms {}) {
            status["alarms"] = listed["alarms"].clone();
        }
        Some(status)
    }
}

/// Looks at the controller until no receiver is left.
fn follow(
    named: Option<&PathBuf>,
    tell: &watch::Sender<Arc<LookResult>>,
    is_viewed: &dyn Fn() -> bool,
) {
    let poller = ControllerPoller::new(named.cloned(), ANSWER_MAX);
    let mut followed = FollowedController { poller, follower: ControllerFollower::default() };
    let first = followed.look();
    followed.poller.has_turned(first.is_ok());
    match &first {
        Ok(_) => say(&format!("shows the controller at {}", followed.poller)),
        Err(LookFailure::Call(CallFailure::NotFound(failure))) => {
            failure.to_string().lines().for_each(|line| say(line.trim_start()));
        }
        Err(LookFailure::Call(_) | LookFailure::Unusable(_)) => {
            let socket = &followed.poller;
            say(&format!("shows the controller at {socket}: no controller answers there yet"));
        }
    }
    let (mut status, mut status_at): (Option<Arc<Value>>, Option<Instant>) = (None, None);
    while !tell.is_closed() {
        if !is_viewed() {
            followed.follower.rest();
            status_at = None;
            thread::park_timeout(VIEWED);
            continue;
        }
        let begun = Instant::now();
        let looked = followed.look();
        let is_due = status_at.is_none_or(|at| at.elapsed() >= STATUS_EVERY);
        if is_due || looked.is_err() {
            status = followed.status().map(Arc::new);
            status_at = Some(Instant::now());
        }
        if followed.poller.has_turned(looked.is_ok()) {
            followed.log_look(&looked);
        }
        let pause = PACE.pause(begun.elapsed(), looked.is_ok());
        let view = looked.map_err(|failure| failure.to_string());
        let (at, socket) = (Instant::now(), followed.poller.kept().cloned());
        tell.send_replace(Arc::new(LookResult { at, socket, view, status: status.clone() }));
        thread::sleep(pause);
    }
}
