//! The thread that follows the controller: the changes of its tags, its status and its alarms. Its
//! calls block, so it is separate from the server, which gets its reports.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use opcua::server::authenticator::UserToken;
use opcua::types::StatusCode;
use rungd_base::locked::locked;
use rungd_client::live::{ChangeFollower, LogEvent, LogPosition, LoggedChange, LookFailure};
use rungd_client::operator::client::CallFailure;
use rungd_client::operator::poller::{ControllerPoller, PollPace, PolledController};
use rungd_client::operator::protocol::{AlarmList, ControllerStatus, GivenWrite, Request};
use rungd_client::operator::socket_of_environment;
use rungd_engine::isa::Address;
use rungd_fleet::opcua::OpcUaSettings;
use rungd_history::playback::PlayableProgram;
use serde::de::DeserializeOwned;
use tokio::sync::mpsc;

use crate::journal::say;
use crate::rights::PlantRights;
use crate::shown::ShownTree;
use crate::tags::{chooser, tree};
use crate::values::refused;

/// The time from look to look.
const PACE: PollPace =
    PollPace { every: Duration::from_millis(100), share: 0, retry: Duration::from_secs(1) };
/// The time between two requests for the status.
const STATUS_EVERY: Duration = Duration::from_secs(1);
/// The longest wait for an answer.
const ANSWER_MAX: Duration = Duration::from_secs(5);
/// The length of the queue of reports.
const QUEUE: usize = 16;

/// A report about the controller.
#[derive(Debug)]
pub enum PlantReport {
    /// A program begins, with the contents of its chosen cells.
    Program(Arc<ShownTree>, Vec<i32>, LogPosition),
    /// Cells changed.
    Changes(Vec<LoggedChange>),
    /// What changed until this position is not known: the log continues there.
    Gap(LogPosition),
    /// The controller answers, and its log is read up to this position.
    Present(LogPosition),
    /// Its status and its alarms.
    Status(Box<ControllerStatus>, AlarmList),
    /// It does not answer.
    Silent,
}

/// The controller at its socket, for the requests of clients: the same one that is followed.
#[derive(Clone, Debug)]
pub struct PlantController {
    poller: Arc<Mutex<ControllerPoller>>,
    /// The rights of users under the present program; `None`: it is not known yet.
    rights: Arc<Mutex<Option<PlantRights>>>,
}

impl PlantController {
    /// The controller of the settings, or the one that is found.
    pub fn new(named: Option<PathBuf>) -> PlantController {
        let named = named.or_else(socket_of_environment);
        let poller = ControllerPoller::new(named, ANSWER_MAX);
        PlantController { poller: Arc::new(Mutex::new(poller)), rights: Arc::default() }
    }

    /// The controller at this time.
    ///
    /// # Errors
    /// None was found, or several.
    pub fn controller(&self) -> Result<PolledController, CallFailure> {
        locked(&self.poller).controller()
    }
}

/// Why a request was not done: the status for the client, and the reason for the journal.
pub type NotDone = (StatusCode, String);

impl PlantController {
    /// Judges a change of a user: of alarms, or these writes.
    ///
    /// # Errors
    /// The user's role is too low, or not known yet.
    pub fn judge(&self, user: &UserToken, writes: &[GivenWrite]) -> Result<(), NotDone> {
        if user.is_anonymous() {
            return Ok(());
        }
        let rights = locked(&self.rights);
        let Some(rights) = &*rights else {
            let why = "the controller's program is not known yet".to_owned();
            return Err((StatusCode::BadNoCommunication, why));
        };
        rights.judge(&user.0, writes).map_err(|why| (StatusCode::BadUserAccessDenied, why))
    }

    /// Judges writes that have no reason.
    ///
    /// # Errors
    /// One of them wants one.
    pub fn judge_without_reason(&self, writes: &[GivenWrite]) -> Result<(), NotDone> {
        let rights = locked(&self.rights);
        let judged = rights.as_ref().map_or(Ok(()), |rights| rights.judge_without_reason(writes));
        judged.map_err(|why| (StatusCode::BadNotWritable, why))
    }

    /// Sends a request of a client.
    ///
    /// # Errors
    /// The controller refuses, or does not answer.
    pub async fn ask<T>(&self, request: Request) -> Result<T, NotDone>
    where
        T: DeserializeOwned + Send + 'static,
    {
        let followed = self.clone();
        let asked = tokio::task::spawn_blocking(move || {
            followed.controller().and_then(|controller| controller.ask::<T>(&request))
        });
        match asked.await {
            Ok(Ok(answer)) => Ok(answer),
            Ok(Err(CallFailure::Refused(refusal))) => {
                let words: Vec<&str> = refusal.message.split_whitespace().collect();
                Err((refused(refusal.kind), words.join(" ")))
            }
            Ok(Err(failure)) => Err((StatusCode::BadNoCommunication, failure.in_one_line())),
            Err(_) => Err((StatusCode::BadInternalError, "a failure of rungd-opcua".to_owned())),
        }
    }
}

/// Starts the thread. It ends when the receiver is dropped.
///
/// # Errors
/// The system cannot start a thread.
pub fn start(
    settings: &OpcUaSettings,
    followed: PlantController,
) -> std::io::Result<mpsc::Receiver<PlantReport>> {
    let (tell, told) = mpsc::channel(QUEUE);
    let follower = ChangeFollower::new(chooser(settings));
    let thread = PlantThread { settings: settings.clone(), followed, follower, tell };
    thread::Builder::new().name("follow".to_owned()).spawn(move || thread.work())?;
    Ok(told)
}

/// The operands that each field device moves, by the device's number.
fn inputs_of_devices(program: &PlayableProgram) -> Vec<Vec<Address>> {
    let mut inputs = vec![Vec::new(); program.program.devices.len()];
    let devices = program.loaded.controller.iter().flat_map(|controller| &controller.devices);
    for device in devices {
        if let Some(inputs) = inputs.get_mut(device.id.0 as usize) {
            inputs.extend(device.inputs.iter().map(|input| input.address));
        }
    }
    inputs
}

struct PlantThread {
    settings: OpcUaSettings,
    followed: PlantController,
    follower: ChangeFollower,
    tell: mpsc::Sender<PlantReport>,
}

/// The receiver of the reports is gone.
struct ReportsUnread;

impl PlantThread {
    fn work(mut self) {
        let mut status_at = Instant::now();
        loop {
            let began = Instant::now();
            let Ok(answers) = self.look() else { return };
            if answers && began >= status_at {
                if self.status().is_err() {
                    return;
                }
                status_at = began + STATUS_EVERY;
            }
            thread::sleep(PACE.pause(began.elapsed(), answers));
        }
    }

    fn send(&self, report: PlantReport) -> Result<(), ReportsUnread> {
        self.tell.blocking_send(report).map_err(|_| ReportsUnread)
    }

    /// Requests the changes and reports them. Returns whether the controller answered.
    fn look(&mut self) -> Result<bool, ReportsUnread> {
        let looked = self.new_events();
        let answers = looked.is_ok();
        if locked(&self.followed.poller).has_turned(answers) {
            say(&match &looked {
                Ok(_) => format!("the controller at {} answers", locked(&self.followed.poller)),
                Err(failure) => format!("the controller does not answer: {failure}"),
            });
        }
        match looked {
            Ok(events) => self.report(events)?,
            Err(LookFailure::Call(_) | LookFailure::Unusable(_)) => {
                self.send(PlantReport::Silent)?
            }
        }
        Ok(answers)
    }

    fn new_events(&mut self) -> Result<Vec<LogEvent>, LookFailure> {
        let controller = self.followed.controller()?;
        let events = self.follower.look(&controller.socket)?;
        locked(&self.followed.poller).keep(&controller);
        Ok(events)
    }

    fn report(&mut self, events: Vec<LogEvent>) -> Result<(), ReportsUnread> {
        let mut changes = Vec::new();
        for event in events {
            match event {
                LogEvent::Changed(change) => changes.push(change),
                LogEvent::Begins { program, values, at } => {
                    self.send(PlantReport::Changes(std::mem::take(&mut changes)))?;
                    let playable = &program.playable;
                    let inputs = inputs_of_devices(playable);
                    let mut tree =
                        tree(&self.settings, &playable.program, &playable.symbols, &inputs);
                    let rights = PlantRights::of(playable);
                    rights.mark(&mut tree);
                    *locked(&self.followed.rights) = Some(rights);
                    let shown = Arc::new(ShownTree::new(tree));
                    self.send(PlantReport::Program(shown, values, at))?;
                }
                LogEvent::Jumped { to, .. } => {
                    self.send(PlantReport::Changes(std::mem::take(&mut changes)))?;
                    self.send(PlantReport::Gap(to))?;
                }
                // Of a reader of the past alone.
                LogEvent::Missing(_) => {}
            }
        }
        self.send(PlantReport::Changes(changes))?;
        match self.follower.position() {
            Some(at) => self.send(PlantReport::Present(at)),
            None => Ok(()),
        }
    }

    fn status(&mut self) -> Result<(), ReportsUnread> {
        let asked =
            self.followed.controller().and_then(|controller| controller.status_and_alarms());
        match asked {
            Ok((status, alarms)) => self.send(PlantReport::Status(Box::new(status), alarms)),
            Err(_) => Ok(()),
        }
    }
}
