//! The cells that a later scan can read before it overwrites them: the memory of a state.
//!
//! For `form`. Cells that every scan overwrites before it reads them are not part of a state:
//! powers, and coils whose rungs stand before their readers. Which scan executes which element is
//! not known here, so: a cell that an element overwrites counts as overwritten for the rest of
//! that element alone; but for all elements behind a block that executes in every scan from its
//! first to its last operation. Subroutines and passes may come at any place: for them, nothing is
//! overwritten before. A cell that counts as live without need only makes more states.

use rungd_engine::isa::{Bit, BitSpace, BlockId, Word, WordSpace, status};
use rungd_engine::ops::{Control, ControlKind, Op};
use rungd_engine::{BlockRole, EngineProgram};

use super::effects::{EffectCells, Effects};
use crate::model::ProofModel;
use std::ops::Range;

/// Overwritten for all elements behind.
const FOR_ALL: u32 = 1;

/// Whether each cell is live between two scans; bits first.
pub(super) fn live(model: &ProofModel, read_at_end: &[u32]) -> Vec<bool> {
    let code = &model.code;
    let cells = (code.bit_count + code.word_count) as usize;
    let mut search = LiveSearch {
        effects: Effects::new(code),
        program: code,
        live: vec![false; cells],
        overwritten: vec![0; cells],
        element: FOR_ALL,
        visited: FOR_ALL,
    };
    search.overwrite_given(model);
    search.visit_anywhere();
    for block in &code.order {
        search.visit_block(*block);
    }
    search.element = FOR_ALL;
    read_at_end.iter().for_each(|cell| search.read(*cell));
    search.live
}

struct LiveSearch<'p> {
    program: &'p EngineProgram,
    effects: Effects<'p>,
    live: Vec<bool>,
    /// For each cell: the number of the element that overwrites it, or [`FOR_ALL`].
    overwritten: Vec<u32>,
    /// The number of the element that is visited; [`FOR_ALL`]: it executes in every scan.
    element: u32,
    /// The number of the last element.
    visited: u32,
}

impl LiveSearch<'_> {
    /// What is written before the first turn of every scan: inputs and status.
    fn overwrite_given(&mut self, model: &ProofModel) {
        let (layout, numbers) = (&model.code.layout, EffectCells { bits: model.code.bit_count });
        for input in model.inputs.iter().filter(|input| input.is_of_every_scan()) {
            self.overwrite(numbers.number(input.cell));
        }
        for n in 0..status::st::COUNT as u32 {
            self.overwrite(layout.bit(Bit::Space(BitSpace::St, n)).0);
        }
        for n in (0..status::dst::COUNT as u32).filter(|n| *n != status::dst::DOWN_SECONDS) {
            self.overwrite(numbers.word(layout.word(Word::Space(WordSpace::Dst, n)).0));
        }
    }

    /// Passes and subroutines.
    fn visit_anywhere(&mut self) {
        let program = self.program;
        for step in &program.tables.terminations {
            self.effects.read_by_pass(step).into_iter().for_each(|cell| self.read(cell));
        }
        for subroutine in &program.subroutines {
            self.visit(program.blocks[subroutine.0 as usize].own.batches.clone(), false);
        }
    }

    /// A block's own rungs, then its Stages, which may not execute.
    fn visit_block(&mut self, id: BlockId) {
        let program = self.program;
        let block = &program.blocks[id.0 as usize];
        self.visit(block.own.batches.clone(), executes_always(program, id));
        for stage in block.stages.clone() {
            self.visit(program.stages[stage as usize].batches.clone(), false);
        }
    }

    fn visit(&mut self, batches: Range<u32>, executes_always: bool) {
        self.visited += 1;
        self.element = if executes_always { FOR_ALL } else { self.visited };
        for op in operations(self.program, batches) {
            let effect = self.effects.effect(&op);
            effect.all_reads().for_each(|cell| self.read(cell));
            effect.overwrites.into_iter().for_each(|cell| self.overwrite(cell));
        }
    }

    fn read(&mut self, cell: u32) {
        let overwritten = self.overwritten[cell as usize];
        self.live[cell as usize] |= overwritten != FOR_ALL && overwritten != self.element;
    }

    fn overwrite(&mut self, cell: u32) {
        let overwritten = &mut self.overwritten[cell as usize];
        if *overwritten != FOR_ALL {
            *overwritten = self.element;
        }
    }
}

/// The operations of batches of a cone's program, in order.
pub(super) fn operations(
    program: &EngineProgram,
    batches: Range<u32>,
) -> impl Iterator<Item = Op> + '_ {
    let tables = &program.tables;
    let batches = &tables.batches[batches.start as usize..batches.end as usize];
    batches.iter().flat_map(|batch| tables.ops_of(*batch))
}

/// All operations of a cone's program.
pub(super) fn all_operations(program: &EngineProgram) -> impl Iterator<Item = Op> + '_ {
    let own = program.blocks.iter().map(|block| &block.own);
    own.chain(&program.stages).flat_map(|element| operations(program, element.batches.clone()))
}

/// Whether a block executes its own rungs in every scan, from the first to the last operation: it
/// runs from the start, and nothing can halt it.
pub(super) fn executes_always(program: &EngineProgram, id: BlockId) -> bool {
    let runs = match program.blocks[id.0 as usize].role {
        BlockRole::TopOfScan | BlockRole::BottomOfScan => true,
        BlockRole::Program { autostart } => autostart,
        BlockRole::Task | BlockRole::FirstScan | BlockRole::LastScan | BlockRole::Subroutine => {
            false
        }
    };
    let is_kept = program.kept.iter().any(|kept| kept.program == id);
    runs && !is_kept && !may_halt(program, id)
}

/// Whether an instruction can halt a block, or end its execution.
fn may_halt(program: &EngineProgram, id: BlockId) -> bool {
    let halts = |op: Op| {
        let Op::Control(control) = op else { return false };
        let halts = matches!(control.kind, ControlKind::Halt(block) if block == id);
        let restarts = matches!(control.kind, ControlKind::Restart(of) if of.program == id);
        halts || restarts
    };
    let block = &program.blocks[id.0 as usize];
    let stages = block.stages.clone().map(|stage| &program.stages[stage as usize]);
    let exits = |op: Op| matches!(op, Op::Control(Control { kind: ControlKind::Exit, .. }));
    let own = [&block.own].into_iter().chain(stages);
    all_operations(program).any(halts)
        || own.flat_map(|element| operations(program, element.batches.clone())).any(exits)
}
