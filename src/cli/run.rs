//! `rungd run`: a controller file in; a controller that scans until it is told to stop.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use tracing::error;

use crate::daemon::log::{self, LogFormat, LogLevel};
use crate::daemon::{self, Ending, Failure, Options, Refusal, config};
use crate::isa::duration;

/// Runs a controller: scans its ladder at a fixed period until a signal stops it
#[derive(Args, Debug)]
pub struct RunArgs {
    /// The controller file
    #[arg(value_name = "CONTROLLER.toml")]
    controller: PathBuf,
    /// Run N scans, then stop in an orderly way
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    scans: Option<u64>,
    /// The form of the log (default: text, or journal under systemd)
    #[arg(long, value_name = "FORM")]
    log_format: Option<LogFormat>,
    /// Log from this level on (default: the environment's RUNGD_LOG, or info)
    #[arg(long, value_name = "LEVEL")]
    log_level: Option<LogLevel>,
    /// How often to repeat why the controller does not run
    #[arg(long, value_name = "TIME", default_value = "1m", value_parser = repeat, hide = true)]
    repeat_reason: Duration,
}

fn repeat(text: &str) -> Result<Duration, String> {
    match duration::parse(text) {
        Ok(ms) if ms > 0 => Ok(Duration::from_millis(u64::from(ms.unsigned_abs()))),
        _ => Err(format!("`{text}` is not a duration: write it as 500ms or 1m")),
    }
}

/// Exit codes of `rungd run`, beside clap's 2 for a wrong command line.
mod exit {
    pub const OK: i32 = 0;
    /// The environment: a port that is taken, no thread to be had; a second signal.
    pub const FAILURE: i32 = 1;
    /// `--scans`, and a fault came first.
    pub const FAULT: i32 = 3;
    /// A bug in rungd (`EX_SOFTWARE`).
    pub const BUG: i32 = 70;
    /// A bad program or configuration (`EX_CONFIG`): starting again will not help.
    pub const CONFIGURATION: i32 = 78;
}

/// Runs a controller until its end; gives the exit code.
pub fn run(args: &RunArgs) -> i32 {
    let log = match log::init(args.log_format, args.log_level) {
        Ok(log) => log,
        Err(error) => {
            eprintln!("rungd: {error:#}");
            return exit::CONFIGURATION;
        }
    };
    let code = run_logged(args);
    log.flush();
    code
}

fn run_logged(args: &RunArgs) -> i32 {
    let setup = match config::load(&args.controller) {
        Ok(setup) => setup,
        Err(refusal) => return refuse(args, &refusal),
    };
    let options = Options { scans: args.scans, repeat: args.repeat_reason };
    match daemon::run(setup, &options) {
        Ok(Ending::Orderly) => exit::OK,
        Ok(Ending::Hurried) => exit::FAILURE,
        Ok(Ending::Fault) => exit::FAULT,
        Ok(Ending::Bug) => exit::BUG,
        Err(Failure::Configuration(why)) => {
            error!("rungd does not start: {why}");
            exit::CONFIGURATION
        }
        Err(Failure::Environment(why)) => {
            error!("rungd does not start: {why:#}");
            exit::FAILURE
        }
    }
}

/// All findings, for a person each a block of lines; where lines must be whole, one by one.
fn refuse(args: &RunArgs, refusal: &Refusal) -> i32 {
    let controller = args.controller.display();
    if log::is_for_people(args.log_format) {
        eprintln!("{}", refusal.0.trim_end());
    } else {
        for line in refusal.0.lines().filter(|line| !line.trim().is_empty()) {
            error!("{line}");
        }
    }
    error!("rungd does not start: {controller} cannot be run as it is");
    exit::CONFIGURATION
}
