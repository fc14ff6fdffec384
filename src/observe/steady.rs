//! Cells whose changes can be found without looking at every step of a scan.
//!
//! If only one operation writes a cell, and no turn or pass can come between, the cell changes at
//! most once in a scan: memory before and after the scan shows it. The same holds for a bit of SETs
//! and RSTs, unless one that would put the other value may have had its rung ON. So a minute is
//! searched with the fast engine, and only a suspected scan is seen.

use super::subject::Subject;
use crate::engine::ops::{OpKind, Power};
use crate::engine::{BitCell, Cell, Deed, Image};
use crate::isa::ElementId;
use crate::resolve::program::BlockKind;

/// A cell that changes at most once in a scan, but for the rivals.
pub(super) struct Steady {
    /// Of a bit with several SETs and RSTs: whether it is a SET, and its leg.
    rivals: Vec<(bool, [Power; 2])>,
}

impl Steady {
    /// `None` if every step must be looked at.
    pub fn of(subject: &Subject, cell: Cell) -> Option<Steady> {
        let mut operations = Vec::new();
        for deed in subject.writers(cell) {
            let site = subject.site(deed)?;
            if !runs_always(subject, subject.part(site.part).element) {
                return None;
            }
            if let Deed::Batch(at) = deed {
                operations.push(at);
            }
        }
        let mut rivals = Vec::new();
        if operations.len() > 1 {
            let tables = &subject.seen.tables;
            for at in operations {
                let batch = tables.batches.get(at as usize)?;
                let first = batch.first as usize;
                if batch.kind == OpKind::Set {
                    rivals.push((true, tables.ops.set.get(first)?.leg.each()));
                } else if batch.kind == OpKind::Rst {
                    rivals.push((false, tables.ops.rst.get(first)?.leg.each()));
                } else {
                    return None;
                }
            }
        }
        Some(Steady { rivals })
    }

    /// The rivals' powers before a scan.
    pub fn powers(&self, image: &Image) -> Vec<bool> {
        self.rivals.iter().flat_map(|(_, leg)| leg.map(|power| image.power(power))).collect()
    }

    /// Whether the bit may have turned over and back in a scan, of the powers before it and of
    /// memory after it.
    pub fn may_turn(&self, subject: &Subject, cell: Cell, before: &[bool], after: &Image) -> bool {
        let value = super::leaves::content(after, cell) != 0;
        let legs = self.rivals.iter().zip(before.chunks(2));
        let mut rivals = legs.filter(|((sets, _), _)| *sets != value);
        rivals.any(|((_, leg), before)| {
            leg.iter().zip(before).all(|(power, before)| may_be_on(subject, *power, *before, after))
        })
    }
}

/// Whether a power may have been ON when its operation executed. A private one is evaluated once;
/// a public one that one step writes was as before or as after the scan.
fn may_be_on(subject: &Subject, power: Power, before: bool, after: &Image) -> bool {
    let cell = Cell::Bit(BitCell(power.cell()));
    let is_private = power.cell() >= subject.symbols.layout.bit_count();
    let after = after.power(power);
    after || !is_private && (before || subject.writers(cell).len() > 1)
}

/// Whether nothing stops a block's own rungs before the controller stops.
fn runs_always(subject: &Subject, element: ElementId) -> bool {
    let block = subject.program.block(element.block);
    element.stage.is_none()
        && match block.kind {
            BlockKind::Program => block.name == "Main",
            BlockKind::TopOfScan | BlockKind::BottomOfScan => true,
            BlockKind::Task | BlockKind::FirstScan | BlockKind::LastScan => false,
        }
}
