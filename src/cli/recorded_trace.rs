//! What a replay shows: the rows of its trace, scan by scan, and the list of its alarms.
//!
//! A recording may contain several programs; operands are looked up in each by name.

use std::io;
use std::path::Path;

use anyhow::{Context, Result};

use super::terminal::one_line;
use super::trace_file::TraceFile;
use super::when::LocalClock;
use rungd_engine::{Cell, Image, Layout};
use rungd_history::playback::{AlarmLog, AlarmStretch, PlacedProgram, PlayedScan};
use rungd_lab::traces::trace::{RowName, TracedOperand, ValueTrace};

/// The content of a cell in an image; 0 for an operand that the program does not have.
pub(super) fn content(image: &Image, cell: Option<Cell>) -> i32 {
    cell.map_or(0, |cell| image.value(cell))
}

/// A trace of a replay. Its times begin with 0 at its first row.
pub(super) struct RecordedTrace<'a> {
    file: TraceFile<'a>,
    path: &'a Path,
    watched: &'a [TracedOperand],
    /// The index of the present program, and the operands' cells in it.
    cells: Option<(usize, Vec<Option<Cell>>)>,
    begin_ns: Option<i64>,
    values: Vec<i32>,
    failed: Option<io::Error>,
}

impl<'a> RecordedTrace<'a> {
    /// Creates the file.
    ///
    /// # Errors
    /// The error of the system.
    pub fn create(path: &'a Path, watched: &'a [TracedOperand]) -> Result<RecordedTrace<'a>> {
        let file = TraceFile::create(path, watched)?;
        let (cells, begin_ns, values, failed) = (None, None, Vec::new(), None);
        Ok(RecordedTrace { file, path, watched, cells, begin_ns, values, failed })
    }

    /// Adds the row of a scan. An error is returned by [`RecordedTrace::finish`].
    pub fn look(&mut self, program: PlacedProgram<'_>, scan: &PlayedScan, image: &Image) {
        let PlacedProgram { place, program } = program;
        if self.cells.as_ref().is_none_or(|(program_place, _)| *program_place != place) {
            let cell = |watched: &TracedOperand| {
                same_kind(watched, program.cell(&watched.name), program.layout())
            };
            let cells = self.watched.iter().map(cell).collect();
            self.cells = Some((place, cells));
        }
        let Some((_, cells)) = &self.cells else { return };
        self.values.clear();
        self.values.extend(cells.iter().map(|cell| content(image, *cell)));
        self.row(scan);
    }

    /// Adds a row of values.
    pub fn put(&mut self, scan: &PlayedScan, values: &[i32]) {
        self.values.clear();
        self.values.extend_from_slice(values);
        self.row(scan);
    }

    fn row(&mut self, scan: &PlayedScan) {
        if self.failed.is_some() {
            return;
        }
        let begin_ns = *self.begin_ns.get_or_insert(scan.unix_ns);
        let time_us = scan.unix_ns.saturating_sub(begin_ns).max(0).unsigned_abs() / 1000;
        let name = RowName::Scan(scan.number);
        self.failed = self.file.values(name, time_us, &self.values).err();
    }

    /// Writes the remaining bytes.
    ///
    /// # Errors
    /// The error of the system.
    pub fn finish(self) -> Result<()> {
        match self.failed {
            Some(error) => Err(error).with_context(|| self.path.display().to_string()),
            None => self.file.finish(),
        }
    }
}

/// The cell of a traced operand in a program, if the program has one of the same kind. `cell`: what
/// the program has under its name.
pub(super) fn same_kind(
    watched: &TracedOperand,
    cell: Option<Cell>,
    layout: &Layout,
) -> Option<Cell> {
    let here = TracedOperand::new(&watched.name, cell?, layout);
    let is_same = match (here.cell, watched.cell) {
        (Cell::Word(_), Cell::Word(_)) => here.real == watched.real,
        (here, watched) => here.is_bit() && watched.is_bit(),
    };
    is_same.then_some(here.cell)
}

/// The alarms that came and went, one line for each stretch.
pub(super) fn alarms_text(alarms: &AlarmLog, clock: &LocalClock) -> String {
    let line = |stretch: &AlarmStretch| {
        let AlarmStretch { tag, text, scan, from_ns, before, to_ns } = stretch;
        let when = clock.text(*from_ns);
        let begun = if *before { "on before" } else { "on at" };
        let length = match to_ns {
            Some(to_ns) => format!("for {}", seconds(to_ns.saturating_sub(*from_ns))),
            None => "and still at the end".to_owned(),
        };
        // A recorded text may contain line ends, and must not add a line to the report.
        let (tag, text) = (one_line(tag), one_line(text));
        format!("alarm {tag} {begun} {when} (scan {scan}) {length}: {text}\n")
    };
    let mut lines: String = alarms.stretches.iter().map(line).collect();
    if alarms.more > 0 {
        lines.push_str(&format!("… and {} times more\n", alarms.more));
    }
    lines
}

/// `3.250 s`.
pub(super) fn seconds(ns: i64) -> String {
    let ms = ns.max(0) / 1_000_000;
    format!("{}.{:03} s", ms / 1000, ms % 1000)
}
