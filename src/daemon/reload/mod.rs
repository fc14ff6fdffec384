//! A reload from its request to its report: files, check, plan, the swap, and the way back.
//!
//! The operator's desk and SIGHUP ask for it; the shell looks whether a new program faults.
//! Reading, checking and lowering are done on a thread of their own; what comes of it goes to the
//! scan thread in a package. One reload at a time, and none is left half done: it runs as a task
//! of its own, whoever asked for it goes away meanwhile.

mod ready;
mod views;

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tokio::task::spawn_blocking;
use tokio::time::{sleep, timeout};
use tracing::{error, info, warn};

pub(super) use views::Views;

use super::config::Setup;
use super::narration::span;
use super::systemd::{Notice, Systemd};
use crate::engine::{self, Engine};
use crate::operator::protocol::{Refusal, RefusalKind, Reloaded};
use crate::runtime::command::{Answer, CommandId, Denial};
use crate::runtime::exchange::{Mode, Port, StopReason};
use crate::runtime::{Reloader, monotonic_ns};
use ready::Ready;

/// How soon it is looked again whether the scan thread has answered.
const ASK_AGAIN: Duration = Duration::from_millis(1);
/// How long its answer is waited for.
const ANSWER_MAX: Duration = Duration::from_secs(10);
/// From one attempt to go back to the next, where the scan thread does not hear.
const TRY_AGAIN: Duration = Duration::from_millis(500);

/// A program that scans, or has.
pub(super) struct Running {
    pub program: engine::Program,
    pub setup: Setup,
}

/// Where reloads are done.
pub(super) struct Reloads {
    inner: tokio::sync::Mutex<Inner>,
    probation: Mutex<Option<Probation>>,
    port: Port,
    views: Views,
    systemd: Systemd,
}

struct Inner {
    reloader: Reloader<Engine>,
    /// As the process started: what a reload does not apply is as it says.
    started: Arc<Running>,
    running: Arc<Running>,
    /// The one before it.
    previous: Option<Arc<Running>>,
    /// Handed in, and not answered yet.
    pending: Option<(u32, Arc<Running>)>,
    generation: u32,
}

/// A new program on trial.
#[derive(Clone, Copy)]
struct Probation {
    until: Instant,
    /// When the way back was tried last.
    tried: Option<Instant>,
}

type Done<T> = Result<T, Refusal>;

impl Reloads {
    pub fn new(
        running: Arc<Running>,
        reloader: Reloader<Engine>,
        port: Port,
        views: Views,
    ) -> Reloads {
        let (previous, pending, generation) = (None, None, 0);
        let started = Arc::clone(&running);
        let inner = Inner { reloader, started, running, previous, pending, generation };
        let (inner, probation) = (tokio::sync::Mutex::new(inner), Mutex::new(None));
        Reloads { inner, probation, port, views, systemd: Systemd::of_environment() }
    }

    /// Reads the files anew, and goes on with what they say.
    pub async fn reload(self: Arc<Self>, who: String, dry_run: bool) -> Done<Reloaded> {
        let done = tokio::spawn(async move {
            self.notify(Notice::Reloading { since_us: monotonic_ns() / 1000 }, dry_run);
            let done = self.read_and_swap(&who, dry_run).await;
            if let (Err(refusal), false) = (&done, dry_run) {
                tell_refusal(&who, refusal);
            }
            self.notify(Notice::Ready, dry_run);
            done
        });
        done.await.unwrap_or_else(|bug| Err(refused(format!("a bug in rungd: {bug}"))))
    }

    /// Goes back to the program before the last reload.
    pub async fn rollback(self: Arc<Self>, who: String) -> Done<Reloaded> {
        let done = tokio::spawn(async move {
            let done = self.go_back(&who, None).await;
            if let Err(refusal) = &done {
                tell_refusal(&who, refusal);
            }
            done
        });
        done.await.unwrap_or_else(|bug| Err(refused(format!("a bug in rungd: {bug}"))))
    }

    /// Looks whether a new program faults within its probation, or has stood it.
    pub fn look(self: &Arc<Self>, mode: Mode) {
        let now = Instant::now();
        let mut probation = self.probation.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(trial) = &mut *probation else { return };
        let Mode::Fault(fault) = mode else {
            if now >= trial.until {
                info!(event = "reload-proved", "the new program has stood its probation");
                *probation = None;
            }
            return;
        };
        if trial.tried.is_some_and(|tried| now < tried + TRY_AGAIN) {
            return;
        }
        let first = trial.tried.replace(now).is_none();
        let reloads = Arc::clone(self);
        tokio::spawn(async move {
            let done = reloads.go_back("rungd", Some(fault.to_string())).await;
            if let (Err(refusal), true) = (done, first) {
                let why = refusal.message;
                error!(event = "rollback-failed", "the old program is not back: {why}");
            }
        });
    }

    fn notify(&self, notice: Notice, dry_run: bool) {
        if !dry_run {
            let _ = self.systemd.send(&notice);
        }
    }

    async fn read_and_swap(&self, who: &str, dry_run: bool) -> Done<Reloaded> {
        let mut inner = self.inner.lock().await;
        inner.settle(&self.views);
        if timeout(ANSWER_MAX, self.started()).await.is_err() {
            return Err(refused("the first scan is still to come; try again".to_owned()));
        }
        let latest = self.port.latest();
        let (running, generation) = (Arc::clone(&inner.running), inner.generation + 1);
        let started = Arc::clone(&inner.started);
        let sides = move || Ready::of_files(&started, &running, generation, &latest);
        let made = spawn_blocking(sides).await;
        let ready = made.unwrap_or_else(|bug| Err(format!("a bug in rungd: {bug}")));
        let ready = ready.map_err(|text| Refusal::new(RefusalKind::BadFiles, text))?;
        let latest = self.port.latest();
        if dry_run {
            let report = ready.plan.report(&latest.bits, &latest.words);
            return Ok(reloaded(&ready.running.setup, report, ready.restart, None, true));
        }
        let (next, restart) = (Arc::clone(&ready.running), ready.restart.clone());
        // What does not scan is on trial by nobody.
        let scans = latest.mode == Mode::Run;
        let probation = if scans { next.setup.probation } else { Duration::ZERO };
        let (report, swap_us) = self.swap(&mut inner, ready, false).await?;
        self.put_probation((!probation.is_zero()).then(|| Instant::now() + probation));
        let ladder = &next.setup.ladder;
        tell_report(&report);
        for what in &restart {
            warn!(event = "reload-restart", "{what}: what the file says now needs a restart");
        }
        info!(
            event = "reload-done",
            who,
            ladder = %ladder.name,
            files = %ladder.files,
            sha256 = %ladder.sha256,
            rungs = ladder.rungs,
            differences = report.len(),
            swap_us,
            probation = %span(probation.as_nanos() as u64),
            "{who} reloaded: another program scans, without a stop"
        );
        Ok(reloaded(&next.setup, report, restart, Some(swap_us), false))
    }

    /// To the program before; `fault`: since the new one has met that.
    async fn go_back(&self, who: &str, fault: Option<String>) -> Done<Reloaded> {
        let mut inner = self.inner.lock().await;
        inner.settle(&self.views);
        if fault.is_some() && self.trial().is_none() {
            return Err(refused("the probation is over".to_owned()));
        }
        let Some(previous) = inner.previous.clone() else {
            let message = "there is no program to go back to: nothing was reloaded since the \
                           start, or that was taken back already";
            return Err(refused(message.to_owned()));
        };
        let (running, generation) = (Arc::clone(&inner.running), inner.generation + 1);
        let (latest, next) = (self.port.latest(), Arc::clone(&previous));
        let made = spawn_blocking(move || Ready::of(&running, next, generation, &latest)).await;
        let ready = made.map_err(|bug| refused(format!("a bug in rungd: {bug}")))?;
        let (report, swap_us) = self.swap(&mut inner, ready, true).await?;
        inner.previous = None;
        self.put_probation(None);
        tell_report(&report);
        let ladder = &previous.setup.ladder;
        let why = fault.map_or_else(|| "asked for".to_owned(), |fault| format!("FAULT: {fault}"));
        warn!(
            event = "rolled-back",
            who,
            ladder = %ladder.name,
            sha256 = %ladder.sha256,
            swap_us,
            "{who} went back to the program before the reload ({why}); the files still hold the \
             other one"
        );
        Ok(reloaded(&previous.setup, report, Vec::new(), Some(swap_us), false))
    }

    /// Hands a program in, and waits until it scans: the report, and how long the swap took.
    async fn swap(
        &self,
        inner: &mut Inner,
        ready: Ready,
        resume: bool,
    ) -> Done<(Vec<String>, f64)> {
        let Ready { running, plan, package, .. } = ready;
        let generation = package.generation;
        self.views.insert(generation, &running.setup);
        inner.generation = generation;
        inner.pending = Some((generation, running));
        let handed_in = inner.reloader.hand_in(*package, resume);
        let answer = match handed_in {
            Ok(id) => self.answer(id).await,
            Err(denial) => Some(Err(denial)),
        };
        match answer {
            None => {
                let message = "no scan came in time to see it; it may yet be done";
                return Err(Refusal::new(RefusalKind::NoAnswer, message));
            }
            Some(Err(denial)) => {
                inner.pending = None;
                self.views.remove(generation);
                return Err(refused(denial.to_string()));
            }
            Some(Ok(())) => {}
        }
        let mut told = (Vec::new(), 0.0);
        inner.settle_with(&self.views, |machine, swap_ns| {
            let image = machine.image();
            told = (plan.report(image.bits(), image.words()), swap_ns as f64 / 1000.0);
        });
        Ok(told)
    }

    async fn started(&self) {
        while self.port.latest().mode == Mode::Stop(StopReason::NotStarted) {
            sleep(ASK_AGAIN).await;
        }
    }

    async fn answer(&self, id: CommandId) -> Option<Result<(), Denial>> {
        let answer = async {
            loop {
                match self.port.answer(id) {
                    Some(answer) => return answer,
                    None => sleep(ASK_AGAIN).await,
                }
            }
        };
        match timeout(ANSWER_MAX, answer).await.ok()? {
            Answer::Done(_) => Some(Ok(())),
            Answer::Denied(denial) => Some(Err(denial)),
        }
    }

    fn trial(&self) -> Option<Probation> {
        *self.probation.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn put_probation(&self, until: Option<Instant>) {
        let trial = until.map(|until| Probation { until, tried: None });
        *self.probation.lock().unwrap_or_else(PoisonError::into_inner) = trial;
    }
}

impl Inner {
    /// Takes back what the scan thread has let go of, and knows by it which program scans.
    fn settle(&mut self, views: &Views) {
        self.settle_with(views, |_, _| {});
    }

    fn settle_with(&mut self, views: &Views, mut look: impl FnMut(&Engine, u64)) {
        while let Some(package) = self.reloader.returned() {
            let Some(swap_ns) = package.swap_ns else { continue };
            if let Some((_, running)) =
                self.pending.take_if(|(generation, _)| *generation == package.generation)
            {
                self.previous = Some(std::mem::replace(&mut self.running, running));
                views.forget_before(package.generation.saturating_sub(1));
                look(&package.machine, swap_ns);
            }
        }
    }
}

fn refused(message: String) -> Refusal {
    Refusal::new(RefusalKind::Refused, message)
}

fn reloaded(
    setup: &Setup,
    report: Vec<String>,
    restart: Vec<String>,
    swap_us: Option<f64>,
    dry_run: bool,
) -> Reloaded {
    let (ladder, sha256) = (setup.ladder.name.clone(), setup.ladder.sha256.clone());
    Reloaded { dry_run, report, restart, ladder, sha256, swap_us }
}

fn tell_report(report: &[String]) {
    for line in report {
        info!(event = "reload-difference", "{line}");
    }
}

/// Findings line by line, then the refusal.
fn tell_refusal(who: &str, refusal: &Refusal) {
    if refusal.kind == RefusalKind::BadFiles {
        for line in refusal.message.lines().filter(|line| !line.trim().is_empty()) {
            error!(event = "finding", "{line}");
        }
        let why = "the files cannot be run as they are";
        error!(event = "reload-refused", who, "{who} asked for a reload: {why}; nothing changed");
    } else {
        let why = &refusal.message;
        error!(event = "reload-refused", who, "{who} asked for another program: {why}");
    }
}
