//! The traces of `rungd test --trace`: a CSV file for each scenario.
//!
//! A scenario may reload other programs. Their operands have columns too; each is looked up in
//! every program by its name.

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};

use super::recorded_trace::{content, same_kind};
use super::trace_file::TraceFile;
use super::watched_operands;
use rungd_engine::Cell;
use rungd_lab::rig::RigProgram;
use rungd_lab::rig::simulation::all_named;
use rungd_lab::testing::{self, ProgramId, Scenario, Suite, TracedScan};
use rungd_lab::traces::trace::{RowName, TracedOperand, ValueTrace};

/// Runs the scenarios of a suite whose names contain the filter. Writes a trace of all operands
/// that its ladders name for each: `FOLDER/<test file>-<scenario>.csv`.
///
/// # Errors
/// The folder or a file cannot be written.
pub(super) fn write(
    folder: &Path,
    suite: &Suite,
    programs: &[Arc<RigProgram>],
    filter: Option<&str>,
) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let program = &suite.programs[0];
    let watched = watched_operands::watched(None, &program.program, &programs[0].symbols)?;
    let file = Path::new(&suite.name).file_name().unwrap_or_default().to_string_lossy();
    let file = file.trim_end_matches(".toml").trim_end_matches(".test");
    let mut taken = HashSet::new();
    for (at, scenario) in suite.scenarios.iter().enumerate() {
        let name = format!("{}-{}", plain(file), plain(&scenario.name));
        let name = match taken.insert(name.clone()) {
            true => name,
            false => format!("{name}-{}", at + 1),
        };
        if filter.is_some_and(|text| !scenario.name.contains(text)) {
            continue;
        }
        let path = folder.join(format!("{name}.csv"));
        let context = || path.display().to_string();
        let columns = TraceColumns::of(suite, programs, scenario, &watched);
        let mut trace = TraceFile::create(&path, &columns.watched).with_context(context)?;
        let mut row = |scan: TracedScan<'_>| {
            let name = RowName::Scan(scan.number);
            trace.values(name, scan.time_us, &columns.values(scan))
        };
        testing::trace(suite, programs, at, &mut row).with_context(context)?;
        trace.finish().with_context(context)?;
    }
    Ok(())
}

/// The columns of a trace: the operands of all programs of a scenario, then those of the observer.
struct TraceColumns {
    watched: Vec<TracedOperand>,
    /// By program: the cell of each column; `None`: the program has none.
    cells: Vec<Vec<Option<Cell>>>,
    /// By program: the cell of each column of the observer.
    observed: Vec<Vec<Cell>>,
}

impl TraceColumns {
    /// The columns of a scenario; `first`: those of its first program.
    fn of(
        suite: &Suite,
        programs: &[Arc<RigProgram>],
        scenario: &Scenario,
        first: &[TracedOperand],
    ) -> TraceColumns {
        let mut watched = first.to_vec();
        for ProgramId(at) in reloaded(scenario) {
            let known: HashSet<String> =
                watched.iter().map(|operand| operand.name.clone()).collect();
            let named = all_named(&suite.programs[at].program, &programs[at].symbols);
            watched.extend(named.into_iter().filter(|operand| !known.contains(&operand.name)));
        }
        let of_program = |(test_program, lowered): (&testing::TestProgram, &Arc<RigProgram>)| {
            let (scope, layout) = (test_program.program.scope(), &lowered.symbols.layout);
            let cell = |name: &str| layout.cell(scope.address(name).ok()?);
            watched.iter().map(|operand| same_kind(operand, cell(&operand.name), layout)).collect()
        };
        let cells = suite.programs.iter().zip(programs).map(of_program).collect();
        let views = || suite.programs.iter().map(|test_program| test_program.view.as_deref());
        let own = views().next().flatten().into_iter().flat_map(|view| {
            let layout = &view.symbols.layout;
            view.own_operands().map(move |(name, cell)| TracedOperand::new(&name, cell, layout))
        });
        watched.extend(own);
        let cells_of = |view: &testing::View| view.own_operands().map(|(_, cell)| cell).collect();
        let observed = views().map(|view| view.map_or_else(Vec::new, cells_of)).collect();
        TraceColumns { watched, cells, observed }
    }

    /// The values at the end of a scan.
    fn values(&self, scan: TracedScan<'_>) -> Vec<i32> {
        let own = self.cells[scan.program.0].iter().map(|cell| content(scan.image, *cell));
        let observed = self.observed[scan.program.0].iter();
        let observed = observed.zip(scan.observed.into_iter().cycle());
        own.chain(observed.map(|(cell, image)| content(image, Some(*cell)))).collect()
    }
}

/// The programs that a scenario reloads.
fn reloaded(scenario: &Scenario) -> impl Iterator<Item = ProgramId> + '_ {
    scenario.steps.iter().filter_map(|step| step.value.reloaded())
}

/// A name for a file: letters, digits and `-`.
fn plain(name: &str) -> String {
    let mut plain = String::new();
    for c in name.chars() {
        match c.is_alphanumeric() || c == '_' {
            true => plain.push(c),
            false if plain.ends_with('-') => {}
            false => plain.push('-'),
        }
    }
    let plain = plain.trim_matches('-');
    plain.chars().take(100).collect()
}
