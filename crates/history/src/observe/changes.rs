//! The changes of some cells over sections of a tape, scan by scan.
//!
//! Executes the slice that can affect these cells, without the operations that would change
//! nothing: a minute of a large plant takes little time. Called by `live`, for trends and lists of
//! events.

use std::collections::HashMap;
use std::sync::Arc;

use super::slice_run::SliceRun;
use super::subject::Subject;
use rungd_engine::{Cell, EngineCall};
use rungd_runtime::TapeSection;

/// A value of a cell at the end of a scan, different from the value before the scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellChanged {
    /// The scan; the first of a process is 1.
    pub scan: u64,
    /// Its time, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// The cell.
    pub cell: Cell,
    /// The value before; `None` at the beginning.
    pub before: Option<i32>,
    /// The value.
    pub after: i32,
    /// Whether the passes after the last scan of a RUN made it: no output is driven to it.
    pub in_passes: bool,
}

impl Subject {
    /// The changes of some cells, in order; the first value of each cell counts as a change. A
    /// section that does not fit the program is skipped.
    pub fn changes(&self, sections: &[Arc<TapeSection>], cells: &[Cell]) -> Vec<CellChanged> {
        let slice = self.seen.slice(cells);
        let mut run = SliceRun::new(self, &slice);
        let mut known: HashMap<Cell, Option<i32>> = cells.iter().map(|at| (*at, None)).collect();
        let mut all = Vec::new();
        let mut follows = false;
        for section in sections {
            if !section.state.fits(&self.seen) {
                follows = false;
                continue;
            }
            if !(follows && section.start.follows) {
                run.resume(&section.state);
                let image = run.engine().image();
                let scan = section.start.number.saturating_sub(1);
                let at = ChangeTime::of(section, scan, section.begin_ns());
                let values = cells.iter().map(|cell| (*cell, image.value(*cell)));
                let values = values.collect::<Vec<_>>();
                all.extend(news(&mut known, values, at));
            }
            follows = true;
            let mut changes = Vec::new();
            for step in section.steps() {
                let Some(call) = step.entry.call() else { continue };
                run.call(step.at as u32, call, Some(&mut changes));
                if matches!(call, EngineCall::Execute | EngineCall::Terminate) {
                    let values = changes.drain(..).map(|change| (change.cell, change.after));
                    let values = values.filter(|(cell, _)| known.contains_key(cell));
                    let values = last_of_each(values);
                    let at = ChangeTime::of(section, step.number, step.now_ns);
                    let at = ChangeTime { in_passes: call == EngineCall::Terminate, ..at };
                    all.extend(news(&mut known, values, at));
                }
            }
        }
        all
    }
}

/// The time of a change.
#[derive(Clone, Copy)]
struct ChangeTime {
    /// The scan of the change.
    scan: u64,
    /// The time of the scan, ns since 1970 (UTC).
    unix_ns: i64,
    /// Whether it is of the passes after the scan.
    in_passes: bool,
}

impl ChangeTime {
    /// The time of a scan that began at `now_ns` on the clock of the section.
    fn of(section: &TapeSection, scan: u64, now_ns: u64) -> ChangeTime {
        ChangeTime { scan, unix_ns: section.start.unix_ns(now_ns), in_passes: false }
    }
}

/// The last value of each cell, in the order of the first changes of the cells.
fn last_of_each(values: impl Iterator<Item = (Cell, i32)>) -> Vec<(Cell, i32)> {
    let mut all: Vec<(Cell, i32)> = Vec::new();
    for (cell, value) in values {
        match all.iter_mut().find(|(known, _)| *known == cell) {
            Some((_, known)) => *known = value,
            None => all.push((cell, value)),
        }
    }
    all
}

/// The values that differ from the known ones.
fn news(
    known: &mut HashMap<Cell, Option<i32>>,
    values: Vec<(Cell, i32)>,
    ChangeTime { scan, unix_ns, in_passes }: ChangeTime,
) -> Vec<CellChanged> {
    let change = |(cell, after): (Cell, i32)| {
        let before = known.insert(cell, Some(after)).flatten();
        let is_change = before != Some(after);
        is_change.then_some(CellChanged { scan, unix_ns, cell, before, after, in_passes })
    };
    values.into_iter().filter_map(change).collect()
}
