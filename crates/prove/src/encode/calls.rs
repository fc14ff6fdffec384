//! The elements that call each subroutine, themselves or through others.

use rungd_engine::isa::{BlockId, StageId};
use rungd_engine::ops::{ControlKind, Op};
use rungd_engine::{Element, ElementCode, EngineProgram};
use rustc_hash::FxHashMap;

/// By subroutine, by its index: the elements in whose turns it may be executed.
pub(super) fn callers(code: &EngineProgram) -> FxHashMap<u32, Vec<Element>> {
    let mut callers: FxHashMap<u32, Vec<Element>> = FxHashMap::default();
    let blocks = (0..).map(BlockId).zip(&code.blocks);
    let own = blocks.map(|(id, block)| (Element::Block(id), &block.own));
    let stages = (0..).map(StageId).zip(&code.stages);
    let stages = stages.map(|(id, stage)| (Element::Stage(id), stage));
    for (element, own) in own.chain(stages) {
        let mut open = called(code, own);
        while let Some(subroutine) = open.pop() {
            let callers = callers.entry(subroutine).or_default();
            if !callers.contains(&element) {
                callers.push(element);
                let id = code.subroutines[subroutine as usize];
                open.extend(called(code, &code.blocks[id.0 as usize].own));
            }
        }
    }
    callers
}

/// The subroutines that an element calls itself.
fn called(code: &EngineProgram, own: &ElementCode) -> Vec<u32> {
    let batches = own.batches.clone().map(|at| code.tables.batches[at as usize]);
    let ops = batches.flat_map(|batch| code.tables.ops_of(batch));
    let subroutine = |op| {
        if let Op::Control(control) = op
            && let ControlKind::Call(subroutine) = control.kind
        {
            return Some(subroutine);
        }
        None
    };
    ops.filter_map(subroutine).collect()
}
