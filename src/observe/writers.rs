//! The steps that may write a cell, by the cell.

use std::collections::HashMap;

use crate::engine::{BitCell, Cell, Deed, Stretches, WordCell};

/// The longest stretch of which every cell is listed.
const LISTED_MAX: u32 = 16;

/// The steps of a program by the cells that they may write.
#[derive(Debug, Default)]
pub(super) struct Writers {
    listed: HashMap<Cell, Vec<Deed>>,
    /// Steps that write whole arrays.
    wide: Vec<Deed>,
}

impl Writers {
    /// Of all steps with what they write.
    pub fn new<'s>(steps: impl Iterator<Item = (Deed, &'s Stretches)>) -> Writers {
        let mut writers = Writers::default();
        steps.for_each(|(deed, written)| writers.add(deed, written));
        writers
    }

    fn add(&mut self, deed: Deed, written: &Stretches) {
        let mut all = written.bits.iter().chain(&written.words);
        if all.any(|(_, count)| *count > LISTED_MAX) {
            return self.wide.push(deed);
        }
        for (first, count) in &written.bits {
            for at in *first..first + count {
                self.listed.entry(Cell::Bit(BitCell(at))).or_default().push(deed);
            }
        }
        for (first, count) in &written.words {
            for at in *first..first + count {
                self.listed.entry(Cell::Word(WordCell(at))).or_default().push(deed);
            }
        }
    }

    /// The steps that may write a cell.
    pub fn of<'s>(&self, cell: Cell, written: impl Fn(Deed) -> Option<&'s Stretches>) -> Vec<Deed> {
        let listed = self.listed.get(&cell).into_iter().flatten().copied();
        let wide = self.wide.iter().copied();
        let wide = wide.filter(|deed| written(*deed).is_some_and(|written| written.has(cell)));
        let mut all: Vec<Deed> = listed.chain(wide).collect();
        all.dedup();
        all
    }
}
