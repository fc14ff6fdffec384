//! The inputs that mattered in a scan, by what it executed.
//!
//! For `search`, where inputs are many. A [`ScanTrace`] sees a scan operation by operation and
//! notes which powers were OFF. Then it goes back from the end of the scan: needed are the cells of
//! the next state, the target and the assumed bits; operations that can write a needed cell need
//! what they have read; a cell that an operation overwrites is needed no more before it. Of a leg
//! or an AND that was OFF, one power that was OFF is enough. An instruction that does nothing while
//! its leg is OFF then needs the leg alone. Every control instruction that was reached needs its
//! leg, since it decides what executes.
//!
//! So with the same state and the same values of the needed inputs, every needed cell has the same
//! value at every moment: the same operations execute, and the scan ends in the same state. The
//! other inputs need no other values from this state.

use rungd_engine::isa::NumberMap;
use rungd_engine::ops::{AndedPowers, Op};
use rungd_engine::{BitCell, Image, ScanObserver, ScanStep};

use super::effects::{Effect, EffectCells, Effects};
use crate::model::ProofModel;

/// The greatest number of legs of an operation.
const LEGS: usize = 3;

/// What the operations of a cone need; its batches are of one operation each.
#[derive(Debug)]
pub(super) struct Needs {
    /// By batch.
    operations: Vec<OperationNeeds>,
    /// By step of a pass: what it reads.
    passes: Vec<Vec<u32>>,
    /// The place of each input, by the number of its cell.
    inputs: NumberMap<u32, usize>,
    /// The cells of a state, the target and the assumed bits.
    at_end: Vec<u32>,
    assumed: Vec<BitCell>,
    /// The number of cells.
    cells: usize,
}

#[derive(Debug)]
struct OperationNeeds {
    effect: Effect,
    is_control: bool,
}

impl Needs {
    /// Those of a cone, whose states have some cells.
    pub fn new(model: &ProofModel, at_end: Vec<u32>) -> Needs {
        let code = &model.code;
        let (effects, numbers) = (Effects::new(code), EffectCells { bits: code.bit_count });
        let needs = |op: Op| OperationNeeds {
            is_control: matches!(op, Op::Control(_)),
            effect: effects.effect(&op),
        };
        let (passes, batches) = (code.tables.terminations.iter(), code.tables.batches.iter());
        let inputs = model.inputs.iter().enumerate();
        Needs {
            operations: batches.flat_map(|batch| code.tables.ops_of(*batch)).map(needs).collect(),
            passes: passes.map(|step| effects.read_by_pass(step)).collect(),
            inputs: inputs.map(|(at, input)| (numbers.number(input.cell), at)).collect(),
            at_end,
            assumed: model.assumed.clone(),
            cells: (code.bit_count + code.word_count) as usize,
        }
    }
}

/// An executed step, and for each leg of an operation the powers that were OFF, as a mask.
#[derive(Clone, Copy, Debug)]
enum TracedStep {
    Operation { batch: u32, off: [u8; LEGS] },
    Pass(u32),
}

/// The steps of a scan.
#[derive(Debug)]
pub(super) struct ScanTrace<'n> {
    needs: &'n Needs,
    steps: Vec<TracedStep>,
    /// For each cell the number of the last walk that needs it.
    needed: Vec<u32>,
    walk: u32,
}

impl ScanObserver for ScanTrace<'_> {
    fn before(&mut self, step: ScanStep, image: &Image) {
        match step {
            ScanStep::Batch(batch) => {
                let legs = &self.needs.operations[batch as usize].effect.legs;
                let mut off = [0; LEGS];
                for (off, leg) in off.iter_mut().zip(legs) {
                    for (at, power) in leg.each().iter().enumerate() {
                        *off |= u8::from(!image.power(*power)) << at;
                    }
                }
                self.steps.push(TracedStep::Operation { batch, off });
            }
            ScanStep::Pass(step) => self.steps.push(TracedStep::Pass(step)),
            ScanStep::Turn(_) | ScanStep::Element(_) => {}
        }
    }

    fn after(&mut self, _: ScanStep, _: &Image) {}
}

impl<'n> ScanTrace<'n> {
    /// A trace before a scan.
    pub fn new(needs: &'n Needs) -> ScanTrace<'n> {
        ScanTrace { needs, steps: Vec::new(), needed: vec![0; needs.cells], walk: 0 }
    }

    /// Forgets the last scan.
    pub fn clear(&mut self) {
        self.steps.clear();
    }

    /// The inputs that mattered in the scan that has left this memory, as a set of their places.
    pub fn that_mattered(&mut self, image: &Image) -> u64 {
        self.walk += 1;
        let mut steps = std::mem::take(&mut self.steps);
        let refused = self.needs.assumed.iter().find(|bit| !image.bit(**bit));
        match refused {
            // Nothing behind the operation that has written the bit matters.
            Some(bit) => {
                let writer = steps.iter().rposition(|step| self.overwrites(*step, *bit));
                steps.truncate(writer.map_or(steps.len(), |at| at + 1));
                self.need(bit.0);
            }
            None => {
                let needs = self.needs;
                needs.at_end.iter().for_each(|cell| self.need(*cell));
            }
        }
        steps.iter().rev().for_each(|step| self.visit(*step));
        self.steps = steps;
        let needed = self.needs.inputs.iter().filter(|(cell, _)| self.needs_now(**cell));
        needed.fold(0, |set, (_, place)| set | 1 << place)
    }

    fn overwrites(&self, step: TracedStep, bit: BitCell) -> bool {
        let TracedStep::Operation { batch, .. } = step else { return false };
        self.needs.operations[batch as usize].effect.overwrites.contains(&bit.0)
    }

    fn need(&mut self, cell: u32) {
        self.needed[cell as usize] = self.walk;
    }

    fn needs_now(&self, cell: u32) -> bool {
        self.needed[cell as usize] == self.walk
    }

    /// Goes back over a step.
    fn visit(&mut self, step: TracedStep) {
        let needs = self.needs;
        let (batch, off) = match step {
            TracedStep::Operation { batch, off } => (batch, off),
            TracedStep::Pass(step) => {
                return needs.passes[step as usize].iter().for_each(|cell| self.need(*cell));
            }
        };
        let OperationNeeds { effect, is_control } = &needs.operations[batch as usize];
        if !is_control && !effect.writes.iter().any(|cell| self.needs_now(*cell)) {
            return;
        }
        for cell in &effect.overwrites {
            self.needed[*cell as usize] = 0;
        }
        for (leg, off) in effect.legs.iter().zip(off) {
            self.need_leg(leg, off);
        }
        if !(effect.rests_while_off && off[0] != 0) {
            effect.reads.iter().for_each(|cell| self.need(*cell));
        }
    }

    /// Needs what has made a leg ON or OFF: of the powers that were OFF, one that is needed anyway
    /// or no input, if there is such a one.
    fn need_leg(&mut self, leg: &AndedPowers, off: u8) {
        let cells = leg.each().iter().map(|power| power.cell());
        if off == 0 {
            return cells.for_each(|cell| self.need(cell));
        }
        let off = cells.enumerate().filter(|(at, _)| off >> at & 1 != 0).map(|(_, cell)| cell);
        let rank = |cell: &u32| {
            let is_input = self.needs.inputs.contains_key(cell);
            (!self.needs_now(*cell), is_input)
        };
        if let Some(cell) = off.min_by_key(rank) {
            self.need(cell);
        }
    }
}
