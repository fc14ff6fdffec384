//! Whether a rig has the memory of a run of a proof.
//!
//! `decide` asks it behind a run to a dead end, because nothing is expected there; tests ask it
//! behind every scan of random programs. What has no address, as histories of edges, is not
//! compared.

use crate::any::readers;
use crate::cone::Cone;
use crate::explore::effects::EffectCells;
use crate::model::{Path, ProofModel, Run};
use rungd_engine::isa::{Address, Bit, BitSpace, Word, WordSpace};
use rungd_engine::{BitCell, Cell, WordCell};
use rungd_lab::rig::Rig;

/// The addresses of cells that differ, but for the time of day, those that a run shows before the
/// passes of a last scan, and the bits of devices, which each scan brings anew.
pub fn differing_at(rig: &Rig, run: &Run) -> Vec<Address> {
    let layout = &rig.program().symbols.layout;
    let model = &run.model().code.layout;
    let bits = (0..layout.bit_count()).map(|bit| Cell::Bit(BitCell(bit)));
    let words = (0..layout.word_count()).map(|word| Cell::Word(WordCell(word)));
    let differs = |cell: Cell| {
        let address = layout.address(cell)?;
        let is_given = match address {
            Address::Bit(Bit::Space(BitSpace::St, _) | Bit::Device(..)) => true,
            Address::Word(Word::Space(WordSpace::Dst, _)) => true,
            Address::Bit(_) | Address::Word(_) | Address::Structure(_) => false,
        };
        let of_model = model.cell(address).filter(|_| !is_given)?;
        let is_same = rig.image().value(cell) == run.engine.image().value(of_model);
        (!is_same).then_some(address)
    };
    bits.chain(words).filter_map(differs).collect()
}

/// The end of a path, from which nothing leads to the target of a cone.
pub(crate) struct DeadEnd<'c> {
    cone: &'c Cone,
    /// The whole model, behind the path.
    run: Run<'c>,
}

impl<'c> DeadEnd<'c> {
    /// The end of a path of the whole model.
    pub fn new(model: &'c ProofModel, cone: &'c Cone, path: &Path) -> DeadEnd<'c> {
        let mut run = Run::new(model);
        path.scans.iter().for_each(|choices| drop(run.scan(choices)));
        run.settle();
        DeadEnd { cone, run }
    }

    /// Whether a rig is there: whatever decides what follows is the same. From the start of every
    /// run, it is there always.
    pub fn is_of(&self, rig: &Rig) -> bool {
        if self.run.scans == 0 {
            return true;
        }
        let (code, readers) = (&self.cone.model.code, readers(&self.cone.model.code));
        let free = self.cone.model.inputs.iter().filter(|input| input.is_of_every_scan());
        let free: Vec<Cell> = free.map(|input| input.cell).collect();
        let decides = |address: &Address| {
            let cell = code.layout.cell(*address);
            cell.is_some_and(|cell| match address {
                Address::Bit(Bit::Stage(_) | Bit::Running(_) | Bit::Done(_)) => true,
                Address::Bit(_) | Address::Word(_) | Address::Structure(_) => {
                    let number = EffectCells { bits: code.bit_count }.number(cell);
                    readers.contains_key(&number) && !free.contains(&cell)
                }
            })
        };
        !differing_at(rig, &self.run).iter().any(decides)
    }
}
