//! Simulates a project for the editor; the result is a picture or a table of its operands.
//!
//! `commands` runs it as a job. The simulation is the one of `rungd sim`, without a stimulus.

use std::io;
use std::path::PathBuf;

use anyhow::{Result, bail};

use super::jobs::{JobPlace, JobResult};
use rungd_base::scan_period::ScanPeriod;
use rungd_config::load::{self, Loaded, OpenTexts};
use rungd_engine::Image;
pub use rungd_lab::rig::simulation::{self, DEFAULT_SCANS, Simulation, all_named};
use rungd_lab::traces::stimulus::Stimulus;
use rungd_lab::traces::svg::SvgTrace;
use rungd_lab::traces::trace::{CsvTrace, RowName, Trace};
use rungd_language::source::finding::Severity;

/// The maximum number of operands in a picture; with more operands the result is a table.
const DRAWN_MAX: usize = 200;

/// The maximum number of values of a simulation.
const VALUES_MAX: u64 = 20_000_000;

/// 2001-01-01, the default start of the clock in `rungd sim`.
const CLOCK_S: i64 = 978_307_200;

/// What to simulate.
#[derive(Debug)]
pub(super) struct SimulateOrder {
    /// The controller file, or the ladder alone.
    pub root: PathBuf,
    /// The texts that the editor shows.
    pub open: OpenTexts,
    /// The number of scans, if given.
    pub scans: Option<u64>,
    /// Whether a table is wanted.
    pub is_table: bool,
}

/// Runs the simulation.
///
/// # Errors
/// The program has errors, or the file cannot be written.
pub(super) fn run(order: &SimulateOrder, place: &JobPlace) -> Result<Option<JobResult>> {
    let Loaded { program, controller, findings, .. } = load::open_file(&order.root, &order.open)?;
    let Some(program) = program else {
        let error = findings.iter().find(|finding| finding.severity() == Severity::Error);
        let why = error.map_or("it has no program", |error| error.message.as_str());
        bail!("the program cannot be simulated: {why}");
    };
    let period = controller.as_ref().map_or(ScanPeriod::DEFAULT, |controller| controller.period);
    let scans = order.scans.unwrap_or(DEFAULT_SCANS);
    let simulation = Simulation { scans, stop: false, clock_s: CLOCK_S };
    let lowered = simulation::lowered(&program, controller, period);
    let watched = all_named(&program, &lowered.symbols);
    let values = scans.saturating_mul(watched.len().max(1) as u64);
    if values > VALUES_MAX || !simulation::fits(scans, period) {
        bail!("{scans} scans are too many to show: use `rungd sim`, which writes them into a file");
    }
    let is_table = order.is_table || watched.len() > DRAWN_MAX;
    let mut content = Vec::new();
    let run = |trace: &mut dyn Trace| {
        let mut trace = WantedTrace { trace, place };
        simulation::run(&lowered, &simulation, &Stimulus::default(), &mut trace)
    };
    let made = if is_table {
        let mut trace = CsvTrace::new(&watched, &mut content)?;
        run(&mut trace).and_then(|()| trace.finish().map(drop))
    } else {
        let mut trace = SvgTrace::new(&watched);
        run(&mut trace).and_then(|()| trace.finish(&mut content))
    };
    if place.is_replaced() {
        return Ok(None);
    }
    made?;
    let ladder = order.root.file_stem().unwrap_or_default().to_string_lossy();
    let form = if is_table { "csv" } else { "svg" };
    let path = place.scratch.write(&format!("{ladder}-simulated.{form}"), &content)?;
    Ok(Some(JobResult::Document(path, !is_table)))
}

/// A trace that ends as soon as its job is replaced.
struct WantedTrace<'a> {
    trace: &'a mut dyn Trace,
    place: &'a JobPlace,
}

impl Trace for WantedTrace<'_> {
    fn row(&mut self, name: RowName, time_us: u64, image: &Image) -> io::Result<()> {
        if self.place.is_replaced() {
            return Err(io::ErrorKind::Interrupted.into());
        }
        self.trace.row(name, time_us, image)
    }
}
