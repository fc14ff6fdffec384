//! Cuts by hand: `any` of `[prove]`.
//!
//! `question` calls it, before both ways. A cell has any value at the start of every scan, and
//! again behind every operation that writes it; an operation that writes nothing else is left out,
//! so what it computes is in no cone. Termination passes write their own values, and so does a
//! subroutine, which may execute several times in a scan. Every run of the ladder is a run of such
//! a program, so what is proved of it holds for the ladder.

use std::collections::HashMap;
use std::ops::Range;

use rungd_engine::isa::status::st;
use rungd_engine::isa::{Bit, BitSpace};
use rungd_engine::ops::{
    BitWritten, LegPowers, Move, Op, Out, Power, WordRead, WordTarget, WordWritten,
};
use rungd_engine::{Batch, BitCell, Cell, EngineProgram, WordCell};

use crate::cone::split;
use crate::explore::effects::{EffectCells, Effects};
use crate::model::FreeInput;

/// A program in which cells have any value.
pub struct AnyProgram {
    /// The program.
    pub code: EngineProgram,
    /// The values: those at the start of a scan, in the order of the cells, then those behind
    /// operations.
    pub inputs: Vec<AnyValue>,
}

/// A value that is free in every scan.
pub struct AnyValue {
    /// Where it stands.
    pub input: FreeInput,
    /// The place of its cell in the list.
    pub at: usize,
}

/// Gives cells any value within their limits.
pub fn any_in(code: &EngineProgram, cells: &[FreeInput]) -> AnyProgram {
    let inputs = (0..).zip(cells).map(|(at, input)| AnyValue { input: *input, at }).collect();
    if cells.is_empty() {
        return AnyProgram { code: code.clone(), inputs };
    }
    let split = split(code);
    let mut code = split.clone();
    code.tables.batches.clear();
    let mut search = AnySearch { readers: readers(&split), cells, code, inputs };
    let is_subroutine = |at: u32| split.subroutines.iter().any(|id| id.0 == at);
    for (at, block) in (0..).zip(&split.blocks) {
        let range = &block.own.batches;
        let batches = match is_subroutine(at) {
            true => search.unchanged(&split, range.clone()),
            false => search.with_any(&split, range.clone()),
        };
        search.code.blocks[at as usize].own.batches = batches;
    }
    for (at, stage) in split.stages.iter().enumerate() {
        search.code.stages[at].batches = search.with_any(&split, stage.batches.clone());
    }
    AnyProgram { code: search.code, inputs: search.inputs }
}

/// For each cell the number of operations and passes that read it.
pub(crate) fn readers(code: &EngineProgram) -> HashMap<u32, usize> {
    let effects = Effects::new(code);
    let mut readers = HashMap::new();
    let mut read = |cell: u32| *readers.entry(cell).or_default() += 1;
    for batch in &code.tables.batches {
        for op in code.tables.ops_of(*batch) {
            effects.effect(&op).all_reads().for_each(&mut read);
        }
    }
    let passes = code.tables.terminations.iter();
    passes.flat_map(|step| effects.read_by_pass(step)).for_each(read);
    readers
}

struct AnySearch<'c> {
    readers: HashMap<u32, usize>,
    cells: &'c [FreeInput],
    /// The program that is being made.
    code: EngineProgram,
    inputs: Vec<AnyValue>,
}

impl AnySearch<'_> {
    fn unchanged(&mut self, split: &EngineProgram, range: Range<u32>) -> Range<u32> {
        let batches = &mut self.code.tables.batches;
        let first = batches.len() as u32;
        batches.extend(&split.tables.batches[range.start as usize..range.end as usize]);
        first..batches.len() as u32
    }

    /// The operations of an element, with any value behind each that writes a cell of the list.
    fn with_any(&mut self, split: &EngineProgram, range: Range<u32>) -> Range<u32> {
        let first = self.code.tables.batches.len() as u32;
        let (effects, numbers) = (Effects::new(split), EffectCells { bits: split.bit_count });
        for at in range {
            let batch = split.tables.batches[at as usize];
            let op = split.tables.ops_of(batch).next().expect("a batch of one operation");
            let effect = effects.effect(&op);
            let place = |cell: &u32| {
                self.cells.iter().position(|input| numbers.number(input.cell) == *cell)
            };
            let mut cut: Vec<usize> = effect.writes.iter().filter_map(place).collect();
            cut.sort_unstable();
            cut.dedup();
            let own = |cell: &u32| effect.all_reads().filter(|read| read == cell).count();
            let is_read = |cell: &u32| self.readers.get(cell).copied().unwrap_or(0) > own(cell);
            let others = effect.writes.iter().any(|cell| place(cell).is_none() && is_read(cell));
            if cut.is_empty() || others || matches!(op, Op::Control(_)) {
                self.code.tables.batches.push(batch);
            }
            cut.into_iter().for_each(|at| self.give_any(at));
        }
        first..self.code.tables.batches.len() as u32
    }

    /// Gives a cell another value, which is an input of its own.
    fn give_any(&mut self, at: usize) {
        let FreeInput { cell, low, high, cold } = self.cells[at];
        let code = &mut self.code;
        let (fresh, op) = match cell {
            Cell::Bit(BitCell(bit)) => {
                let fresh = code.bit_count;
                code.bit_count += 1;
                let leg = LegPowers::of(Power::of(fresh));
                (Cell::Bit(BitCell(fresh)), Op::Out(Out { leg, bit: BitWritten(bit) }))
            }
            Cell::Word(WordCell(word)) => {
                let fresh = code.word_count;
                code.word_count += 1;
                let BitCell(on) = code.layout.bit(Bit::Space(BitSpace::St, st::ON));
                let to = WordTarget { word: WordWritten(word), min: low, max: high };
                let copy = Move { leg: LegPowers::of(Power::of(on)), a: WordRead(fresh), to };
                (Cell::Word(WordCell(fresh)), Op::Move(copy))
            }
            Cell::WordBit(_) => unreachable!("an input is a whole cell"),
        };
        let kind = op.kind();
        let first = code.tables.ops.push(op);
        code.tables.batches.push(Batch { kind, first, count: 1 });
        self.inputs.push(AnyValue { input: FreeInput { cell: fresh, low, high, cold }, at });
    }
}
