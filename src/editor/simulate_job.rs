//! Simulates a project for the editor: a picture of its operands, or a table of them.
//!
//! Called by `commands` as a job. The simulation is that of `rungd sim`, without a stimulus.

use std::path::PathBuf;

use anyhow::{Result, bail};

use super::jobs::{JobPlace, Made};
use crate::load::{self, Loaded, OpenTexts};
use crate::rig::simulation::{
    DEFAULT_PERIOD_MS, DEFAULT_SCANS, LoweredSimulation, Simulation, all_named,
};
use crate::sim::stimulus::Stimulus;
use crate::sim::svg::SvgTrace;
use crate::sim::trace::CsvTrace;
use crate::source::finding::Severity;

/// The most operands of a picture: more are a table.
const DRAWN_MAX: usize = 200;

/// The most scans.
const SCANS_MAX: u64 = 1_000_000;

/// 2001-01-01, as `rungd sim` begins where nothing is said.
const CLOCK_S: i64 = 978_307_200;

/// What to simulate.
#[derive(Debug)]
pub(super) struct SimulateOrder {
    /// The controller file, or the ladder alone.
    pub root: PathBuf,
    /// The texts that the editor shows.
    pub open: OpenTexts,
    /// The number of scans, if it is said.
    pub scans: Option<u64>,
    /// Whether a table is wanted.
    pub is_table: bool,
}

/// Simulates.
///
/// # Errors
/// The program has errors, or the file cannot be written.
pub(super) fn run(order: &SimulateOrder, place: &JobPlace) -> Result<Option<Made>> {
    let Loaded { program, controller, findings, .. } = load::open_file(&order.root, &order.open)?;
    let Some(program) = program else {
        let error = findings.iter().find(|finding| finding.severity() == Severity::Error);
        let why = error.map_or("it has no program", |error| error.message.as_str());
        bail!("the program cannot be simulated: {why}");
    };
    let period_ms = controller.as_ref().map_or(DEFAULT_PERIOD_MS, |of| of.period_ms);
    let scans = order.scans.unwrap_or(DEFAULT_SCANS).clamp(1, SCANS_MAX);
    let simulation = Simulation { period_ms, scans, stop: false, clock_s: CLOCK_S };
    let lowered = LoweredSimulation::of(&program, controller);
    let watched = all_named(&program, lowered.symbols());
    let is_table = order.is_table || watched.len() > DRAWN_MAX;
    let mut content = Vec::new();
    if is_table {
        let mut trace = CsvTrace::new(&watched, &mut content)?;
        lowered.run(&program, (simulation, Stimulus::default()), &mut trace)?;
        trace.finish()?;
    } else {
        let mut trace = SvgTrace::new(&watched);
        lowered.run(&program, (simulation, Stimulus::default()), &mut trace)?;
        trace.finish(&mut content)?;
    }
    if place.is_replaced() {
        return Ok(None);
    }
    let ladder = order.root.file_stem().unwrap_or_default().to_string_lossy();
    let form = if is_table { "csv" } else { "svg" };
    let path = place.scratch.write(&format!("{ladder}-simulated.{form}"), &content)?;
    Ok(Some(Made::Document(path, !is_table)))
}
