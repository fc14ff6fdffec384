//! The traces of `rungd test --trace`: a CSV file for each scenario.

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};

use super::trace_file::TraceFile;
use super::watched_operands;
use crate::rig::RigProgram;
use crate::testing::{self, Suite};

/// Runs the scenarios of a suite whose names contain the filter. Writes a trace of all operands
/// that the ladder names for each: `FOLDER/<test file>-<scenario>.csv`.
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
    let of = &suite.programs[0];
    let watched = watched_operands::watched(None, &of.program, &programs[0].symbols)?;
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
        let mut trace = TraceFile::create(&path, &watched).with_context(context)?;
        testing::trace(suite, programs, at, &mut trace).with_context(context)?;
        trace.finish().with_context(context)?;
    }
    Ok(())
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
