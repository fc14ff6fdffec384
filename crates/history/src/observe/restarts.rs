//! Finds the RESTART that caused a termination pass or a new start of a block. A RESTART stops and
//! starts the block at once, so no bit shows it.

use super::answer::Restart;
use super::inquiry::Inquiry;
use super::leaves::LeafSeen;
use super::past::TapeMoment;
use super::subject::Subject;
use super::walk::Witness;
use super::watch::Watch;
use rungd_engine::isa::{Bit, BlockId};
use rungd_engine::ops::{ControlKind, OpKind, Power};
use rungd_engine::{BitCell, Cell, Image, ScanStep};

/// A RESTART of a block: its operation, its leg, the cell of its edge history.
struct Restarter {
    deed: ScanStep,
    leg: Power,
    history: u32,
}

/// Finds the RESTARTs of a block that act.
struct RestartWatch<'s> {
    block: BlockId,
    all: Vec<Restarter>,
    /// The contacts of the RESTARTs.
    watch: Watch<'s>,
    /// Whether the block's turn ends the search. If not, the turn discards the RESTART found so
    /// far.
    ends_at_turn: bool,
    ended: bool,
    found: Option<(ScanStep, u32)>,
}

impl Witness for RestartWatch<'_> {
    fn part(&mut self, part: u32, number: u32, image: &Image) {
        self.watch.part(part, number, image);
    }

    fn before(&mut self, deed: ScanStep, number: u32, image: &Image) {
        if deed == ScanStep::Turn(self.block) {
            if self.ends_at_turn {
                self.ended = true;
            } else {
                self.found = None;
            }
        }
        let acts = |restarter: &&Restarter| {
            restarter.deed == deed
                && image.power(restarter.leg)
                && !image.bit(BitCell(restarter.history))
        };
        if !self.ended && self.all.iter().find(acts).is_some() {
            self.found = Some((deed, number));
        }
    }
}

impl Inquiry<'_> {
    /// The RESTART that caused the turn of a block. `at`: a moment in that turn.
    pub fn restart(&mut self, block: BlockId, at: TapeMoment, depth: u32) -> Option<Box<Restart>> {
        let (section, entry) = self.replay.last_begin(at)?;
        let before = self.last_execution(TapeMoment { section, entry, step: 0 });
        let now = Some(TapeMoment { step: 0, ..at });
        for (call, ends_at_turn) in [(now, true), (before, false)] {
            let Some(call) = call else { continue };
            let all = restarters(self.subject, block);
            if all.is_empty() {
                return None;
            }
            let running = Cell::Bit(self.subject.symbols.layout.bit(Bit::Running(block)));
            let deeds = all.iter().map(|restarter| restarter.deed).collect();
            let watch = Watch::new(self.subject, running, deeds, u32::MAX);
            let (ended, found) = (false, None);
            let mut watch = RestartWatch { block, all, watch, ends_at_turn, ended, found };
            self.replay.see(call.section, call.entry, &mut watch);
            if let Some((deed, step)) = watch.found {
                let part = self.subject.site(deed)?.part;
                let leaves = watch.watch.leaves(part);
                return self.restart_of(deed, &leaves, TapeMoment { step, ..call }, depth);
            }
        }
        None
    }

    fn restart_of(
        &mut self,
        deed: ScanStep,
        leaves: &[LeafSeen],
        at: TapeMoment,
        depth: u32,
    ) -> Option<Box<Restart>> {
        let site = self.subject.site(deed)?;
        let instruction = self.subject.instruction(site.part, site.instruction?)?;
        Some(Box::new(Restart {
            at: self.replay.when_of(at.section, at.entry),
            rung: self.subject.place_of_rung(site.part),
            place: self.subject.place(instruction.span),
            legs: self.legs(site.part, leaves, at, depth),
        }))
    }
}

/// The RESTARTs of a block.
fn restarters(subject: &Subject, block: BlockId) -> Vec<Restarter> {
    let tables = &subject.seen.tables;
    let mut all = Vec::new();
    for (at, batch) in (0..).zip(&tables.batches) {
        let control = tables.ops.control.get(batch.first as usize);
        let Some(control) = control.filter(|_| batch.kind == OpKind::Control) else { continue };
        if let ControlKind::Restart(of) = control.kind
            && of.program == block
        {
            all.push(Restarter {
                deed: ScanStep::Batch(at),
                leg: control.leg,
                history: of.history,
            });
        }
    }
    all
}
