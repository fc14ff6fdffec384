//! One question: finds the write that decided a value by executing the past again.
//!
//! `causes` and `reasons` turn the write into data; `change` tries edits that would change the
//! value.

use super::answer::TapeEnd;
use super::leaves::LeafSeen;
use super::limits::Limits;
use super::noted_cells::CellChange;
use super::past::TapeMoment;
use super::replay::{Changed, Replay, SEARCHED_MAX};
use super::seen_values::SeenValue;
use super::subject::Subject;
use super::watch::{DecidingStep, Watch};
use rungd_engine::isa::BlockId;
use rungd_engine::{Cell, EngineCall, ScanStep};
use rungd_runtime::TapeEntry;

/// A question that is being answered.
pub(super) struct Inquiry<'a> {
    pub subject: &'a Subject,
    pub replay: Replay<'a>,
    pub limits: Limits,
    /// The operands explained so far.
    pub nodes: u32,
    /// The writes explained so far.
    pub shown: Vec<ExplainedWrite>,
    /// The reasons that were cut.
    pub cuts: u32,
    /// The depth that would explain all reasons that were cut because of the depth.
    pub deeper: Option<u32>,
    /// The difference between the depth of the current reason and its indent, in steps.
    pub owed: u32,
    /// Whether reasons were cut because the answer is long enough.
    pub is_long: bool,
    /// The cells that a search for a change may edit, each with the values to try. Nothing in the
    /// program writes them.
    pub free: Vec<(Cell, Vec<i32>)>,
    /// Programs that do not run.
    pub stopped: Vec<BlockId>,
    /// The number of single edits, once all of them have been tried.
    pub singles_end: Option<u32>,
}

/// A write that was explained.
#[derive(Clone, Copy, Debug)]
pub(super) struct ExplainedWrite {
    pub cell: Cell,
    /// The moment right before the write.
    pub at: TapeMoment,
    /// The number of steps to reasons of reasons that were explained; the maximum if nothing below
    /// was cut.
    pub depth: u32,
}

impl ExplainedWrite {
    /// Whether this explanation is as deep as the explanation that is due now.
    pub fn covers(self, now: ExplainedWrite) -> bool {
        (self.cell, self.at) == (now.cell, now.at) && self.depth >= now.depth
    }
}

/// A write that was found.
#[derive(Debug)]
pub(super) struct FoundWrite {
    /// The moment right before the write.
    pub at: TapeMoment,
    /// The value before the write, if the write changed it.
    pub before: Option<i32>,
    /// Whether it happened in the last scan before the question.
    pub in_last_scan: bool,
    pub writer: FoundWriter,
}

/// The place of a change from the log.
pub(super) struct ChangePlace {
    /// The moment right before the write.
    pub at: TapeMoment,
    /// Whether it happened in the last scan before the question.
    pub in_last_scan: bool,
}

/// A step that wrote: an instruction, or a step of a pass.
#[derive(Debug)]
pub(super) struct FoundStep {
    /// The step.
    pub deed: ScanStep,
    /// The contacts of its part.
    pub leaves: Vec<LeafSeen>,
    /// Its operands.
    pub operands: Vec<SeenValue>,
    /// The CALLs that lead to its subroutine, the innermost first.
    pub calls: Vec<ScanStep>,
}

/// The writer of a value.
#[derive(Debug)]
pub(super) enum FoundWriter {
    /// An instruction or a step of a pass.
    Step(FoundStep),
    /// A block's turn.
    Turn(BlockId),
    /// The call of an entry itself.
    Call,
    /// Nothing on the tape: the end of the search, and its section.
    End(TapeEnd, usize),
}

impl<'a> Inquiry<'a> {
    pub fn new(subject: &'a Subject, replay: Replay<'a>, limits: Limits) -> Inquiry<'a> {
        Inquiry {
            subject,
            replay,
            limits,
            nodes: 0,
            shown: Vec::new(),
            cuts: 0,
            deeper: None,
            owed: 0,
            is_long: false,
            free: Vec::new(),
            stopped: Vec::new(),
            singles_end: None,
        }
    }

    /// The write that decided the value of a cell at a moment: the write in the last scan if there
    /// is one, else the last write that changed the value.
    pub fn find(&mut self, cell: Cell, until: TapeMoment) -> FoundWrite {
        // For the operand of the question, the whole tape is searched.
        let most = if self.nodes == 0 { usize::MAX } else { SEARCHED_MAX };
        let begin = self.replay.last_begin(until);
        let begin = begin.map(|(section, entry)| TapeMoment { section, entry, step: 0 });
        let decided = begin.and_then(|begin| self.decided_in_scan(cell, begin, until));
        if let Some(found) = decided {
            if !self.may_be_later(cell, found.at, until) {
                return found;
            }
            return match self.replay.last_change(cell, until, most) {
                Changed::At(change, at) if at > found.at => {
                    self.changed(cell, change, ChangePlace { at, in_last_scan: true })
                }
                Changed::At(..) | Changed::Never(..) => found,
            };
        }
        match self.replay.last_change(cell, until, most) {
            Changed::At(change, at) => {
                let in_last_scan = begin.is_some_and(|begin| at >= begin);
                self.changed(cell, change, ChangePlace { at, in_last_scan })
            }
            Changed::Never(end, section) => FoundWrite {
                at: TapeMoment { section, entry: 0, step: 0 },
                before: None,
                in_last_scan: false,
                writer: FoundWriter::End(end, section),
            },
        }
    }

    /// Whether a block's turn or a write from outside may have written the cell after a step of the
    /// last scan. The watch does not see these writes.
    fn may_be_later(&mut self, cell: Cell, at: TapeMoment, until: TapeMoment) -> bool {
        let is_of_block = self.subject.turns.iter().any(|turn| turn.has(cell));
        is_of_block || at.section != until.section || {
            let Some(section) = self.replay.section(at.section) else { return true };
            let behind = section.entries.get(at.entry + 1..until.entries().max(at.entry + 1));
            behind.unwrap_or_default().iter().any(|entry| {
                let TapeEntry::Call(EngineCall::Write(to, _)) = entry else { return false };
                to.overlaps(cell)
            })
        }
    }

    /// The last step that decided a cell in a scan.
    fn decided_in_scan(
        &mut self,
        cell: Cell,
        begin: TapeMoment,
        until: TapeMoment,
    ) -> Option<FoundWrite> {
        let writers = self.subject.writers(cell);
        if writers.is_empty() {
            return None;
        }
        for section in (begin.section..=until.section).rev() {
            let section_tape = self.replay.section(section)?;
            let from = if section == begin.section { begin.entry } else { 0 };
            let to = if section == until.section { until.entries() } else { usize::MAX };
            for entry in (from..to.min(section_tape.entries.len())).rev() {
                let call = section_tape.entries.get(entry);
                let is_seen = matches!(
                    call,
                    Some(TapeEntry::Call(EngineCall::Execute | EngineCall::Terminate))
                );
                if !is_seen {
                    continue;
                }
                let is_last = (section, entry) == (until.section, until.entry) && until.step > 0;
                let limit = if is_last { until.step } else { u32::MAX };
                let mut watch = Watch::new(self.subject, cell, writers.clone(), limit);
                self.replay.see(section, entry, &mut watch)?;
                if let Some(decided) = watch.decided.last().cloned() {
                    let at = TapeMoment { section, entry, step: decided.step };
                    let before = (decided.before != decided.after).then_some(decided.before);
                    let writer = self.writer(&watch, &decided);
                    return Some(FoundWrite { at, before, in_last_scan: true, writer });
                }
            }
        }
        None
    }

    fn writer(&self, watch: &Watch, decided: &DecidingStep) -> FoundWriter {
        let part = self.subject.site(decided.by).map(|site| site.part);
        FoundWriter::Step(FoundStep {
            deed: decided.by,
            leaves: part.map(|part| watch.leaves(part)).unwrap_or_default(),
            operands: decided.operands.clone(),
            calls: decided.calls.clone(),
        })
    }

    /// The write of a change from the log, with the contacts and operands that its rung saw.
    pub fn changed(&mut self, cell: Cell, change: CellChange, place: ChangePlace) -> FoundWrite {
        let ChangePlace { at, in_last_scan } = place;
        let writer = match change.by {
            None => FoundWriter::Call,
            Some(ScanStep::Turn(block)) => FoundWriter::Turn(block),
            Some(ScanStep::Element(_)) => FoundWriter::Call,
            Some(deed @ (ScanStep::Batch(_) | ScanStep::Pass(_))) => {
                let limit = at.step.saturating_add(1);
                let mut watch = Watch::new(self.subject, cell, vec![deed], limit);
                self.replay.see(at.section, at.entry, &mut watch);
                match watch.decided.last().cloned() {
                    Some(decided) => self.writer(&watch, &decided),
                    None => {
                        let (leaves, operands, calls) = (Vec::new(), Vec::new(), Vec::new());
                        FoundWriter::Step(FoundStep { deed, leaves, operands, calls })
                    }
                }
            }
        };
        FoundWrite { at, before: Some(change.before), in_last_scan, writer }
    }

    /// Adds a cell to those that a search for a change may edit.
    pub fn propose(&mut self, cell: Cell, values: Vec<i32>) {
        let known = self.free.iter_mut().find(|(free_cell, _)| *free_cell == cell);
        match known {
            Some((_, known)) => known.extend(values),
            None => self.free.push((cell, values)),
        }
    }
}
