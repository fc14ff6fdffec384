//! `why`: the question and its answer.

use super::answer::{Explanation, ModeSince};
use super::earlier::{EndedOperand, ended_there, explain_ended};
use super::inquiry::Inquiry;
use super::limits::Limits;
use super::past::{EarlierPast, Past, QuestionTime, TapeMoment, WhyRefusal};
use super::replay::{Changed, Replay};
use super::subject::Subject;
use rungd_config::controller::OutputState;
use rungd_engine::{BitCell, Cell, WordCell};
use rungd_runtime::exchange::Mode;

/// The maximum number of reloads behind which an answer goes.
const RELOADS_MAX: u32 = 8;

/// A question.
#[derive(Clone, Copy)]
struct WhyQuestion {
    /// The time that it is about.
    at: QuestionTime,
    limits: Limits,
    /// The number of reloads between this program and the one that was asked first.
    reloads: u32,
    /// Whether to search for edits that would change the value.
    remedy: bool,
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
        at: QuestionTime,
        limits: Limits,
    ) -> Result<Explanation, WhyRefusal> {
        self.explained(past, cell, WhyQuestion { at, limits, reloads: 0, remedy: limits.change })
    }

    /// The same, of this program or of one before it.
    fn explained(
        &self,
        past: &mut dyn Past,
        cell: Cell,
        asked: WhyQuestion,
    ) -> Result<Explanation, WhyRefusal> {
        let mut answer = self.answer(past, cell, asked)?;
        if asked.reloads < RELOADS_MAX {
            behind_the_reload(&mut answer, past, asked);
        }
        Ok(answer)
    }

    fn answer(
        &self,
        past: &mut dyn Past,
        cell: Cell,
        WhyQuestion { at, limits, reloads: _, remedy }: WhyQuestion,
    ) -> Result<Explanation, WhyRefusal> {
        let layout = &self.symbols.layout;
        let is_known = match cell {
            Cell::Bit(BitCell(at)) => at < layout.bit_count(),
            Cell::Word(WordCell(at)) => at < layout.word_count(),
            Cell::WordBit(bit) => bit.word.0 < layout.word_count(),
        };
        if !is_known {
            return Err(WhyRefusal::NoSuchCell);
        }
        let slice = self.seen.slice(&[cell]);
        let mut replay = Replay::new(self, &slice, past);
        let moment = replay.moment(at)?;
        let image = replay.seek(moment.section, moment.entry).ok_or(WhyRefusal::NoPast)?.image();
        let value = image.value(cell);
        let outputs = &self.outputs;
        let is_lost = outputs.is_lost(cell, |ok| image.bit(ok));
        let when = replay.when(moment);
        let mut inquiry = Inquiry::new(self, replay, limits);
        let root = inquiry.node(cell, value, moment, limits.depth).ok_or(WhyRefusal::NoPast)?;
        let (root, changed) = match limits.change {
            true => inquiry.unchanged(root, moment),
            false => (root, None),
        };
        let change = match cell {
            Cell::Bit(_) | Cell::WordBit(_) if remedy => Some(inquiry.change(cell, moment)),
            Cell::Bit(_) | Cell::Word(_) | Cell::WordBit(_) => None,
        };
        let combined = inquiry.combined(change.as_ref());
        let mode = match inquiry.runs(moment) {
            Some(false) => inquiry.mode(moment),
            Some(true) | None => None,
        };
        let output = match mode {
            _ if outputs.number(cell).is_none() => OutputState::AsMemory,
            _ if is_lost => OutputState::Unknown(inquiry.last_known(cell, moment)),
            Some(ModeSince { mode, .. }) => {
                OutputState::Safe(outputs.driven(cell, mode, value) != 0)
            }
            None => OutputState::AsMemory,
        };
        let Inquiry { deeper, is_long, .. } = inquiry;
        let found = Explanation {
            at: when,
            root,
            changed,
            change,
            combined,
            mode,
            output,
            deeper,
            is_long,
        };
        Ok(found)
    }
}

impl Inquiry<'_> {
    /// The state of an output right before its device was lost; `None` if the past begins later.
    fn last_known(&mut self, cell: Cell, moment: TapeMoment) -> Option<bool> {
        let outputs = &self.subject.outputs;
        let mut first: Option<TapeMoment> = None;
        for ok in outputs.devices(cell).iter().map(|ok| Cell::Bit(*ok)) {
            if self.replay.value(ok, moment) != 0 {
                continue;
            }
            let Changed::At(_, lost) = self.replay.last_change(ok, moment, usize::MAX) else {
                return None;
            };
            first = Some(first.map_or(lost, |first| first.min(lost)));
        }
        let lost = first?;
        let held = self.replay.value(cell, lost);
        let mode = self.mode(lost).map_or(Mode::Run, |known| known.mode);
        Some(outputs.driven(cell, mode, held) != 0)
    }
}

/// Asks the program before this one about the operands that nothing has changed since then.
fn behind_the_reload(answer: &mut Explanation, past: &mut dyn Past, asked: WhyQuestion) {
    let ended = ended_there(answer, asked.limits.depth);
    if ended.is_empty() {
        return;
    }
    let names: Vec<&str> = ended.iter().map(|operand| operand.name.as_str()).collect();
    let Some(EarlierPast { subject, mut past }) = past.earlier(&names) else { return };
    let mut explained = |EndedOperand { name, depth }: &EndedOperand| {
        let cell = subject.cell(name).ok()?;
        let depth = *depth;
        let limits = Limits { depth, ..asked.limits };
        let asked = WhyQuestion {
            at: QuestionTime::Now,
            limits,
            reloads: asked.reloads + 1,
            remedy: false,
        };
        subject.explained(&mut *past, cell, asked).ok().map(Box::new)
    };
    let explanations = ended.iter().map(&mut explained).collect();
    explain_ended(answer, asked.limits.depth, explanations);
}
