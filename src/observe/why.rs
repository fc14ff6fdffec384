//! `why`: the question and its answer.

use super::answer::{Explanation, Limits};
use super::earlier;
use super::inquiry::Inquiry;
use super::past::{At, Past, Refusal};
use super::replay::Replay;
use super::subject::Subject;
use crate::engine::{BitCell, Cell, WordCell};

/// A question.
#[derive(Clone, Copy)]
pub(super) struct Asked {
    /// The time that it is about.
    pub at: At,
    pub limits: Limits,
    /// The number of reloads between this program and the one that was asked first.
    pub reloads: u32,
    /// Whether to search for edits that would change the value.
    pub remedy: bool,
}

impl Subject {
    /// Explains the value of a cell at the end of the tape, or at the end of a scan.
    ///
    /// # Errors
    /// The cell is unknown, or the tape has no such scan or no section that fits the program.
    pub fn why(
        &self,
        past: &mut dyn Past,
        cell: Cell,
        (at, limits): (At, Limits),
    ) -> Result<Explanation, Refusal> {
        self.explained(past, cell, Asked { at, limits, reloads: 0, remedy: limits.change })
    }

    /// The same, of this program or of one before it.
    pub(super) fn explained(
        &self,
        past: &mut dyn Past,
        cell: Cell,
        asked: Asked,
    ) -> Result<Explanation, Refusal> {
        let mut answer = self.answer(past, cell, asked)?;
        earlier::go_on(&mut answer, past, (asked.limits, asked.reloads));
        Ok(answer)
    }

    fn answer(
        &self,
        past: &mut dyn Past,
        cell: Cell,
        Asked { at, limits, reloads: _, remedy }: Asked,
    ) -> Result<Explanation, Refusal> {
        let layout = &self.symbols.layout;
        let is_known = match cell {
            Cell::Bit(BitCell(at)) => at < layout.bit_count(),
            Cell::Word(WordCell(at)) => at < layout.word_count(),
        };
        if !is_known {
            return Err(Refusal::NoSuchCell);
        }
        let slice = self.seen.slice(&[cell]);
        let mut replay = Replay::new(self, &slice, past);
        let moment = replay.moment(at)?;
        let image = replay.seek(moment.section, moment.entry).ok_or(Refusal::NoPast)?.image();
        let value = super::leaves::content(image, cell);
        let when = replay.when(moment);
        let mut inquiry = Inquiry::new(self, replay, limits);
        let root = inquiry.node(cell, value, moment, limits.depth).ok_or(Refusal::NoPast)?;
        let (root, changed) = match limits.change {
            true => inquiry.unchanged(root, moment),
            false => (root, None),
        };
        let change = match cell {
            Cell::Bit(_) if remedy => Some(inquiry.change(cell, moment)),
            Cell::Bit(_) | Cell::Word(_) => None,
        };
        let combined = inquiry.combined(change.as_ref());
        let mode = match inquiry.runs(moment) {
            Some(false) => inquiry.mode(moment),
            Some(true) | None => None,
        };
        let Inquiry { deeper, is_long, .. } = inquiry;
        Ok(Explanation { at: when, root, changed, change, combined, mode, deeper, is_long })
    }
}
