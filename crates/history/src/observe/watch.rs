//! Watches one cell in one call: the steps that decide its value, and the contacts of their rungs.

use std::collections::BTreeMap;

use super::decide::{Decides, decides};
use super::leaves::{LeafSeen, legs, look};
use super::subject::Subject;
use super::walk::Witness;
use rungd_engine::isa::{Address, Bit, BitSpace};
use rungd_engine::{Cell, Image, ScanStep};
use rungd_language::resolve::program::Instruction;

use super::operands::operands;
use super::seen_values::SeenValue;

/// A step that decided the value of a cell.
#[derive(Clone, Debug)]
pub(super) struct DecidingStep {
    /// The number of the step.
    pub step: u32,
    /// The step.
    pub by: ScanStep,
    /// The value before it.
    pub before: i32,
    /// The value after it.
    pub after: i32,
    /// The operands that its instruction read, without its contacts.
    pub operands: Vec<SeenValue>,
    /// The CALLs that lead to its subroutine, the innermost first.
    pub calls: Vec<ScanStep>,
}

/// Observes the steps that write a cell.
pub(super) struct Watch<'s> {
    subject: &'s Subject,
    cell: Cell,
    address: Option<Address>,
    /// Only steps before this number count.
    until: u32,
    /// The steps that may write the cell.
    writers: Vec<ScanStep>,
    /// The value before the step that executes now, and its operands.
    now: Option<(i32, Vec<SeenValue>)>,
    /// The operations that execute: the CALLs, then the one that executes now.
    active: Vec<ScanStep>,
    /// The steps that decided, in order.
    pub decided: Vec<DecidingStep>,
    /// The contacts of parts with a writer, and of the rungs of branches.
    pub seen: BTreeMap<u32, Vec<LeafSeen>>,
    wanted: Vec<u32>,
}

impl<'s> Watch<'s> {
    pub fn new(subject: &'s Subject, cell: Cell, writers: Vec<ScanStep>, until: u32) -> Watch<'s> {
        let mut wanted: Vec<u32> = Vec::new();
        for site in writers.iter().filter_map(|deed| subject.site(*deed)) {
            wanted.push(site.part);
            wanted.extend(subject.outer(site.part));
        }
        wanted.sort_unstable();
        wanted.dedup();
        Watch {
            subject,
            cell,
            address: subject.address(cell),
            until,
            writers,
            now: None,
            active: Vec::new(),
            decided: Vec::new(),
            seen: BTreeMap::new(),
            wanted,
        }
    }

    fn instruction(&self, deed: ScanStep) -> Option<(u32, &'s Instruction)> {
        let site = self.subject.site(deed)?;
        Some((site.part, self.subject.instruction(site.part, site.instruction?)?))
    }

    /// The contacts of a part, those of its rung first.
    pub fn leaves(&self, part: u32) -> Vec<LeafSeen> {
        let outer = self.subject.outer(part);
        let all = outer.into_iter().chain([part]).filter_map(|part| self.seen.get(&part));
        all.flatten().cloned().collect()
    }

    /// Whether a step that does not change the value decides it.
    fn decides(&self, deed: ScanStep) -> bool {
        let Some((part, instruction)) = self.instruction(deed) else { return false };
        if let ScanStep::Pass(_) = deed {
            // A pass decides every value that it writes, except `.Running`: a Task that it disables
            // may already be OFF.
            return !matches!(self.address, Some(Address::Bit(Bit::Running(_))));
        }
        match decides(instruction, self.address) {
            Decides::Always => true,
            Decides::ByChange | Decides::LeavesAlone => false,
            Decides::WhileOn => {
                let leaves = self.leaves(part);
                let on = |at: usize| leaves.get(at).is_some_and(|leaf| leaf.on);
                legs(self.subject, part).0.iter().all(|leg| leg.logic.is_on(&on))
            }
        }
    }
}

impl Witness for Watch<'_> {
    fn part(&mut self, part: u32, number: u32, image: &Image) {
        if self.wanted.binary_search(&part).is_ok() && number <= self.until {
            self.seen.insert(part, look(self.subject, part, number, image));
        }
    }

    fn before(&mut self, deed: ScanStep, number: u32, image: &Image) {
        self.now = None;
        if let ScanStep::Batch(_) = deed {
            self.active.push(deed);
        }
        if number >= self.until || !self.writers.contains(&deed) {
            return;
        }
        if let Some(selected) = self.subject.seen.selected(deed, image)
            && !selected.is_some_and(|selected| selected.overlaps(self.cell))
            && !matches!(self.address, Some(Address::Bit(Bit::Space(BitSpace::St, _))))
        {
            return;
        }
        let read = self.instruction(deed);
        let read = read.map(|(_, reader)| operands(self.subject, reader, self.cell, image));
        self.now = Some((image.value(self.cell), read.unwrap_or_default()));
    }

    fn after(&mut self, deed: ScanStep, number: u32, image: &Image) {
        if let ScanStep::Turn(_) | ScanStep::Element(_) = deed {
            return;
        }
        if let ScanStep::Batch(_) = deed {
            self.active.pop();
        }
        let Some((before, operands)) = self.now.take() else { return };
        let after = image.value(self.cell);
        if before != after || self.decides(deed) {
            let calls = self.active.iter().rev().copied().collect();
            let decided = DecidingStep { step: number, by: deed, before, after, operands, calls };
            self.decided.push(decided);
        }
    }
}
