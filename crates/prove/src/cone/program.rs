//! The program of a cone: split into batches of one operation for the slice, and joined again.
//!
//! Called by `cone`. A joined program has the operations of the slice alone, and of the steps of
//! passes and of the turns only those that can affect them.

use std::ops::Range;

use rungd_engine::isa::{Bit, BlockId};
use rungd_engine::ops::OpKind;
use rungd_engine::{Batch, Cell, ElementCode, EngineProgram, Slice, Tables};

/// The same program with one operation in each batch.
pub(crate) fn split(code: &EngineProgram) -> EngineProgram {
    let mut split = code.clone();
    split.tables.batches.clear();
    let own = split.blocks.iter_mut().map(|block| &mut block.own);
    for element in own.chain(&mut split.stages) {
        let first = split.tables.batches.len() as u32;
        for at in element.batches.clone() {
            split_batch(code.tables.batches[at as usize], &mut split.tables);
        }
        element.batches = first..split.tables.batches.len() as u32;
    }
    split
}

fn split_batch(batch: Batch, tables: &mut Tables) {
    let in_columns = batch.kind == OpKind::Columns;
    if in_columns {
        lay_rows(batch, tables);
    }
    let kind = if in_columns { OpKind::Math } else { batch.kind };
    let places = batch.first..batch.first + batch.count;
    tables.batches.extend(places.map(|first| Batch { kind, first, count: 1 }));
}

/// Appends the steps of MATHs in columns again, one formula after the other. In columns, step 1 of
/// all formulas comes first, and all of them begin at the same place.
fn lay_rows(batch: Batch, tables: &mut Tables) {
    for number in 0..batch.count {
        let math = tables.ops.math[(batch.first + number) as usize];
        let first = tables.steps.len() as u32;
        for step in 0..math.count {
            let at = math.first + step * batch.count + number;
            tables.steps.push(tables.steps[at as usize]);
        }
        tables.ops.math[(batch.first + number) as usize].first = first;
    }
}

/// The program of a slice of a split program.
pub(super) fn joined(slice: Slice) -> EngineProgram {
    let is_kept = |block: &BlockId| {
        let running = slice.program.layout.bit(Bit::Running(*block));
        slice.knows(Cell::Bit(running))
    };
    let order = slice.program.order.iter().copied().filter(is_kept).collect();
    let mut code = EngineProgram { order, ..slice.program.clone() };
    (code.tables.batches, code.tables.terminations) = (Vec::new(), Vec::new());
    let own = code.blocks.iter_mut().map(|block| &mut block.own);
    for element in own.chain(&mut code.stages) {
        *element = ElementCode {
            batches: join(element.batches.clone(), &slice, &mut code.tables),
            terminations: keep(element.terminations.clone(), &slice, &mut code.tables),
            has_rungs: element.has_rungs,
        };
    }
    code
}

/// Joins batches whose operations are neighbours in the table of their kind. Control instructions
/// stay apart: behind a CALL, the next batch executes.
fn join(batches: Range<u32>, slice: &Slice, tables: &mut Tables) -> Range<u32> {
    let begin = tables.batches.len();
    for at in batches {
        let batch = slice.program.tables.batches[at as usize];
        match tables.batches[begin..].last_mut() {
            Some(last) if continues(last, batch) => last.count += batch.count,
            _ => tables.batches.push(batch),
        }
    }
    begin as u32..tables.batches.len() as u32
}

fn continues(last: &Batch, batch: Batch) -> bool {
    last.kind == batch.kind
        && last.first + last.count == batch.first
        && batch.kind != OpKind::Control
}

/// Keeps the steps of a pass that can affect the cone.
fn keep(steps: Range<u32>, slice: &Slice, tables: &mut Tables) -> Range<u32> {
    let begin = tables.terminations.len() as u32;
    for at in steps.filter(|at| slice.keeps_pass(*at)) {
        tables.terminations.push(slice.program.tables.terminations[at as usize].clone());
    }
    begin..tables.terminations.len() as u32
}
