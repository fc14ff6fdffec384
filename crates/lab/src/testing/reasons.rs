//! The reasons of the values that decide a condition: the answers of `rungd why`, also for the tags
//! of the observer and for `was(x)`.
//!
//! `failure` calls it with the tapes of a test that was played again. A tag of the observer is
//! explained by the rungs of the observer, and what these read of the controller by the ladder.

use std::sync::Arc;

use super::view::{RememberedCells, SeenCell, View};
use rungd_engine::Cell;
use rungd_history::observe::{Explanation, Limits, NodeReach, QuestionTime, Subject};
use rungd_runtime::TapeSection;

/// The limits of the explanation of an operand.
const WHY: Limits = Limits { depth: 2, nodes: 8, change: false };

/// The maximum number of operands that are explained.
const EXPLAINED_MAX: usize = 3;

/// A program, and all that happened to it in its process.
pub(super) struct TapedProgram {
    pub subject: Subject,
    pub sections: Vec<Arc<TapeSection>>,
}

/// Explains values at the end of a scan.
pub(super) struct Reasons<'v> {
    pub ladder: TapedProgram,
    /// The observer, if the test file has one.
    pub observer: Option<TapedProgram>,
    /// What the cells of a condition are; `None`: cells of the ladder.
    pub view: Option<&'v View>,
    /// The scan of the condition.
    pub at: QuestionTime,
}

impl TapedProgram {
    fn why(&mut self, cell: Cell, at: QuestionTime, limits: Limits) -> Option<Explanation> {
        self.subject.why(&mut self.sections, cell, at, limits).ok()
    }

    /// The number of its last scan.
    fn last_scan(&self) -> Option<u64> {
        self.sections.iter().rev().find_map(|section| section.begins().last().map(|it| it.number))
    }
}

impl Reasons<'_> {
    /// The reasons of the first cells of a condition.
    pub fn reasons(&mut self, deciding: &[Cell]) -> Vec<String> {
        let answers = deciding.iter().take(EXPLAINED_MAX);
        answers.filter_map(|cell| self.why(*cell)).map(|answer| answer.text()).collect()
    }

    fn why(&mut self, cell: Cell) -> Option<Explanation> {
        let at = self.at;
        match self.view.map_or(Some(SeenCell::Ladder(cell)), |view| view.seen(cell))? {
            SeenCell::Ladder(cell) => self.ladder.why(cell, at, WHY),
            SeenCell::Observer(cell) => self.of_observer(cell, at),
            SeenCell::Was(RememberedCells { name, place, .. }) => {
                let before = self.scan_before()?;
                let mut answer = match self.view?.seen(*place)? {
                    SeenCell::Ladder(cell) => self.ladder.why(cell, before, WHY),
                    SeenCell::Observer(cell) => self.of_observer(cell, before),
                    SeenCell::Was(_) => None,
                }?;
                answer.root.operand.name.clone_from(name);
                Some(answer)
            }
        }
    }

    /// The scan before that of the condition; `None`: there is none in this process.
    fn scan_before(&self) -> Option<QuestionTime> {
        let last = match self.at {
            QuestionTime::Scan(scan) => scan,
            QuestionTime::Now => self.ladder.last_scan()?,
        };
        last.checked_sub(1).filter(|scan| *scan > 0).map(QuestionTime::Scan)
    }

    /// A tag of the observer: its rungs, and why the controller has the values that they read.
    fn of_observer(&mut self, cell: Cell, at: QuestionTime) -> Option<Explanation> {
        let Reasons { ladder, observer, .. } = self;
        let mut answer = observer.as_mut()?.why(cell, at, WHY)?;
        answer.replace_nodes(WHY.depth, &mut |node, NodeReach { depth, scan }| {
            let operand = &node.operand;
            let name = operand.address.as_ref().unwrap_or(&operand.name);
            let cell = ladder.subject.cell(name).ok()?;
            let at = scan.map_or(at, QuestionTime::Scan);
            Some(ladder.why(cell, at, Limits { depth, ..WHY })?.root)
        });
        Some(answer)
    }
}
