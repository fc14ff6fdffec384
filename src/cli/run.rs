//! `rungd run`: reads a controller file, and runs the controller until a signal stops it.

use std::fs::File;
use std::io;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result};
use clap::Args;

use super::check::style;
use super::exit::Exit;
use super::folders::has_text_path;
use super::terminal::say_findings;
use crate::daemon::config::{LoadFailure, RunningProgram};
use crate::daemon::guard::{self, ProcessEnd, RestartGuard};
use crate::daemon::log::{self, LogFormat};
use crate::daemon::{
    self, ControllerEnd, ProcessHost, ShellOptions, StartFailure, StartPart, config,
};
use rungd_base::progress::Progress;
use rungd_client::operator::protocol::WantedMode;
use rungd_engine::isa::duration::{self, not_a_duration};
use rungd_runtime::events::Level;
use rungd_runtime::exchange::StopReason;
use rungd_runtime::say::say;

/// The number of free file descriptors that a start needs, including a reserve.
const DESCRIPTORS_LEAST: usize = 16;

/// Runs a controller: scans its ladder at a fixed period until a signal stops it
#[derive(Args, Debug)]
pub struct RunArgs {
    /// The controller file
    #[arg(value_name = "CONTROLLER.toml")]
    controller: PathBuf,
    /// Run N scans, then stop in an orderly way
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    scans: Option<u64>,
    /// Start in STOP, and wait for `rungd mode run`
    #[arg(long)]
    stopped: bool,
    /// The mode after a start that finds nothing to restore (default: `[retain] cold-start`)
    #[arg(long, value_name = "MODE")]
    cold_start: Option<WantedMode>,
    /// The form of the log (default: text, or journal under systemd)
    #[arg(long, value_name = "FORM")]
    log_format: Option<LogFormat>,
    /// The least urgent level to log (default: the environment's RUNGD_LOG, or info)
    #[arg(long, value_name = "LEVEL")]
    log_level: Option<Level>,
    /// The socket on which the journal listens
    #[arg(long, value_name = "PATH", hide = true)]
    journal_socket: Option<PathBuf>,
    /// Count restarts after unclean ends in FILE (default: in systemd's RUNTIME_DIRECTORY)
    #[arg(long, value_name = "FILE")]
    restart_guard: Option<PathBuf>,
    /// Record the inputs and writes of each scan in the folder DIR (default: `[record] dir`;
    /// without both, only the last minute is kept, in memory)
    #[arg(long, value_name = "DIR", env = "RUNGD_RECORD")]
    record: Option<PathBuf>,
    /// The time in RUN after which the count of restarts begins again
    #[arg(long, value_name = "TIME", default_value = "10m", value_parser = span, hide = true)]
    healthy_after: Duration,
    /// How often to repeat the reason why the controller does not run
    #[arg(long, value_name = "TIME", default_value = "1m", value_parser = span, hide = true)]
    repeat_reason: Duration,
    /// The time limit for reading and checking the files of a reload
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = span, hide = true)]
    reload_limit: Duration,
}

fn span(text: &str) -> Result<Duration, String> {
    match duration::parse(text) {
        Ok(ms) if ms > 0 => Ok(Duration::from_millis(u64::from(ms.unsigned_abs()))),
        _ => Err(not_a_duration(text, "500ms or 1m")),
    }
}

/// Runs a controller until its end.
///
/// # Errors
/// Signals cannot be received, the log cannot be started, or there are too few file descriptors.
pub fn run(args: &RunArgs) -> Result<Exit> {
    probe_descriptors()?;
    let mut host = ProcessHost::new(args.repeat_reason).context("cannot listen for signals")?;
    let log = log::init(args.log_format, args.log_level, args.journal_socket.as_deref())?;
    let file = args.restart_guard.clone().or_else(guard::file_of_environment);
    let counted = file.as_ref().map(|file| file.display().to_string());
    let counted = StartPart::RestartCount(counted.unwrap_or_default());
    let mut guard = host.during(counted, || RestartGuard::begin(file, args.healthy_after));
    let exit = run_logged(args, &mut host, &mut guard).unwrap_or_else(|why| {
        say!(START_REFUSED, "rungd does not start: {why:#}");
        Exit::of(&why)
    });
    guard.end(match exit {
        Exit::Ok => ProcessEnd::Orderly,
        Exit::Software => ProcessEnd::Crashed,
        Exit::Refused
        | Exit::Usage
        | Exit::Unavailable
        | Exit::Io
        | Exit::Fault
        | Exit::NoPerm
        | Exit::Config => ProcessEnd::Refused,
    });
    host.end();
    log.flush();
    Ok(exit)
}

/// Checks that enough descriptors are free, because later calls open some and must not fail.
fn probe_descriptors() -> Result<()> {
    let probes: io::Result<Vec<File>> =
        (0..DESCRIPTORS_LEAST).map(|_| File::open("/dev/null")).collect();
    probes.context("a controller needs 16 file descriptors to start")?;
    Ok(())
}

fn run_logged(args: &RunArgs, host: &mut ProcessHost, guard: &mut RestartGuard) -> Result<Exit> {
    has_text_path(&args.controller)?;
    let (path, style) = (args.controller.clone(), style(false));
    let progress = Progress::new();
    let files = StartPart::Files(progress.clone());
    let Some(loaded) = host.unless_stopped(files, move || config::load(&path, style, &progress))
    else {
        return Ok(Exit::Ok);
    };
    let settled = match loaded {
        Ok((program, setup)) => RunningProgram { program, setup },
        Err(LoadFailure::Unreadable(failure)) => return Err(failure),
        Err(LoadFailure::Refused(why)) => return Ok(refuse(args, &why)),
    };
    let options = ShellOptions {
        scans: args.scans,
        runs_cold: args.cold_start.map(|mode| mode == WantedMode::Run),
        repeat: args.repeat_reason,
        reload_limit: args.reload_limit,
        record: args.record.clone(),
        start_in_stop: match (guard.trips(), args.stopped) {
            (true, _) => Some(StopReason::RestartGuard),
            (false, true) => Some(StopReason::CommandLine),
            (false, false) => None,
        },
    };
    match daemon::run(host, settled, &options, guard) {
        Ok(ControllerEnd::Orderly) => Ok(Exit::Ok),
        Ok(ControllerEnd::Fault | ControllerEnd::Hurried) => Ok(Exit::Fault),
        Ok(ControllerEnd::MemoryLost) => Ok(Exit::Io),
        Ok(ControllerEnd::Bug) => Ok(Exit::Software),
        Err(StartFailure::Configuration(why)) => {
            say!(START_REFUSED, "rungd does not start: {why}");
            Ok(Exit::Config)
        }
        Err(StartFailure::Environment(why)) => {
            say!(START_REFUSED, "rungd does not start: {why:#}");
            Ok(Exit::Io)
        }
    }
}

/// Prints all findings: as blocks of lines for people, as one log line for each finding for
/// machines.
fn refuse(args: &RunArgs, text: &str) -> Exit {
    if log::is_for_people(args.log_format) {
        say_findings(&format!("{}\n", text.trim_end()));
    } else {
        for line in text.lines().filter(|line| !line.trim().is_empty()) {
            say!(FINDING, "{line}");
        }
    }
    say!(
        START_REFUSED,
        "rungd does not start: {} cannot be run as it is",
        args.controller.display()
    );
    Exit::Config
}
