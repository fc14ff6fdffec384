//! What is seen of a replay, scan by scan: the rows of its trace, and the alarms that came and
//! went.
//!
//! The programs of a recording may change; operands and alarms are found in each by their names.

use std::collections::HashMap;
use std::io;
use std::path::Path;

use anyhow::{Context, Result};

use super::recorded_plant::RecordedPlant;
use super::trace_file::TraceFile;
use super::when::LocalClock;
use crate::engine::{Cell, Image};
use crate::record::ReplayedScan;
use crate::sim::trace::{RowName, ValueTrace, Watched};

/// The most stretches of alarms that are listed.
const ALARMS_MAX: usize = 30;

/// A program of the recording, and its place among all.
pub(super) type Placed<'a> = (usize, &'a RecordedPlant);

/// The content of a cell in an image; 0 of an operand that its program does not have.
pub(super) fn content(image: &Image, cell: Option<Cell>) -> i32 {
    match cell {
        None => 0,
        Some(Cell::Bit(bit)) => i32::from(image.bit(bit)),
        Some(Cell::Word(word)) => image.word(word),
    }
}

/// A trace of a replay. Its times begin with 0 at its first row.
pub(super) struct RecordedTrace<'a> {
    file: TraceFile<'a>,
    path: &'a Path,
    watched: &'a [Watched],
    /// The place of the present program, and the operands' cells in it.
    cells: Option<(usize, Vec<Option<Cell>>)>,
    begin_ns: Option<i64>,
    values: Vec<i32>,
    failed: Option<io::Error>,
}

impl<'a> RecordedTrace<'a> {
    /// Creates the file.
    ///
    /// # Errors
    /// The system's.
    pub fn create(path: &'a Path, watched: &'a [Watched]) -> Result<RecordedTrace<'a>> {
        let file = TraceFile::create(path, watched)?;
        let (cells, begin_ns, values, failed) = (None, None, Vec::new(), None);
        Ok(RecordedTrace { file, path, watched, cells, begin_ns, values, failed })
    }

    /// The row of a scan. An error comes at the end.
    pub fn look(&mut self, (place, plant): Placed, scan: &ReplayedScan, image: &Image) {
        if self.cells.as_ref().is_none_or(|(of, _)| *of != place) {
            let cells = self.watched.iter().map(|watched| same_kind(plant, watched)).collect();
            self.cells = Some((place, cells));
        }
        let Some((_, cells)) = &self.cells else { return };
        self.values.clear();
        self.values.extend(cells.iter().map(|cell| content(image, *cell)));
        self.row(scan);
    }

    /// A row of values.
    pub fn put(&mut self, scan: &ReplayedScan, values: &[i32]) {
        self.values.clear();
        self.values.extend_from_slice(values);
        self.row(scan);
    }

    fn row(&mut self, scan: &ReplayedScan) {
        if self.failed.is_some() {
            return;
        }
        let begin_ns = *self.begin_ns.get_or_insert(scan.unix_ns);
        let time_us = scan.unix_ns.saturating_sub(begin_ns).max(0).unsigned_abs() / 1000;
        let name = RowName::Scan(scan.number);
        self.failed = self.file.values(name, time_us, &self.values).err();
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// The system's.
    pub fn finish(self) -> Result<()> {
        match self.failed {
            Some(error) => Err(error).with_context(|| self.path.display().to_string()),
            None => self.file.finish(),
        }
    }
}

/// The cell of a traced operand, if the program has one of the same kind.
fn same_kind(plant: &RecordedPlant, watched: &Watched) -> Option<Cell> {
    let cell = plant.cell(&watched.name)?;
    let here = Watched::new(&watched.name, cell, plant.layout());
    let is_same = match (here.cell, watched.cell) {
        (Cell::Bit(_), Cell::Bit(_)) => true,
        (Cell::Word(_), Cell::Word(_)) => here.real == watched.real,
        (Cell::Bit(_), Cell::Word(_)) | (Cell::Word(_), Cell::Bit(_)) => false,
    };
    is_same.then_some(cell)
}

/// An alarm from ON to OFF.
struct AlarmStretch {
    tag: String,
    text: String,
    /// Its first scan; and whether it was ON before anything was seen.
    scan: u64,
    from_ns: i64,
    before: bool,
    to_ns: Option<i64>,
}

/// The alarms that came and went.
#[derive(Default)]
pub(super) struct AlarmLog {
    place: Option<usize>,
    /// The alarms of the present program, in its order.
    on: Vec<bool>,
    /// The stretches of the alarms that are ON, by tag.
    open: HashMap<String, usize>,
    stretches: Vec<AlarmStretch>,
    /// Stretches that are not listed.
    more: u64,
}

impl AlarmLog {
    /// Looks at the end of a scan.
    pub fn look(&mut self, (place, plant): Placed, scan: &ReplayedScan, image: &Image) {
        let alarms = &plant.symbols.alarms;
        let is_first = self.place.is_none();
        if self.place != Some(place) {
            self.place = Some(place);
            self.on = alarms.iter().map(|alarm| self.open.contains_key(&alarm.tag)).collect();
        }
        for (at, alarm) in alarms.iter().enumerate() {
            let on = image.bit(alarm.bit);
            if on == self.on[at] {
                continue;
            }
            self.on[at] = on;
            if !on {
                if let Some(stretch) = self.open.remove(&alarm.tag)
                    && let Some(stretch) = self.stretches.get_mut(stretch)
                {
                    stretch.to_ns = Some(scan.unix_ns);
                }
                continue;
            }
            // One that is not listed has a place beyond the list.
            self.open.insert(alarm.tag.clone(), self.stretches.len());
            if self.stretches.len() == ALARMS_MAX {
                self.more += 1;
                continue;
            }
            self.stretches.push(AlarmStretch {
                tag: alarm.tag.clone(),
                text: alarm.text.clone(),
                scan: scan.number,
                from_ns: scan.unix_ns,
                before: is_first,
                to_ns: None,
            });
        }
    }

    /// The list, a line each.
    pub fn text(&self, clock: &LocalClock) -> String {
        let line = |stretch: &AlarmStretch| {
            let AlarmStretch { tag, text, scan, from_ns, before, to_ns } = stretch;
            let when = clock.text(*from_ns);
            let begun = if *before { "on before" } else { "on at" };
            let length = match to_ns {
                Some(to_ns) => format!("for {}", seconds(to_ns.saturating_sub(*from_ns))),
                None => "and still at the end".to_owned(),
            };
            format!("alarm {tag} {begun} {when} (scan {scan}) {length}: {text}\n")
        };
        let mut lines: String = self.stretches.iter().map(line).collect();
        if self.more > 0 {
            lines.push_str(&format!("… and {} times more\n", self.more));
        }
        lines
    }
}

/// `3.250 s`.
pub(super) fn seconds(ns: i64) -> String {
    let ms = ns.max(0) / 1_000_000;
    format!("{}.{:03} s", ms / 1000, ms % 1000)
}
