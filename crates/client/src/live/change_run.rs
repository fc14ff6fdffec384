//! Executes sections of the scan log, and reports the changes of the chosen cells scan by scan.
//!
//! If a section has grown, only its new entries are executed. Used by `change_follower` and
//! `change_history`, which determine the order of the sections.

use std::collections::HashMap;
use std::sync::Arc;

use super::log_event::{LogPosition, LoggedChange};
use super::logged_program::LoggedProgram;
use rungd_engine::{Cell, Engine, EngineCall};
use rungd_runtime::exchange::Mode;
use rungd_runtime::{TapeEntry, TapeSection};

/// Identifies a section among those of all processes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SectionName {
    /// The start time of its process, ns since 1970 (UTC).
    pub process_start_ns: i64,
    /// Its number in the process.
    pub sequence: u64,
}

/// What may have moved since the last report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MovedCells {
    All,
    /// No output.
    Memory,
    /// No output that keeps its value outside RUN.
    NotHeld,
}

/// The resolution of the times of values: one millisecond.
const MOMENT_NS: i64 = 1_000_000;

/// Executes the sections of one program.
pub(super) struct ChangeRun {
    pub program: Arc<LoggedProgram>,
    engine: Engine,
    /// The last reported content of each chosen cell; `None`: never reported.
    values: Vec<Option<i32>>,
    /// The section that is being executed, and the number of its executed entries.
    done: Option<(SectionName, usize)>,
    /// The last executed scan.
    pub at: LogPosition,
    /// The mode after the last executed entry.
    pub mode: Mode,
}

/// The time at the start of a section, ns since 1970 (UTC). Before the first scan of a process it
/// is one millisecond earlier than that scan, so that no two values of a cell have the same time.
pub(super) fn begin_unix_ns(section: &TapeSection) -> i64 {
    let begin_ns = section.start.unix_ns(section.begin_ns());
    match section.state.now_ns() {
        0 => begin_ns.saturating_sub(MOMENT_NS),
        _ => begin_ns,
    }
}

impl ChangeRun {
    /// A run before its first section.
    pub fn new(program: Arc<LoggedProgram>) -> ChangeRun {
        let (engine, values) = (program.playable.engine(), vec![None; program.chosen.len()]);
        let (done, at, mode) = (None, LogPosition::default(), Mode::Run);
        ChangeRun { program, engine, values, done, at, mode }
    }

    /// A run for the next program. A cell with the same name keeps its value, so that only a
    /// different value is reported.
    pub fn followed_by(&self, program: Arc<LoggedProgram>) -> ChangeRun {
        let names = self.program.chosen.iter().map(|(name, _)| name.as_str());
        let known: HashMap<&str, Option<i32>> = names.zip(self.values.iter().copied()).collect();
        let mut run = ChangeRun::new(program);
        for ((name, _), value) in run.program.chosen.iter().zip(&mut run.values) {
            *value = known.get(name.as_str()).copied().flatten();
        }
        run
    }

    /// The contents at the start of a section; `None`: the section does not fit the program.
    pub fn begin(&mut self, section: &TapeSection) -> Option<Vec<i32>> {
        self.done = None;
        if !self.engine.resume(&section.state) {
            return None;
        }
        let (image, mode) = (self.engine.image(), section.start.mode);
        let shown = |cell: Cell| self.program.shown(image, cell, mode);
        Some(self.program.chosen.iter().map(|(_, cell)| shown(*cell)).collect())
    }

    /// Marks the contents at the start of a section as reported.
    pub fn mark_reported(&mut self, values: &[i32]) {
        self.values.iter_mut().zip(values).for_each(|(known, value)| *known = Some(*value));
    }

    /// Executes the new entries of a section, and reports the changes. Returns false if the section
    /// does not fit the program.
    pub fn take(
        &mut self,
        name: SectionName,
        section: &TapeSection,
        tell: &mut dyn FnMut(LoggedChange),
    ) -> bool {
        let process_start_ns = name.process_start_ns;
        let begun = self
            .done
            .filter(|(section_name, done)| *section_name == name && *done <= section.entries.len());
        let begin_ns = begin_unix_ns(section);
        if begun.is_none() {
            if !self.engine.resume(&section.state) {
                self.done = None;
                return false;
            }
            let scan = section.start.number.saturating_sub(1);
            self.at = LogPosition { process_start_ns, scan, unix_ns: begin_ns };
            self.mode = section.start.mode;
            // Before the first scan of a process there is no end of a scan to compare.
            if scan > 0 {
                self.compare(MovedCells::NotHeld, tell);
            }
        }
        let from = begun.map_or(0, |(_, done)| done);
        for step in section.steps().skip(from) {
            match step.entry {
                TapeEntry::Call(call) => {
                    let is_before = step.number < section.start.number || step.now_ns == 0;
                    let unix_ns =
                        if is_before { begin_ns } else { section.start.unix_ns(step.now_ns) };
                    self.at = LogPosition { process_start_ns, scan: step.number, unix_ns };
                    self.call(call, tell);
                }
                TapeEntry::Mode(mode) => {
                    self.mode = mode;
                    // In RUN outputs move with the first scan, outside RUN at once.
                    if mode != Mode::Run {
                        self.compare(MovedCells::All, tell);
                    }
                }
                TapeEntry::Origin(_)
                | TapeEntry::Number(_)
                | TapeEntry::Swap { .. }
                | TapeEntry::State { .. }
                | TapeEntry::Lost { .. } => {}
            }
        }
        self.done = Some((name, section.entries.len()));
        true
    }

    fn call(&mut self, call: EngineCall, tell: &mut dyn FnMut(LoggedChange)) {
        self.engine.apply(call);
        match call {
            EngineCall::Execute => self.compare(MovedCells::All, tell),
            // The passes of a STOP are not driven: the mode follows, with the safe values.
            EngineCall::Terminate if self.mode == Mode::Run => {
                self.compare(MovedCells::Memory, tell)
            }
            EngineCall::Terminate => self.compare(MovedCells::All, tell),
            // Outside of RUN no scan follows in which the change would be found.
            EngineCall::Write(cell, _) | EngineCall::Force(cell, _) | EngineCall::Release(cell)
                if self.mode != Mode::Run
                    && self.program.playable.outputs.number(cell).is_none() =>
            {
                self.compare_cell(cell, tell);
            }
            EngineCall::Write(..)
            | EngineCall::Force(..)
            | EngineCall::Release(_)
            | EngineCall::Start { .. }
            | EngineCall::RequestStop
            | EngineCall::Begin { .. } => {}
        }
    }

    /// Reports the cells whose contents differ from the last reported ones.
    fn compare(&mut self, moved: MovedCells, tell: &mut dyn FnMut(LoggedChange)) {
        let (image, at, mode) = (self.engine.image(), self.at, self.mode);
        let outputs = &self.program.playable.outputs;
        let keeps = |cell: Cell| match moved {
            MovedCells::All => false,
            MovedCells::Memory => outputs.number(cell).is_some(),
            MovedCells::NotHeld => mode != Mode::Run && outputs.is_held(cell),
        };
        let chosen = self.program.chosen.iter().zip(&mut self.values);
        for (number, ((_, cell), known)) in (0..).zip(chosen) {
            let value = self.program.shown(image, *cell, mode);
            if *known != Some(value) && !(known.is_some() && keeps(*cell)) {
                *known = Some(value);
                tell(LoggedChange { cell: number, value, scan: at.scan, unix_ns: at.unix_ns });
            }
        }
    }

    fn compare_cell(&mut self, cell: Cell, tell: &mut dyn FnMut(LoggedChange)) {
        let (value, at) = (self.program.shown(self.engine.image(), cell, self.mode), self.at);
        for number in self.program.numbers(cell) {
            let Some(known) = self.values.get_mut(*number as usize) else { continue };
            if *known != Some(value) {
                *known = Some(value);
                let (scan, unix_ns) = (at.scan, at.unix_ns);
                tell(LoggedChange { cell: *number, value, scan, unix_ns });
            }
        }
    }
}
