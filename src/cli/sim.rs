//! `rungd sim`: makes a trace from ladder files or a controller file, a stimulus and a plan. It
//! runs in virtual time, without waiting.
//!
//! This module reads and writes the files. `rig` computes the trace.

use std::io;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;

use super::check::style;
use super::exit::{CommandLine, Exit};
use super::terminal::{say, say_findings};
use super::trace_file::{self, TraceFile};
use super::watched_operands;
use rungd_base::calendar;
use rungd_base::scan_period::ScanPeriod;
use rungd_config::controller::Controller;
use rungd_config::load;
use rungd_engine::Image;
use rungd_engine::isa::duration::{self, DurationError, not_a_duration};
use rungd_lab::rig::simulation::{self, DEFAULT_SCANS, Simulation, StimulusTargets};
use rungd_lab::traces::stimulus::{Stimulus, StimulusRows};
use rungd_lab::traces::trace::{ChangesOnly, RowName, Trace};
use rungd_language::resolve::program::Program;
use rungd_language::source::render::{refuses, render};

/// Runs a ladder program in virtual time and prints the values of its operands
#[derive(Args, Debug)]
pub struct SimArgs {
    /// Ladder files, which form one program; or one controller file, with its simulated devices
    #[arg(required = true, value_name = "FILE.toml")]
    files: Vec<PathBuf>,
    /// Time between two scans (default 10ms; a controller file has its own)
    #[arg(long, value_parser = period)]
    period: Option<ScanPeriod>,
    /// How many scans to run (default 100)
    #[arg(long, value_name = "N", conflicts_with = "time")]
    scans: Option<u64>,
    /// How long to run, as 10s
    #[arg(long = "for", value_name = "TIME", value_parser = time)]
    time: Option<u32>,
    /// The local time of the first scan, as 2026-11-22T06:00:00
    #[arg(long, value_name = "TIME", default_value = "2001-01-01T00:00:00", value_parser = clock)]
    clock: i64,
    /// Inputs and queued writes: CSV, header `scan,OP,OP,…`, or `time,OP,OP,…` with times as 0.35s
    #[arg(long, value_name = "S.csv")]
    stimulus: Option<PathBuf>,
    /// Operands to trace, in this order (default: all operands that the ladder names)
    #[arg(long, value_name = "A,B,…", value_delimiter = ',')]
    watch: Option<Vec<String>>,
    /// The trace's file: CSV, a timing diagram if the name ends in .svg, waves if in .vcd; - is CSV
    /// on standard output
    #[arg(long, default_value = "-", value_name = "OUT.csv|OUT.svg|OUT.vcd|-")]
    trace: PathBuf,
    /// Trace only scans in which a traced operand has changed (CSV)
    #[arg(long)]
    changes: bool,
    /// Stop in an orderly way after the last scan: termination passes run, and a row `stop` follows
    #[arg(long)]
    stop: bool,
}

fn period(text: &str) -> Result<ScanPeriod, String> {
    let us = match ScanPeriod::written_us(text) {
        Some(us) => us.min(ScanPeriod::MOST_US),
        None => u64::from(time(text)?) * 1000,
    };
    ScanPeriod::of_us(us).ok_or(format!("a period is at least {}us", ScanPeriod::LEAST_US))
}

fn time(text: &str) -> Result<u32, String> {
    let ms = duration::parse(text).map_err(|error| match error {
        DurationError::TooLong => {
            format!("`{text}` is too long a duration: the longest is {}", duration::print(i32::MAX))
        }
        DurationError::Form | DurationError::Order => {
            not_a_duration(text, "10ms, 2s, 1m30s or 00:01:30:000")
        }
    })?;
    Ok(ms.unsigned_abs())
}

fn clock(text: &str) -> Result<i64, String> {
    calendar::parse_seconds(text).ok_or_else(|| {
        format!("`{text}` is not a time of the calendar: write it as 2026-11-22T06:00:00")
    })
}

/// Loads the ladder files, prints their findings, and simulates.
///
/// # Errors
/// A file cannot be read or written, or a stimulus or `--watch` does not fit the program.
pub fn sim(args: &SimArgs) -> Result<Exit> {
    let reads = args.files.iter().chain(&args.stimulus);
    if let Some(read) = trace_file::overwritten(&args.trace, reads) {
        let (trace, read) = (args.trace.display(), read.display());
        say(&format!("error: --trace {trace} would overwrite {read}, which it reads\n"));
        return Ok(Exit::Usage);
    }
    let loaded = match args.files.as_slice() {
        [one] if load::is_controller_file(one)? => load::controller_file(one)?,
        files => load::ladder_files(files)?,
    };
    let style = style(false);
    if !loaded.findings.is_empty() {
        say_findings(&render(&loaded.findings, &loaded.files, style));
    }
    match loaded.program {
        Some(program) if !refuses(&loaded.findings, style) => {
            simulate(args, &program, loaded.controller)?;
            Ok(Exit::Ok)
        }
        _ => Ok(Exit::Config),
    }
}

fn simulate(args: &SimArgs, program: &Program, controller: Option<Controller>) -> Result<()> {
    trace_file::refuse_other_forms("--trace", &args.trace)?;
    trace_file::refuse_changes(args.changes, &args.trace)?;
    let period = scan_period(args, controller.as_ref())?;
    let simulation = simulation(args, period)?;
    let lowered = simulation::lowered(program, controller, period);
    let watched = watched_operands::watched(args.watch.as_deref(), program, &lowered.symbols)?;
    let mut stimulus = stimulus(args, period, &StimulusTargets::of(program, &lowered))?;
    let (rows, planned) = (stimulus.take_rows(), simulation.scans);
    let run = |trace: &mut dyn Trace| -> Result<()> {
        let mut counted = CountedTrace { trace, scans: 0 };
        simulation::run(&lowered, &simulation, &stimulus, &mut counted)?;
        warn_of_rows(args, &rows, counted.scans, planned);
        Ok(())
    };
    let mut trace = TraceFile::create(&args.trace, &watched)?;
    if !args.changes {
        run(&mut trace)?;
        return trace.finish();
    }
    let mut trace = ChangesOnly::new(trace);
    run(&mut trace)?;
    trace.into_inner().finish()
}

/// A trace that counts the executed scans: a STOP instruction ends a simulation early.
struct CountedTrace<'a> {
    trace: &'a mut dyn Trace,
    scans: u64,
}

impl Trace for CountedTrace<'_> {
    fn row(&mut self, name: RowName, time_us: u64, image: &Image) -> io::Result<()> {
        self.scans += u64::from(matches!(name, RowName::Scan(_)));
        self.trace.row(name, time_us, image)
    }
}

/// Warns of the rows of the stimulus after the last executed scan.
fn warn_of_rows(args: &SimArgs, rows: &StimulusRows, executed: u64, planned: u64) {
    let (Some(path), Some(row)) = (&args.stimulus, rows.left_out(executed, planned)) else {
        return;
    };
    say(&format!("warning: {}:{}: {}\n", path.display(), row.line, row.message));
}

fn scan_period(args: &SimArgs, controller: Option<&Controller>) -> Result<ScanPeriod> {
    match (args.period, controller) {
        (Some(_), Some(_)) => {
            let message = "--period: a controller file has its own, `[scan] period`";
            Err(CommandLine(message.to_owned()).into())
        }
        (Some(period), None) => Ok(period),
        (None, Some(controller)) => Ok(controller.period),
        (None, None) => Ok(ScanPeriod::DEFAULT),
    }
}

fn simulation(args: &SimArgs, period: ScanPeriod) -> Result<Simulation> {
    let scans = match (args.scans, args.time) {
        (Some(scans), _) => scans,
        (None, Some(ms)) => period.scans_in_ms(ms.into()),
        (None, None) => DEFAULT_SCANS,
    };
    if !simulation::fits(scans, period) {
        bail!(
            "{scans} scans at a period of {} last longer than time can be counted \
             (584 years)",
            period.words()
        );
    }
    Ok(Simulation { scans, stop: args.stop, clock_s: args.clock })
}

fn stimulus(args: &SimArgs, period: ScanPeriod, targets: &StimulusTargets<'_>) -> Result<Stimulus> {
    let Some(path) = &args.stimulus else { return Ok(Stimulus::default()) };
    let name = path.display();
    let bytes = load::read_bytes(path).with_context(|| name.to_string())?;
    let Ok(text) = String::from_utf8(bytes) else { bail!("{name}: the file is not UTF-8 text") };
    Stimulus::parse_timed(&text, period, &|operand| targets.target(operand))
        .map_err(|error| anyhow::anyhow!("{name}:{}: {}", error.line, error.message))
}
