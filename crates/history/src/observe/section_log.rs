//! All changes of public memory in one section, in order, each with the step that made it.
//!
//! Made by executing the section once. Used to find the last change of a cell.

use super::noted_cells::CellChange;
use super::past::TapeMoment;
use super::slice_run::SliceRun;
use rungd_engine::{Cell, Slice};
use rungd_runtime::TapeSection;

/// The changes of a section, in order.
#[derive(Debug)]
pub(super) struct SectionLog {
    pub changes: Vec<CellChange>,
}

impl SectionLog {
    /// Executes a section that fits. `follows`: the run is already at the start of the section.
    pub fn new(run: &mut SliceRun<&Slice>, section: &TapeSection, follows: bool) -> SectionLog {
        let mut changes = Vec::new();
        if !follows {
            run.resume(&section.state);
        }
        for (entry, tape_entry) in (0..).zip(&section.entries) {
            if let Some(call) = tape_entry.call() {
                run.call(entry, call, Some(&mut changes));
            }
        }
        SectionLog { changes }
    }

    /// The last change of a cell before a moment of this section for which `is` returns true.
    pub fn last(
        &self,
        cell: Cell,
        before: TapeMoment,
        is: impl Fn(&CellChange) -> bool,
    ) -> Option<CellChange> {
        let end = (before.entry, before.step);
        let end = self.changes.partition_point(|c| (c.entry as usize, c.step) < end);
        let changes = self.changes[..end].iter().rev();
        changes.filter_map(|change| change.cell_change(cell)).find(|change| is(change))
    }
}
