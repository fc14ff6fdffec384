//! Judges the end of each scan of a test: the lines of `always`, with the values inside their
//! edges, on memory as conditions see it.
//!
//! `player` and `random_run` call it between the two halves of a scan, so passes come later. It
//! only reads the rig, and decides nothing about the steps of a scenario.

use std::sync::Arc;

use super::suite::{ProgramId, Suite};
use super::view::{View, ViewMemory};
use crate::rig::Rig;
use rungd_engine::{Cell, Image};
use rungd_runtime::TapeSection;

/// The lines of `always` of one test that is being played.
pub(super) struct Judge<'a> {
    suite: &'a Suite,
    program: ProgramId,
    /// By line: the last values inside its edges.
    edges: Vec<Vec<bool>>,
    /// Memory as conditions see it; `None`: as it is.
    memory: Option<ViewMemory>,
}

/// A rig with the judge of its scans.
pub(super) struct JudgedRig<'a> {
    pub rig: Rig,
    pub judge: Judge<'a>,
}

impl<'a> Judge<'a> {
    /// The judge of a test whose rig is before its first scan.
    pub fn new(suite: &'a Suite, rig: &Rig) -> Judge<'a> {
        let memory = suite.programs[0].view.as_ref().map(|view| ViewMemory::new(view, rig));
        let mut judge = Judge { suite, program: ProgramId(0), edges: Vec::new(), memory };
        judge.open_edges();
        judge
    }

    fn open_edges(&mut self) {
        let always = self.suite.always[self.program.0].iter();
        self.edges = always.map(|condition| vec![false; condition.edges]).collect();
    }

    /// Memory as conditions see it.
    pub fn image<'m>(&'m self, rig: &'m Rig) -> &'m Image {
        self.memory.as_ref().map_or(rig.image(), ViewMemory::image)
    }

    /// The view of the program that is running, if its conditions see more than its memory.
    pub fn view(&self) -> Option<&View> {
        self.memory.as_ref().map(ViewMemory::view)
    }

    /// What `why` needs to explain the tags of the observer.
    pub fn sections(&self) -> Vec<Arc<TapeSection>> {
        self.memory.as_ref().map_or_else(Vec::new, ViewMemory::sections)
    }

    /// The cell of the controller that a cell of a condition is; `None`: it is none of the
    /// controller.
    pub fn of_ladder(&self, cell: Cell) -> Option<Cell> {
        self.view().map_or(Some(cell), |view| view.of_ladder(cell))
    }

    /// RUN begins: before the first scan, all values inside the edges are OFF.
    pub fn begins_run(&mut self, rig: &Rig) {
        self.edges.iter_mut().for_each(|edges| edges.fill(false));
        self.memory = self.memory.take().map(|memory| memory.begins_run(rig));
    }

    /// A scan has ended, but for its passes. Call it before anything judges the scan.
    pub fn scanned(&mut self, rig: &Rig) {
        if let Some(memory) = &mut self.memory {
            memory.scanned(rig);
        }
    }

    /// Takes memory as it now is, for a condition between two scans.
    pub fn look(&mut self, rig: &Rig) {
        if let Some(memory) = &mut self.memory {
            memory.look(rig);
        }
    }

    /// The first line of `always` that is false at the end of a scan.
    pub fn broken_line(&mut self, rig: &Rig) -> Option<usize> {
        let image = self.memory.as_ref().map_or(rig.image(), ViewMemory::image);
        let always = self.suite.always[self.program.0].iter();
        let mut broken = None;
        for (at, (condition, edges)) in always.zip(&mut self.edges).enumerate() {
            // Every line, because the edges need the value of each scan.
            if !condition.is_true(image, edges) && broken.is_none() {
                broken = Some(at);
            }
        }
        broken
    }

    /// A reload has brought another program. `has_scanned`: a scan has ended since the last start;
    /// then the edges go on with its values, in the new cells.
    pub fn reload(&mut self, program: ProgramId, rig: &Rig, has_scanned: bool) {
        self.program = program;
        let view: Option<&Arc<View>> = self.suite.programs[program.0].view.as_ref();
        self.memory = self.memory.take().map(|memory| match view {
            Some(view) => memory.reload(view, rig),
            None => memory,
        });
        self.open_edges();
        if has_scanned {
            self.broken_line(rig);
        }
    }
}
