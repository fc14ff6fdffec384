//! The file of a trace. The ending of its name selects the form: CSV, a timing diagram or waves.
//!
//! Used by the commands that trace. `traces` of the lab contains the forms themselves.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::exit::CommandLine;
use rungd_lab::traces::svg::SvgTrace;
use rungd_lab::traces::trace::{CsvTrace, RowName, TracedOperand, ValueTrace};
use rungd_lab::traces::vcd::VcdTrace;

type TraceOutput = Box<dyn Write>;

/// A trace that goes to a file.
pub(super) enum TraceFile<'a> {
    Csv(CsvTrace<'a, TraceOutput>),
    Svg(SvgTrace<'a>, TraceOutput),
    Vcd(VcdTrace<'a, TraceOutput>),
}

impl<'a> TraceFile<'a> {
    /// Creates the file; `-` is standard output.
    ///
    /// # Errors
    /// The error of the system.
    pub fn create(path: &Path, watched: &'a [TracedOperand]) -> Result<TraceFile<'a>> {
        let out = output(path)?;
        Ok(match extension(path) {
            Some("svg") => TraceFile::Svg(SvgTrace::new(watched), out),
            Some("vcd") => TraceFile::Vcd(VcdTrace::new(watched, out)?),
            _ => TraceFile::Csv(CsvTrace::new(watched, out)?),
        })
    }

    /// Writes the remaining bytes.
    ///
    /// # Errors
    /// The error of the system.
    pub fn finish(self) -> Result<()> {
        match self {
            TraceFile::Csv(trace) => drop(trace.finish()?),
            TraceFile::Svg(trace, out) => trace.finish(out)?,
            TraceFile::Vcd(trace) => drop(trace.finish()?),
        }
        Ok(())
    }
}

impl ValueTrace for TraceFile<'_> {
    fn watched(&self) -> &[TracedOperand] {
        match self {
            TraceFile::Csv(trace) => trace.watched(),
            TraceFile::Svg(trace, _) => trace.watched(),
            TraceFile::Vcd(trace) => trace.watched(),
        }
    }

    fn values(&mut self, name: RowName, time_us: u64, values: &[i32]) -> io::Result<()> {
        match self {
            TraceFile::Csv(trace) => trace.values(name, time_us, values),
            TraceFile::Svg(trace, _) => trace.values(name, time_us, values),
            TraceFile::Vcd(trace) => trace.values(name, time_us, values),
        }
    }
}

/// Refuses `--changes` for a form other than CSV: the other forms already show only changes.
///
/// # Errors
/// The command line is wrong.
pub(super) fn refuse_changes(changes: bool, trace: &Path) -> Result<()> {
    match extension(trace) {
        Some(form @ ("svg" | "vcd")) if changes => Err(CommandLine(format!(
            "--changes is for CSV: a .{form} file shows only changes anyway"
        ))
        .into()),
        Some(_) | None => Ok(()),
    }
}

/// Refuses a file name whose ending selects no form. `option` is the option that names it.
///
/// # Errors
/// The command line is wrong.
pub(super) fn refuse_other_forms(option: &str, trace: &Path) -> Result<()> {
    let name = trace.display();
    match extension(trace) {
        _ if trace == Path::new("-") || trace.starts_with("/dev") => Ok(()),
        Some("csv" | "svg" | "vcd") => Ok(()),
        _ => {
            let words = format!("{option} {name}: the ending must be `.csv`, `.svg` or `.vcd`");
            Err(CommandLine(words).into())
        }
    }
}

/// The file of `reads` that the trace would overwrite, even if its path is written differently.
pub(super) fn overwritten<'p>(
    trace: &Path,
    mut reads: impl Iterator<Item = &'p PathBuf>,
) -> Option<&'p PathBuf> {
    let identity = |path: &Path| {
        let meta = fs::metadata(path).ok().filter(fs::Metadata::is_file)?;
        Some((meta.dev(), meta.ino()))
    };
    let trace = identity(trace)?;
    reads.find(|read| identity(read) == Some(trace))
}

fn output(path: &Path) -> Result<TraceOutput> {
    if path == Path::new("-") {
        return Ok(Box::new(BufWriter::new(io::stdout().lock())));
    }
    let file = File::create(path).with_context(|| path.display().to_string())?;
    Ok(Box::new(BufWriter::new(file)))
}

fn extension(path: &Path) -> Option<&str> {
    path.extension().and_then(|e| e.to_str())
}
