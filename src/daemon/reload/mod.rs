//! A reload from its request to its report: files, check, plan, the swap, and the way back.
//!
//! The operator's service and SIGHUP request it; the shell checks whether a new program faults. A
//! separate thread reads, checks and lowers the files, within a time limit; the result goes to the
//! scan thread in a package. There is one reload at a time. It runs as a separate task, so that it
//! is completed even if its client disconnects. While a reload reads files, it holds no lock that a
//! rollback needs, so a rollback never waits for files.

mod caller;
mod deploys;
mod direction;
mod reading;
mod ready;
mod report;
mod tell;
mod trial;
mod views;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use tokio::task::spawn_blocking;
use tokio::time::timeout;

pub(super) use caller::Caller;
pub(super) use deploys::Deploys;
pub(super) use views::ProgramViews;

use super::config::{ControllerSetup, RunningProgram};
use super::log;
use super::systemd::{Systemd, SystemdNotice};
use super::turns::Turns;
use direction::SwapDirection;
use reading::FileReader;
use ready::ReadyProgram;
use report::SwappedSetups;
use rungd_base::locked::locked;
use rungd_client::operator::deadline;
use rungd_client::operator::protocol::{RefusalKind, ReloadResult, RequestRefusal, RequestResult};
use rungd_engine::Cell;
use rungd_runtime::command::{CommandDenial, CommandId, CommandOutcome};
use rungd_runtime::exchange::{FaultReason, Mode, Port, Snapshot, StopReason};
use rungd_runtime::say::say;
use rungd_runtime::{Package, Reloader, Swapped, Taped, monotonic_ns};
use rungd_state::reload::{OldMemory, ReloadPlan};
use trial::{Probation, ProbationVerdict};

/// The shortest time limit for the scan thread's answer.
const ANSWER_LEAST: Duration = Duration::from_secs(10);
/// The refusal while the program of an earlier request waits for the scan thread.
const STILL_WAITS: &str = "the program of an earlier request still waits for the scan thread, \
                           which is held up: the log will say what became of it; if that lasts, \
                           restart rungd";
/// The longest time that a reload waits for the end of earlier reloads.
const TURN_MAX: Duration = Duration::from_secs(60);

/// The answer to a reload or a rollback.
type ReloadAnswer = RequestResult<ReloadResult>;

/// Does reloads and rollbacks.
pub(super) struct Reloads {
    /// Held by the one reload that reads files and swaps programs.
    turn: tokio::sync::Mutex<()>,
    dry: Turns,
    files: FileReader,
    /// A SIGHUP waits for its turn. A second SIGHUP would read the same files, and is ignored.
    hangup_waits: AtomicBool,
    /// A swap was not answered in time; the scan thread may still make it.
    swap_waits: AtomicBool,
    /// Locked during a swap, never while files are read.
    inner: tokio::sync::Mutex<ReloadState>,
    /// The generation of the program on trial, and its trial.
    trial: Mutex<Option<(u32, Probation)>>,
    port: Port,
    views: ProgramViews,
    systemd: Systemd,
}

/// The parts of [`Reloads`].
pub(super) struct ReloadParts {
    pub running: Arc<RunningProgram>,
    pub reloader: Reloader<Taped>,
    pub port: Port,
    pub views: ProgramViews,
    /// The longest time to read and check the files.
    pub limit: Duration,
}

struct ReloadState {
    reloader: Reloader<Taped>,
    /// The first program of the process. Settings that a reload does not apply keep the values of
    /// this program.
    started: Arc<RunningProgram>,
    running: Arc<RunningProgram>,
    /// The target of a rollback: of the programs before the running one, the last that passed its
    /// probation.
    way_back: Option<Arc<RunningProgram>>,
    /// The program that was handed to the scan thread and has no answer yet.
    pending: Option<PendingSwap>,
    generation: u32,
}

/// A program that waits for the scan thread's swap.
struct PendingSwap {
    id: CommandId,
    generation: u32,
    running: Arc<RunningProgram>,
    plan: ReloadPlan,
    /// The forced cells before the swap.
    forces: Vec<Cell>,
    request: SwapRequest,
}

/// A requested swap.
struct SwapRequest {
    caller: Caller,
    direction: SwapDirection,
    /// The report's lines about settings that take effect with the swap.
    settings: Vec<String>,
    /// The changed settings that need a restart.
    restart: Vec<String>,
}

/// A fault of the program of this generation.
struct OwnFault {
    generation: u32,
    reason: FaultReason,
}

impl Reloads {
    pub fn new(parts: ReloadParts) -> Reloads {
        let ReloadParts { running, reloader, port, views, limit } = parts;
        let (way_back, pending, generation) = (None, None, 0);
        let started = Arc::clone(&running);
        let inner = ReloadState { reloader, started, running, way_back, pending, generation };
        Reloads {
            turn: tokio::sync::Mutex::default(),
            dry: Turns::new(),
            files: FileReader::new(limit),
            hangup_waits: AtomicBool::new(false),
            swap_waits: AtomicBool::new(false),
            inner: tokio::sync::Mutex::new(inner),
            trial: Mutex::new(None),
            port,
            views,
            systemd: Systemd::of_environment(),
        }
    }

    /// Reads the files again, and swaps in their program.
    pub async fn reload(self: Arc<Self>, caller: Caller, dry_run: bool) -> ReloadAnswer {
        let done = tokio::spawn(async move {
            let done = match dry_run {
                true => match self.dry.try_turn().await {
                    Some(_turn) => self.in_turn(&caller, true).await,
                    None => another_dry_run(),
                },
                false => self.in_turn(&caller, false).await,
            };
            if let (Err(refusal), false) = (&done, dry_run) {
                tell::refusal(&caller.who, refusal);
            }
            done
        });
        done.await.unwrap_or_else(|bug| Err(refused(format!("a bug in rungd: {bug}"))))
    }

    /// Begins the reload of a SIGHUP. The log shows its outcome.
    pub fn hangup(self: &Arc<Self>) {
        if !self.hangup_waits.swap(true, Ordering::AcqRel) {
            tokio::spawn(Arc::clone(self).reload(Caller::anytime("SIGHUP"), false));
        }
    }

    /// Swaps the previous program back in.
    pub async fn rollback(self: Arc<Self>, caller: Caller) -> ReloadAnswer {
        let done = tokio::spawn(async move {
            let done = self.go_back(&caller, None).await;
            if let Err(refusal) = &done {
                tell::refusal(&caller.who, refusal);
            }
            done
        });
        done.await.unwrap_or_else(|bug| Err(refused(format!("a bug in rungd: {bug}"))))
    }

    /// Checks whether a new program has a fault within its probation, or has passed it.
    pub fn look(self: &Arc<Self>, latest: &Snapshot) {
        if self.swap_waits.load(Ordering::Acquire)
            && let Ok(mut inner) = self.inner.try_lock()
        {
            self.settle(&mut inner);
            self.swap_waits.store(inner.pending.is_some(), Ordering::Release);
        }
        let mut trial = self.trial();
        let Some((generation, on_trial)) = &mut *trial else { return };
        let generation = *generation;
        match on_trial.look(latest.mode, latest.scans, Instant::now()) {
            ProbationVerdict::Wait => {}
            ProbationVerdict::Proved => {
                say!(RELOAD_PROVED, "the new program has passed its probation");
                *trial = None;
            }
            ProbationVerdict::NoWayBack => {
                let why = CommandDenial::EngineBroken;
                say!(ROLLBACK_FAILED, "the rollback failed: {why}");
                *trial = None;
            }
            ProbationVerdict::GoBack { fault, first } => {
                let reloads = Arc::clone(self);
                let fault = OwnFault { generation, reason: fault };
                tokio::spawn(async move {
                    let done = reloads.go_back(&Caller::anytime("rungd"), Some(fault)).await;
                    if let (Err(refusal), true) = (done, first) {
                        let why = refusal.message;
                        say!(ROLLBACK_FAILED, "the rollback failed: {why}");
                    }
                });
            }
        }
    }

    async fn in_turn(&self, caller: &Caller, dry_run: bool) -> ReloadAnswer {
        let turn = timeout(TURN_MAX, self.turn.lock()).await;
        self.hangup_waits.store(false, Ordering::Release);
        let Ok(_turn) = turn else {
            return Err(refused(
                "the reloads before this one have not ended; try again".to_owned(),
            ));
        };
        self.notify(SystemdNotice::Reloading { since_us: monotonic_ns() / 1000 }, dry_run);
        let done = self.read_and_swap(caller, dry_run).await;
        self.notify(SystemdNotice::Ready, dry_run);
        done
    }

    fn notify(&self, notice: SystemdNotice, dry_run: bool) {
        if !dry_run {
            let _ = self.systemd.send(&notice);
        }
    }

    async fn read_and_swap(&self, caller: &Caller, dry_run: bool) -> ReloadAnswer {
        let started = |latest: &Snapshot| latest.mode != Mode::Stop(StopReason::NotStarted);
        if timeout(ANSWER_LEAST, self.port.shows(started)).await.is_err() {
            return Err(refused("the first scan is still to come; try again".to_owned()));
        }
        let (started, running) = {
            let inner = self.settled().await;
            (Arc::clone(&inner.started), Arc::clone(&inner.running))
        };
        let next = self.read(&started).await?;
        let mut inner = self.settled().await;
        if !Arc::ptr_eq(&inner.running, &running) {
            let message = "the previous program was put back while the files were read: nothing is \
                           reloaded";
            return Err(refused(message.to_owned()));
        }
        let restart = ready::needs_restart(&started.setup, &next.setup);
        if next.setup.source == running.setup.source {
            return Ok(self.same(&caller.who, &next.setup, restart, dry_run));
        }
        let settings = ready::settings(&started.setup, &running.setup, &next.setup);
        let ready = self.ready(&mut inner, Arc::new(next)).await?;
        let setup = Arc::clone(&ready.running);
        let setup = &setup.setup;
        if dry_run {
            let latest = self.port.latest();
            let (bits, words, forces) = (&latest.bits, &latest.words, latest.forces.list());
            let (old, new) = (&running.setup.symbols, &setup.symbols);
            let seen = OldMemory { old, new, bits, words, forces, passed: None };
            let report = report::with_texts(&ready.plan, &seen, &running.setup, setup);
            let report = [report, settings].concat();
            let dry_run = true;
            return Ok(ReloadResult { dry_run, restart, ..self.reloaded(setup, report, None) });
        }
        let (caller, direction) = (caller.clone(), SwapDirection::Forward);
        self.swap(&mut inner, ready, SwapRequest { caller, direction, settings, restart }).await
    }

    /// Reads the current files.
    async fn read(&self, first: &Arc<RunningProgram>) -> RequestResult<RunningProgram> {
        let (path, first) = (PathBuf::from(&first.setup.controller), Arc::clone(first));
        let read = self.files.done(move |progress| ready::read(&path, &first, progress)).await;
        let read = read.map_err(|why| refused(format!("{why} Nothing is changed")))?;
        read.map_err(|text| RequestRefusal::new(RefusalKind::BadFiles, text))
    }

    /// The answer if the files are unchanged: nothing is swapped, and a rollback has the same
    /// target as before.
    fn same(
        &self,
        who: &str,
        setup: &ControllerSetup,
        restart: Vec<String>,
        dry_run: bool,
    ) -> ReloadResult {
        let reloaded = self.reloaded(setup, Vec::new(), None);
        let same = ReloadResult { dry_run, same: true, restart, ..reloaded };
        if !dry_run {
            tell::same(who, &same);
        }
        same
    }

    async fn ready(
        &self,
        inner: &mut ReloadState,
        next: Arc<RunningProgram>,
    ) -> RequestResult<ReadyProgram> {
        if inner.pending.is_some() {
            // It would follow the waiting program, but be prepared for the running one.
            return Err(refused(STILL_WAITS.to_owned()));
        }
        let (running, generation) = (Arc::clone(&inner.running), inner.generation + 1);
        let latest = self.port.latest();
        let make = move || ReadyProgram::of(&running, next, generation, &latest);
        let made = spawn_blocking(make).await;
        made.map_err(|bug| refused(format!("a bug in rungd: {bug}")))
    }

    /// Swaps the previous program back in. `fault` is the fault of the new program, if it is the
    /// reason.
    async fn go_back(&self, caller: &Caller, fault: Option<OwnFault>) -> ReloadAnswer {
        let mut inner = self.settled().await;
        if let Some(OwnFault { generation, .. }) = fault
            && self.on_trial().is_none_or(|(trial_generation, _)| trial_generation != generation)
        {
            return Err(refused("the program that faulted is no longer loaded".to_owned()));
        }
        let Some(previous) = inner.way_back.clone() else {
            let message = "there is nothing to roll back: no reload has changed the program since \
                           the start, or a rollback has undone it already";
            return Err(refused(message.to_owned()));
        };
        let ready = self.ready(&mut inner, Arc::clone(&previous)).await?;
        let settings = ready::settings(&inner.started.setup, &inner.running.setup, &previous.setup);
        let direction = SwapDirection::Back(fault.map(|fault| fault.reason));
        let (caller, restart) = (caller.clone(), Vec::new());
        self.swap(&mut inner, ready, SwapRequest { caller, direction, settings, restart }).await
    }

    /// Hands a program to the scan thread, and waits for the swap.
    async fn swap(
        &self,
        inner: &mut ReloadState,
        ready: ReadyProgram,
        request: SwapRequest,
    ) -> ReloadAnswer {
        if request.caller.until_ns < deadline::now_ns() {
            let message = "nothing is swapped: its client had stopped waiting when the files were \
                           read";
            return Err(RequestRefusal::new(RefusalKind::TooLate, message));
        }
        let ReadyProgram { running, plan, package, .. } = ready;
        let generation = package.generation;
        self.views.insert(generation, &running);
        inner.generation = generation;
        let forces = self.port.latest().forces.list().to_vec();
        let resume = matches!(request.direction, SwapDirection::Back(Some(_)));
        let denied = |denial: CommandDenial| {
            self.views.remove(generation);
            refused(denial.to_string())
        };
        let id = inner.reloader.hand_in(*package, resume).map_err(denied)?;
        inner.pending = Some(PendingSwap { id, generation, running, plan, forces, request });
        let patience = self.port.patience().max(ANSWER_LEAST);
        match timeout(patience, self.port.answered(id)).await {
            Err(_) => {
                self.swap_waits.store(true, Ordering::Release);
                let message = "no scan has processed it in time; it may still be done";
                Err(RequestRefusal::new(RefusalKind::NoAnswer, message))
            }
            Ok(Err(denial)) => {
                inner.pending = None;
                Err(denied(denial))
            }
            Ok(Ok(_)) => {
                let bug =
                    || refused("a bug in rungd: the old program did not come back".to_owned());
                self.settle(inner).ok_or_else(bug)
            }
        }
    }

    /// The program on trial, if there is one.
    fn trial(&self) -> MutexGuard<'_, Option<(u32, Probation)>> {
        locked(&self.trial)
    }

    pub fn on_trial(&self) -> Option<(u32, Probation)> {
        *self.trial()
    }

    /// Locks the programs, and enters the swaps that the scan thread has completed.
    async fn settled(&self) -> tokio::sync::MutexGuard<'_, ReloadState> {
        let mut inner = self.inner.lock().await;
        self.settle(&mut inner);
        inner
    }

    /// Takes back the packages that the scan thread has returned. Enters and logs the swap of the
    /// waiting program, and returns its report.
    fn settle(&self, inner: &mut ReloadState) -> Option<ReloadResult> {
        let mut done = None;
        while let Some(package) = inner.reloader.returned() {
            let Some(swapped) = package.swapped else { continue };
            let waits = |pending: &mut PendingSwap| pending.generation == package.generation;
            if let Some(pending) = inner.pending.take_if(waits) {
                done = Some(self.enter(inner, pending, &package, swapped));
            }
        }
        if let Some(PendingSwap { id, generation, .. }) = inner.pending
            && let Some(CommandOutcome::Denied(_)) = self.port.answer(id)
        {
            inner.pending = None;
            self.views.remove(generation);
        }
        done
    }

    fn enter(
        &self,
        inner: &mut ReloadState,
        pending: PendingSwap,
        package: &Package<Taped>,
        swapped: Swapped,
    ) -> ReloadResult {
        let PendingSwap { generation, running, plan, forces, request, .. } = pending;
        // The image of the new program may not be published yet.
        let shown = self.port.latest().generation;
        self.views.forget_before(generation.saturating_sub(1).min(shown));
        log::take_over(&running.setup.log);
        let old = std::mem::replace(&mut inner.running, Arc::clone(&running));
        let mut on_trial = self.trial();
        let probation = match request.direction {
            SwapDirection::Back(_) => {
                inner.way_back = None;
                Duration::ZERO
            }
            SwapDirection::Forward => {
                // If the replaced program has not passed its probation, the target of a rollback
                // stays the last program that has passed it.
                if on_trial.is_none() || inner.way_back.is_none() {
                    inner.way_back = Some(Arc::clone(&old));
                }
                running.setup.probation
            }
        };
        let trial = Probation::new(probation, swapped.mode);
        *on_trial = trial.map(|trial| (generation, trial));
        drop(on_trial);
        let setups = SwappedSetups { old: &old.setup, new: &running.setup };
        let report = [report::of_swap(&plan, package, &forces, setups), request.settings].concat();
        let swap_us = Some(swapped.took_ns as f64 / 1000.0);
        let done = ReloadResult {
            restart: request.restart,
            ..self.reloaded(&running.setup, report, swap_us)
        };
        let who = request.caller.who.as_str();
        self.views.deployed(who, &done, request.direction.is_back());
        match request.direction {
            SwapDirection::Forward => tell::done(who, &done, &running.setup, trial),
            SwapDirection::Back(fault) => tell::rolled_back(who, &done, fault),
        }
        done
    }

    fn reloaded(
        &self,
        setup: &ControllerSetup,
        report: Vec<String>,
        swap_us: Option<f64>,
    ) -> ReloadResult {
        ReloadResult {
            dry_run: false,
            same: false,
            report,
            restart: Vec::new(),
            ladder: setup.ladder.name.clone(),
            sha256: setup.ladder.sha256.clone(),
            swap_us,
            mode: self.port.latest().mode.name().to_owned(),
        }
    }
}

fn another_dry_run() -> ReloadAnswer {
    Err(refused("another dry run is under way; try again when it has ended".to_owned()))
}

fn refused(message: String) -> RequestRefusal {
    RequestRefusal::new(RefusalKind::Refused, message)
}
