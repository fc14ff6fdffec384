//! `rungd sim`: ladder files, a stimulus and a plan in; a trace out. Virtual time, no sleeping.
//!
//! Reads and writes the files; `sim` computes the trace.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;

use super::check::style;
use super::exit::Exit;
use super::terminal::{say, say_drawn};
use super::trace_file::{self, TraceFile};
use super::watched_operands;
use crate::calendar;
use crate::engine::BitCell;
use crate::isa::duration::{self, DurationError};
use crate::isa::{Bit, DeviceId, Health};
use crate::load;
use crate::lower::{Symbols, lower};
use crate::resolve::program::Program;
use crate::resolve::scope::Scope;
use crate::sim::stimulus::{Stimulus, StimulusTarget};
use crate::sim::{self, Plan};
use crate::source::render::{refuses, render};

/// The number of scans if neither `--scans` nor `--for` is given.
const DEFAULT_SCANS: u64 = 100;

/// Runs a ladder program in virtual time and prints the values of its operands
#[derive(Args, Debug)]
pub struct SimArgs {
    /// Ladder files; several files form one program
    #[arg(required = true, value_name = "LADDER.toml")]
    ladders: Vec<PathBuf>,
    /// Time between two scans
    #[arg(long, default_value = "10ms", value_parser = period)]
    period: u32,
    /// How many scans to run (default 100)
    #[arg(long, value_name = "N", conflicts_with = "time")]
    scans: Option<u64>,
    /// How long to run, as 10s
    #[arg(long = "for", value_name = "TIME", value_parser = time)]
    time: Option<u32>,
    /// The local time of the first scan, as 2026-11-22T06:00:00
    #[arg(long, value_name = "TIME", default_value = "2001-01-01T00:00:00", value_parser = clock)]
    clock: i64,
    /// Inputs and queued writes by scan: CSV, header `scan,OP,OP,…`
    #[arg(long, value_name = "S.csv")]
    stimulus: Option<PathBuf>,
    /// Operands to trace, in this order (default: all operands that the ladder names)
    #[arg(long, value_name = "A,B,…", value_delimiter = ',')]
    watch: Option<Vec<String>>,
    /// The trace's file: CSV, a timing diagram if the name ends in .svg, waves if in .vcd; - is CSV
    /// on standard output
    #[arg(long, default_value = "-", value_name = "OUT.csv|OUT.svg|OUT.vcd|-")]
    trace: PathBuf,
    /// Stop in an orderly way after the last scan: termination passes run, and a row `stop` follows
    #[arg(long)]
    stop: bool,
}

fn period(text: &str) -> Result<u32, String> {
    match time(text)? {
        0 => Err("a period is at least 1ms".to_owned()),
        ms => Ok(ms),
    }
}

fn time(text: &str) -> Result<u32, String> {
    let ms = duration::parse(text).map_err(|error| match error {
        DurationError::TooLong => {
            format!("`{text}` is too long a duration: the longest is {}", duration::print(i32::MAX))
        }
        DurationError::Form | DurationError::Order => {
            format!("`{text}` is not a duration: write it as 10ms, 2s, 1m30s or 00:01:30:000")
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
/// A file that cannot be read or written, a stimulus or `--watch` that does not fit the program.
pub fn sim(args: &SimArgs) -> Result<Exit> {
    let reads = args.ladders.iter().chain(&args.stimulus);
    if let Some(read) = trace_file::overwritten(&args.trace, reads) {
        let (trace, read) = (args.trace.display(), read.display());
        say(&format!("error: --trace {trace} would overwrite {read}, which it reads\n"));
        return Ok(Exit::Usage);
    }
    let loaded = load::ladder_files(&args.ladders)?;
    let style = style(false);
    if !loaded.findings.is_empty() {
        say_drawn(&render(&loaded.findings, &loaded.files, style));
    }
    match loaded.program {
        Some(program) if !refuses(&loaded.findings, style) => {
            simulate(args, &program)?;
            Ok(Exit::Ok)
        }
        _ => Ok(Exit::Config),
    }
}

fn simulate(args: &SimArgs, program: &Program) -> Result<()> {
    trace_file::refuse_other_forms("--trace", &args.trace)?;
    let (engine_program, symbols) = lower(program);
    let plan = Plan {
        period_ms: args.period,
        scans: scans(args),
        stop: args.stop,
        well: well(program, &symbols),
        clock_s: args.clock,
        stimulus: stimulus(args, program, &symbols)?,
    };
    if !plan.fits() {
        bail!(
            "{} scans at a period of {} ms last longer than time can be counted (584 years)",
            plan.scans,
            plan.period_ms
        );
    }
    let names = args.watch.as_deref();
    let watched = watched_operands::watched(names, program, &symbols)?;
    let mut trace = TraceFile::create(&args.trace, &watched)?;
    sim::run(engine_program, &plan, &mut trace)?;
    trace.finish()
}

fn scans(args: &SimArgs) -> u64 {
    match (args.scans, args.time) {
        (Some(scans), _) => scans,
        (None, Some(ms)) => u64::from(ms).div_ceil(u64::from(args.period)),
        (None, None) => DEFAULT_SCANS,
    }
}

fn stimulus(args: &SimArgs, program: &Program, symbols: &Symbols) -> Result<Stimulus> {
    let Some(path) = &args.stimulus else { return Ok(Stimulus::default()) };
    let name = path.display();
    let bytes = load::read_bytes(path).with_context(|| name.to_string())?;
    let Ok(text) = String::from_utf8(bytes) else { bail!("{name}: the file is not UTF-8 text") };
    let scope = Scope::of(program);
    let lookup = |operand: &str| StimulusTarget::at(scope.address(operand)?, operand, symbols);
    let stimulus = Stimulus::parse(&text, &lookup)
        .map_err(|error| anyhow::anyhow!("{name}:{}: {}", error.line, error.message))?;
    if let Some(beyond) = stimulus.beyond(scans(args)) {
        say(&format!("warning: {name}:{}: {}\n", beyond.line, beyond.message));
    }
    Ok(stimulus)
}

/// The `.Ok` of every field device that the ladder names: a device is lost only by a stimulus.
fn well(program: &Program, symbols: &Symbols) -> Vec<BitCell> {
    let ids = (0..program.devices.len() as u32).map(DeviceId);
    ids.map(|id| symbols.layout.bit(Bit::Device(id, Health::Ok))).collect()
}
