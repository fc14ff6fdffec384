//! Runs a controller from its start to its end: threads, drivers, signals, systemd.
//!
//! Read [`run`] top-down. The scan thread does not depend on this shell. The shell looks at the
//! scan thread ten times a second, and more often during a start, a stop and a probation
//! (`look_pace`). Signals, and the end of the scan thread, wake it.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::Notify;
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use super::alarm_file::AlarmFileHandle;
use super::config::{ControllerSetup, RunningProgram};
use super::devices::{self, DeviceStarter};
use super::failure::StartFailure;
use super::guard::RestartGuard;
use super::local_time;
use super::log;
use super::log_writer::{AlarmEnds, LogWriter};
use super::look_pace::LookPace;
use super::modbus_start;
use super::narration::{LogFacts, Narration};
use super::operator_server;
use super::posture;
use super::record;
use super::record_disk::RecordDisk;
use super::record_thread::{RecordHandle, RecordParts};
use super::reload::{self, ProgramViews, Reloads};
use super::retain::RestoredFile;
use super::retain_thread::{LastImage, RetainHandle};
use super::signals::{ProcessHost, SignalOrder, Signals, when_stopped};
use super::start_parts::{StartParts, start_parts};
use super::start_wait::{StartPart, StartWatch};
use super::systemd::{self, DueNotices, Systemd};
use super::told_statistics::tell_statistics;
use super::watches::WatchPlan;
use rungd_base::duration_text::{duration_text, period_text};
use rungd_base::faults::{self, FaultPoint};
use rungd_engine::isa::{Bit, BitSpace};
use rungd_engine::{self as engine, Engine};
use rungd_io::caught::caught;
use rungd_io::device::DeviceHealth;
use rungd_io::plant;
use rungd_runtime::exchange::{FaultReason, Mode, StopReason};
use rungd_runtime::field::DeviceEnds;
use rungd_runtime::pacing::MachineClock;
use rungd_runtime::say::say;
use rungd_runtime::{
    self as runtime, Generations, PreparedThreads, Reloader, Report, Runtime, Taped,
    ThreadSettings, ThreadState,
};

/// The options of the command line.
#[derive(Clone, Debug)]
pub struct ShellOptions {
    /// The controller makes an orderly stop after this scan.
    pub scans: Option<u64>,
    /// Whether the controller runs although nothing was restored; overrides the controller file.
    pub runs_cold: Option<bool>,
    /// How often the log repeats the reason why the controller does not run.
    pub repeat: Duration,
    /// The longest time in which a reload reads and checks its files.
    pub reload_limit: Duration,
    /// The folder of the scan log if the controller file names none; `None`: the scan log is only
    /// in memory.
    pub record: Option<PathBuf>,
    /// The controller starts in STOP for this reason, and waits for `rungd mode run`.
    pub start_in_stop: Option<StopReason>,
}

/// How a controller ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControllerEnd {
    /// After a signal, or after the last scan of `--scans`.
    Orderly,
    /// A fault came before the last scan of `--scans`.
    Fault,
    /// By a bug in rungd.
    Bug,
    /// By a second signal during the stop.
    Hurried,
    /// The stop was orderly, but the last image of retentive memory is lost.
    MemoryLost,
}

impl ControllerEnd {
    /// Combines the ending with the last image. A bug or a fault outweighs a lost image.
    fn or(self, last_image: LastImage) -> Self {
        match (self, last_image) {
            (Self::Orderly, LastImage::Lost) => Self::MemoryLost,
            (Self::Orderly, LastImage::Hurried) => Self::Hurried,
            (Self::Orderly, LastImage::Kept)
            | (Self::Fault | Self::Bug | Self::Hurried | Self::MemoryLost, _) => self,
        }
    }
}

/// Added to the longest time of a scan when the shell waits for the end of the last scan.
const STOP_SLACK: Duration = Duration::from_secs(2);
/// The time limit for the end of the drivers: a field device's current exchange, and its last one.
const DRIVERS_END_MAX: Duration = Duration::from_secs(3);

/// Runs a controller until it ends.
///
/// # Errors
/// The controller cannot start.
pub fn run(
    host: &mut ProcessHost,
    RunningProgram { program, setup }: RunningProgram,
    options: &ShellOptions,
    guard: &mut RestartGuard,
) -> Result<ControllerEnd, StartFailure> {
    log::take_over(&setup.log);
    let offset = local_time::keep()?;
    log::set_zone(Arc::clone(&offset));
    tell_start(&setup);
    tell_panics();
    faults::listen();
    let inputs = initial_inputs(&program, &setup);
    let engine = Engine::new(program.clone());
    let Some(parts) = start_parts(host, &setup, options.runs_cold, engine) else {
        return Ok(ControllerEnd::Orderly);
    };
    let StartParts { sockets, engine, retained, alarms: alarm_file } = parts?;
    let (cold, nothing_kept) = retained.as_ref().map(RestoredFile::outlook).unwrap_or_default();
    let pace = runtime::ScannerSettings {
        scans: options.scans,
        start_in_stop: options.start_in_stop.or(cold),
        ..setup.pace.clone()
    };
    let settings = thread_settings(&setup, pace);
    let disk = record::place(&setup, options.record.as_deref());
    let facts = LogFacts {
        repeat_ns: options.repeat.as_nanos() as u64,
        heartbeat_ns: settings.pace.statistics_every_ns,
        has_operator: !sockets.is_empty(),
        record: disk.as_ref().map(|dir| dir.display().to_string()),
        nothing_kept,
        priority: Arc::default(),
        over: Arc::default(),
    };
    let (priority, over) = (Arc::clone(&facts.priority), Arc::clone(&facts.over));
    let healths = devices::healths(&setup.devices);
    let narration = Generations::new(setup.narration.clone());
    let (alarms, news) = AlarmEnds::new(&setup.narration.alarms);
    let book = Arc::clone(&alarms.book);
    let writer = LogWriter::new(narration.clone(), facts, healths.clone(), alarms);
    let spin_ns = u64::from(settings.posture.spin_us) * 1000;
    let clock = MachineClock { offset, spin_ns };
    let (machine, tape) = runtime::tape(engine);
    let (mut prepared, reloader) = runtime::prepare(machine, clock, &settings, writer)?;
    inputs.iter().for_each(|x| prepared.port().set_input(*x, true));
    let _ = priority.set(posture::priority_remedy(prepared.grants()).unwrap_or_default());
    posture::log_grants(prepared.grants(), settings.posture.strict)
        .map_err(StartFailure::Configuration)?;
    let alarm_file = alarm_file.start(book, prepared.port())?;
    let retention =
        retained.map(|opened| RetainHandle::start(opened, prepared.port())).transpose()?;
    let recording = RecordHandle::start(RecordParts {
        tape,
        port: prepared.port(),
        first: (record::program(&setup, 0), setup.access),
        watches: (WatchPlan::new(&setup.watches, &setup.symbols, &program), news),
        memory_bytes: setup.record.memory_bytes,
        disk: disk.map(|dir| RecordDisk::start(&dir, &setup)).transpose()?,
    })?;
    let ProcessHost { tokio, signals, start } = host;
    let (running, limit) = (Arc::new(RunningProgram { program, setup }), options.reload_limit);
    let (field, start) = ((prepared.lines(), healths), start.clone());
    let alarms = alarm_file.clone();
    let duties = ShellDuties { signals, guard, retention, recording, over, alarms };
    let first =
        FirstProgram { running, reloader, narration, field, limit, sockets, alarm_file, start };
    tokio.block_on(shell(prepared, first, duties))
}

/// The settings of the scan thread for the first program.
fn thread_settings(setup: &ControllerSetup, pace: runtime::ScannerSettings) -> ThreadSettings {
    ThreadSettings {
        pace,
        memory: setup.memory.clone(),
        watched: setup.watched.clone(),
        posture: setup.posture.clone(),
        field: setup.field.clone(),
    }
}

/// The inputs whose initial value is ON: they are ON until their driver writes them.
fn initial_inputs(program: &engine::EngineProgram, setup: &ControllerSetup) -> Vec<u32> {
    let first = setup.symbols.layout.bit(Bit::Space(BitSpace::X, 0)).0;
    let on = program.initial_bits.iter().filter(|(_, on)| *on);
    let numbers = on.filter_map(|(cell, _)| cell.0.checked_sub(first));
    numbers.filter(|x| *x < setup.memory.inputs).collect()
}

/// The first program, and the parts that a reload needs.
struct FirstProgram {
    running: Arc<RunningProgram>,
    reloader: Reloader<Taped>,
    narration: Generations<Narration>,
    /// The ends and the healths of the field devices, by number.
    field: (Vec<DeviceEnds>, Vec<DeviceHealth>),
    /// The longest time in which a reload reads and checks its files.
    limit: Duration,
    /// The places of the operator's socket and of the view socket.
    sockets: Vec<operator_server::SocketClaim>,
    /// The book of alarms, and the file that keeps a part of it.
    alarm_file: AlarmFileHandle,
    start: StartWatch,
}

/// The shell's duties besides the scan thread.
struct ShellDuties<'a> {
    signals: &'a mut Signals,
    guard: &'a mut RestartGuard,
    retention: Option<RetainHandle>,
    recording: RecordHandle,
    alarms: AlarmFileHandle,
    /// Told when the monitor ends.
    over: Arc<Notify>,
}

/// Runs from the start of the drivers to the end of the scan thread.
async fn shell(
    prepared: PreparedThreads,
    first: FirstProgram,
    mut attendance: ShellDuties<'_>,
) -> Result<ControllerEnd, StartFailure> {
    let (stop, stopped) = watch::channel(false);
    let inputs = devices::inputs(&first.running.setup.devices, &first.field.1);
    let (mut drivers, reloads) = start_drivers(first, &prepared, &attendance, &stopped).await?;
    let (retention, recording) = (attendance.retention.clone(), attendance.recording.clone());
    let systemd = Systemd::of_environment();
    let inputs = async {
        tokio::select! {
            () = inputs => {}
            () = systemd.starting() => {}
        }
    };
    if let Some(name) = attendance.signals.before(inputs).await {
        say!(SIGNAL, signal = name, "{name}: ending before the first scan; nothing was scanned");
        return Ok(ControllerEnd::Orderly);
    }
    let runtime = prepared.start()?;
    let attended = caught(attend(&runtime, &reloads, &mut attendance)).await;
    let over = attended.unwrap_or(ShellEnd { asked: false, waiting: WaitEnd::Stuck });
    if over.waiting == WaitEnd::Stuck {
        // This is done even if the scan thread does not end: the drivers write safe values, and no
        // later scan overwrites them.
        runtime.request_stop();
    }
    let _ = stop.send(true);
    let all_end = async { while drivers.join_next().await.is_some() {} };
    if timeout(DRIVERS_END_MAX, all_end).await.is_err() {
        say!(
            DRIVERS_LATE,
            "drivers did not end in {}",
            duration_text(DRIVERS_END_MAX.as_nanos() as u64)
        );
    }
    let ShellEnd { asked, waiting: WaitEnd::Ended } = over else {
        return Ok(if over.waiting == WaitEnd::Hurried {
            ControllerEnd::Hurried
        } else {
            ControllerEnd::Bug
        });
    };
    let report = runtime.join();
    // All files are written at the same time.
    let (recorded, alarms) = (recording.end(), attendance.alarms.end());
    let last_image = match &retention {
        Some(retention) => retention.end(attendance.signals.stop()).await,
        None => LastImage::Kept,
    };
    if last_image != LastImage::Hurried && alarms.wait(attendance.signals.stop()).await {
        recorded.wait(attendance.signals.stop()).await;
    }
    Ok(conclude(report, asked).or(last_image))
}

/// How the shell's wait for the scan thread ended.
#[derive(Clone, Copy, PartialEq, Eq)]
enum WaitEnd {
    Ended,
    Hurried,
    Stuck,
}

struct ShellEnd {
    /// Whether a signal requested the end.
    asked: bool,
    waiting: WaitEnd,
}

/// Answers signals and notifies systemd until the scan thread has ended.
async fn attend(
    runtime: &Runtime,
    reloads: &Arc<Reloads>,
    attendance: &mut ShellDuties<'_>,
) -> ShellEnd {
    let ShellDuties { signals, guard, over, .. } = attendance;
    let (port, started) = (runtime.port(), Instant::now());
    let limit = sd_notify::watchdog_enabled();
    let (systemd, mut notices) = (Systemd::of_environment(), DueNotices::new(limit));
    let mut pace = LookPace::new(limit);
    let mut asked: Option<(Instant, &str)> = None;
    loop {
        let is_near = asked.is_some() || !notices.has_told_ready() || reloads.on_trial().is_some();
        tokio::select! {
            () = over.notified() => pace.end(),
            told = signals.next() => {
                let SignalOrder::Stop(name) = told else {
                    reloads.hangup();
                    continue;
                };
                if let Some((_, first)) = asked {
                    tell_again(name, first);
                    return ShellEnd { asked: true, waiting: WaitEnd::Hurried };
                }
                tell_stop(name, port.latest().mode);
                asked = Some((Instant::now(), name));
                notices.stop();
                runtime.request_stop();
            }
            () = sleep(pace.next(is_near)) => {
                faults::point(FaultPoint::Shell);
                let (now, pulses) = (started.elapsed(), runtime.pulses());
                let latest = port.latest();
                notices.send_due(now, pulses, &latest, |notice| systemd.send(notice));
                guard.look(now, latest.mode, pulses);
                reloads.look(&latest);
                let waiting = match runtime.state() {
                    ThreadState::Running => None,
                    ThreadState::Over => Some(WaitEnd::Ended),
                    ThreadState::Blind => Some(WaitEnd::Stuck),
                };
                if let Some(waiting) = waiting {
                    return ShellEnd { asked: asked.is_some(), waiting };
                }
                let patience = 2 * port.tempo().patience(1) + STOP_SLACK;
                if asked.is_some_and(|(since, _)| since.elapsed() > patience) {
                    say!(
                        END_STUCK,
                        "the last scan has not ended in {}",
                        duration_text(patience.as_nanos() as u64)
                    );
                    return ShellEnd { asked: true, waiting: WaitEnd::Stuck };
                }
            }
        }
    }
}

/// Logs a second signal.
fn tell_again(name: &str, first: &str) {
    let also = if name == first { "again".into() } else { format!("after {first}") };
    say!(SIGNAL_AGAIN, signal = name, "{name} {also}: ending at once, without waiting");
}

fn tell_stop(name: &str, mode: Mode) {
    match mode {
        Mode::Run | Mode::Stop(StopReason::NotStarted) => {
            say!(SIGNAL, signal = name, "{name}: stopping; the next scan is the last");
        }
        Mode::Stop(_) | Mode::Fault(_) => {
            say!(
                SIGNAL,
                signal = name,
                "{name}: ending from {}; no further scan comes",
                mode.name()
            );
        }
    }
}

async fn start_drivers(
    first: FirstProgram,
    prepared: &PreparedThreads,
    duties: &ShellDuties<'_>,
    stopped: &watch::Receiver<bool>,
) -> Result<(JoinSet<()>, Arc<Reloads>), StartFailure> {
    let FirstProgram { running, reloader, narration, field: (ends, healths), .. } = first;
    let FirstProgram { limit, sockets, alarm_file, start, .. } = first;
    let mut drivers = JoinSet::new();
    let (setup, port) = (&running.setup, &prepared.port());
    let layout = &setup.symbols.layout;
    let patience = port.patience();
    let mut about = operator_server::StatusSources::new(
        prepared,
        duties.retention.clone(),
        duties.recording.clone(),
    );
    about.devices.clone_from(&healths);
    (about.book, about.alarm_file) = (alarm_file.book(), Some(alarm_file));
    let mut modbus = None;
    if let Some(settings) = &setup.modbus {
        let (server, maps) = modbus_start::bind(settings, setup, port, patience).await?;
        let address = server.address().unwrap_or(settings.listen);
        about.modbus = Some((address.to_string(), settings.connections, server.seats()));
        modbus = Some((maps, settings.clone()));
        drivers.spawn(server.run(when_stopped(stopped)));
    }
    let stop = stopped.clone();
    DeviceStarter { setup, port, healths: &healths, stop }.start(ends, &mut drivers);
    let mut device = None;
    let inputs = setup.devices.iter().flat_map(|device| &device.inputs);
    let rules = setup.rules.len() + inputs.filter(|input| input.is_of_part).count();
    if rules > 0 {
        say!(SIMULATED_DEVICE, rules, "a simulated device moves inputs: this is no real plant");
    }
    if !setup.rules.is_empty() {
        let rules = Generations::new(plant::Rules::new(&setup.rules, layout));
        device = Some(rules.clone());
        drivers.spawn(plant::PlantDrive::new(rules, port.clone()).run(when_stopped(stopped)));
    }
    let operator = Generations::new(operator_server::ProgramView::new(setup, &about));
    let views = ProgramViews { operator: operator.clone(), about, narration, modbus, device };
    let (first_program, port) = (Arc::clone(&running), port.clone());
    let parts =
        reload::ReloadParts { running: first_program, reloader, port: port.clone(), views, limit };
    let reloads = Arc::new(Reloads::new(parts));
    let service =
        operator_server::OperatorService::new(operator, port.clone(), Arc::clone(&reloads));
    let part = StartPart::Sockets(setup.controller.clone());
    let servers = start.during(part, || operator_server::OperatorServer::bind(sockets, service))?;
    for server in servers {
        drivers.spawn(server.run(when_stopped(stopped)));
    }
    Ok((drivers, reloads))
}

/// Logs the last lines, and derives the ending from the report.
fn conclude(report: Option<Report>, asked: bool) -> ControllerEnd {
    let Some(report) = report else {
        say!(PROCESS_END at Error, "rungd ends: its scan thread had ended in a panic");
        return ControllerEnd::Bug;
    };
    tell_statistics(&report.statistics);
    say!(PROCESS_END, scans = report.scans, mode = %report.mode.name(), "rungd ends");
    match report.mode {
        Mode::Run | Mode::Stop(_) => ControllerEnd::Orderly,
        Mode::Fault(_) if asked => ControllerEnd::Orderly,
        Mode::Fault(FaultReason::EnginePanic | FaultReason::ScanThreadGone) => ControllerEnd::Bug,
        Mode::Fault(_) => ControllerEnd::Fault,
    }
}

fn tell_start(setup: &ControllerSetup) {
    let ladder = &setup.ladder;
    say!(
        PROCESS_START,
        version = %env!("CARGO_PKG_VERSION"),
        controller = %setup.controller,
        pid = std::process::id(),
        "rungd starts"
    );
    say!(
        LADDER_LOADED,
        ladder = %ladder.name,
        ladders = ladder.ladders,
        files = %ladder.files,
        sha256 = %ladder.sha256,
        blocks = ladder.blocks,
        rungs = ladder.rungs,
        period = %period_text(setup.pace.tempo.period_ns),
        watchdog = %duration_text(setup.pace.tempo.watchdog_ns),
        "ladder loaded"
    );
    let limit = sd_notify::watchdog_enabled();
    if let Some(sentence) = systemd::fault_too_late(setup.pace.tempo.watchdog_ns, limit) {
        say!(FAULT_TOO_LATE, "{sentence}");
    }
    if !setup.warnings.is_empty() {
        let (warnings, controller) = (setup.warnings.len(), &setup.controller);
        say!(
            LADDER_WARNINGS,
            warnings,
            "the ladder has warnings: `rungd check {controller}` shows them"
        );
    }
}

/// Sends the text of a panic on any thread to the log.
fn tell_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let thread = std::thread::current();
        let thread = thread.name().unwrap_or("unnamed").to_owned();
        say!(BUG, thread, "a bug in rungd: {}", super::narration::one_line(&panic.to_string()));
    }));
}
