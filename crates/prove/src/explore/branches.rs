//! The combinations of inputs that a state needs: those that differ in an input that matters.
//!
//! For `search`. An input that no element reads which executes in a scan does not matter in this
//! scan: with each of its values the same elements execute, and do the same. Which elements have
//! executed is known behind a scan. So a state begins with all inputs at rest. Behind each scan,
//! the inputs that have mattered and are not fixed yet become fixed, and get their other values,
//! the newest first. A Stage that is OFF costs no combinations that way.
//!
//! Inputs do not matter beyond their scan, because the next one begins with new values. In a scan
//! whose inputs are not allowed, only those matter that the assumptions read. How late a scan comes
//! matters like an input, where something measures time.

use rungd_engine::isa::{BlockId, NumberMap, StageId};
use rungd_engine::ops::Op;
use rungd_engine::{BitCell, Engine};

use super::effects::{EffectCells, Effects};
use super::live::{all_operations, executes_always, operations};
use crate::model::{Choice, FreeInput, ProofModel, Target};
use std::ops::Range;

/// A set of inputs, by their places in the model.
pub(super) type InputSet = u64;

/// The inputs, and the elements that read them.
#[derive(Debug)]
pub(super) struct Inputs {
    all: Vec<Input>,
    /// Those that can matter in every scan.
    always: InputSet,
    /// Those of the first scan alone.
    pub at_start: InputSet,
    /// The time since the scan before; empty if no scan comes late.
    pub late: InputSet,
    /// What happens behind the scan; empty if nothing may happen. It always matters.
    pub event: InputSet,
    /// The time without a process, if one follows; else it does not matter.
    pub down: InputSet,
    /// Those that can matter in a scan whose inputs are not allowed.
    refused: InputSet,
    blocks: Vec<(BlockId, InputSet)>,
    stages: Vec<(StageId, InputSet)>,
}

#[derive(Clone, Copy, Debug)]
struct Input {
    low: i32,
    high: i32,
    /// The value that it has while nothing changes it.
    resting: i32,
}

impl Input {
    fn of(choice: Choice) -> Input {
        Input { low: choice.low, high: choice.high, resting: choice.resting }
    }

    /// The number of its values.
    fn count(self) -> u64 {
        (i64::from(self.high) - i64::from(self.low) + 1).cast_unsigned()
    }

    /// The value behind another one: at rest first, then from the lowest on.
    fn next(self, value: i32) -> Option<i32> {
        let mut next =
            if value == self.resting { i64::from(self.low) } else { i64::from(value) + 1 };
        next += i64::from(next == i64::from(self.resting));
        i32::try_from(next).ok().filter(|next| *next <= self.high)
    }
}

/// The values of all inputs as a number: the first input is the lowest digit.
pub(super) type Packed = u64;

impl Inputs {
    /// The inputs of a cone; `None` if their values do not fit in a [`Packed`].
    pub fn new(model: &ProofModel, target: Target) -> Option<Inputs> {
        let all: Vec<Input> = model.choices().into_iter().map(Input::of).collect();
        let place = |at: Option<usize>| at.map_or(0, |at| 1 << at);
        let fits = all.len() <= InputSet::BITS as usize;
        let places = fits.then(|| [place(model.late_place()), place(model.event_place())]);
        let [late, event] = places?;
        let mut counts = all.iter().map(|input| input.count());
        counts.try_fold(1u64, u64::checked_mul)?;
        let readers = InputReaders::new(model)?;
        let code = &model.code;
        let blocks = (0..code.blocks.len() as u32).map(BlockId);
        let (always, blocks): (Vec<_>, Vec<_>) = blocks
            .map(|id| (id, readers.of_batches(code.blocks[id.0 as usize].own.batches.clone())))
            .filter(|(_, read)| *read != 0)
            .partition(|(id, _)| executes_always(code, *id));
        let stages = (0..code.stages.len() as u32).map(StageId);
        let stages = stages
            .map(|id| (id, readers.of_batches(code.stages[id.0 as usize].batches.clone())))
            .filter(|(_, read)| *read != 0);
        let always = always.iter().fold(readers.anywhere(target), |all, (_, read)| all | read);
        let at_start = model.inputs.iter().enumerate();
        let at_start = at_start.filter(|(_, input)| !input.is_of_every_scan());
        let at_start = at_start.fold(0, |set, (at, _)| set | 1 << at);
        Some(Inputs {
            all,
            always: always & !at_start | event,
            down: place(model.down_place()),
            late,
            event,
            at_start,
            refused: readers.of_assumptions() | event,
            blocks,
            stages: stages.collect(),
        })
    }
}

impl Inputs {
    /// The inputs that can have mattered in the scan of an engine.
    pub fn that_mattered(&self, engine: &Engine, is_allowed: bool) -> InputSet {
        if !is_allowed {
            return self.refused;
        }
        let now_ms = engine.now_ns() / 1_000_000;
        let blocks = self.blocks.iter();
        let blocks = blocks.filter(|(id, _)| engine.block_state(*id).executed_ms == now_ms);
        let stages = self.stages.iter();
        let stages = stages.filter(|(id, _)| engine.stage_state(*id).executed_ms == now_ms);
        let read = blocks.map(|(_, read)| read).chain(stages.map(|(_, read)| read));
        read.fold(self.always, |all, read| all | read)
    }

    /// The number of combinations of the inputs that can matter in every scan.
    pub fn usual(&self) -> u64 {
        let counts = self.all.iter().enumerate().filter(|(at, _)| self.always >> at & 1 != 0);
        counts.map(|(_, input)| input.count()).product()
    }

    fn pack(&self, values: &[i32]) -> Packed {
        let inputs = self.all.iter().zip(values).rev();
        inputs.fold(0, |packed, (input, value)| {
            let digit = i64::from(*value) - i64::from(input.low);
            packed * input.count() + digit.cast_unsigned()
        })
    }

    /// The values of all inputs.
    pub fn unpack(&self, mut packed: Packed) -> Vec<i32> {
        let value = |input: &Input| {
            let digit = packed % input.count();
            packed /= input.count();
            (i64::from(input.low) + digit.cast_signed()) as i32
        };
        self.all.iter().map(value).collect()
    }
}

/// The branches of one state after the other.
#[derive(Debug)]
pub(super) struct Branches<'i> {
    inputs: &'i Inputs,
    /// The values of the next scan.
    pub values: Vec<i32>,
    /// The fixed inputs, the newest last.
    fixed: Vec<usize>,
    is_fixed: InputSet,
}

impl<'i> Branches<'i> {
    /// The branches of the first state.
    pub fn new(inputs: &'i Inputs) -> Branches<'i> {
        let values = inputs.all.iter().map(|input| input.resting).collect();
        Branches { inputs, values, fixed: Vec::new(), is_fixed: 0 }
    }

    /// The values of the next scan as a number.
    pub fn packed(&self) -> Packed {
        self.inputs.pack(&self.values)
    }

    /// Goes on behind a scan with the values, in which some inputs mattered; returns whether the
    /// state needs another scan. If not, the values are those of the first scan of the next state.
    pub fn advance(&mut self, mattered: InputSet) -> bool {
        let mut new = mattered & !self.is_fixed;
        self.is_fixed |= new;
        while new != 0 {
            self.fixed.push(new.trailing_zeros() as usize);
            new &= new - 1;
        }
        while let Some(at) = self.fixed.last().copied() {
            let input = self.inputs.all[at];
            if let Some(next) = input.next(self.values[at]) {
                self.values[at] = next;
                return true;
            }
            self.values[at] = input.resting;
            self.is_fixed &= !(1 << at);
            self.fixed.pop();
        }
        false
    }
}

/// Finds the inputs among the cells that are read.
struct InputReaders<'p> {
    model: &'p ProofModel,
    effects: Effects<'p>,
    /// The place of each input, by the number of its cell.
    places: NumberMap<u32, usize>,
}

impl<'p> InputReaders<'p> {
    /// `None`: a set cannot hold so many inputs.
    fn new(model: &'p ProofModel) -> Option<InputReaders<'p>> {
        let numbers = EffectCells { bits: model.code.bit_count };
        let place = |(at, input): (usize, &FreeInput)| (numbers.number(input.cell), at);
        let places = model.inputs.iter().enumerate().map(place).collect();
        let fits = model.inputs.len() < InputSet::BITS as usize;
        fits.then(|| InputReaders { model, effects: Effects::new(&model.code), places })
    }

    fn of_cells(&self, cells: impl IntoIterator<Item = u32>) -> InputSet {
        let places = cells.into_iter().filter_map(|cell| self.places.get(&cell));
        places.fold(0, |set, place| set | 1 << place)
    }

    fn of_batches(&self, batches: Range<u32>) -> InputSet {
        let ops = operations(&self.model.code, batches);
        ops.fold(0, |set, op| set | self.of_cells(self.effects.effect(&op).all_reads()))
    }

    /// The inputs that are read outside of elements.
    fn anywhere(&self, target: Target) -> InputSet {
        let code = &self.model.code;
        let passes = code.tables.terminations.iter();
        let by_passes = passes.flat_map(|step| self.effects.read_by_pass(step));
        let at_end = self.model.assumed.iter().chain([&target.bit]).map(|bit| bit.0);
        let turns = (0..code.blocks.len() as u32).map(BlockId).flat_map(|id| {
            let written = code.written_by_turn(id);
            written.bits.into_iter().flat_map(|(first, count)| first..first + count)
        });
        self.of_cells(by_passes.chain(at_end).chain(turns))
    }

    /// The inputs that decide whether a scan is allowed: those that the first block reads, if it
    /// alone writes the assumed bits.
    fn of_assumptions(&self) -> InputSet {
        let code = &self.model.code;
        let writes =
            |op: &Op, bit: &BitCell| self.effects.touched(op).bits_written.contains(&bit.0);
        let first = code.order.first().filter(|id| executes_always(code, **id));
        let Some(BlockId(first)) = first else { return InputSet::MAX };
        let batches = code.blocks[*first as usize].own.batches.clone();
        let writers = |bit: &BitCell| all_operations(code).filter(|op| writes(op, bit)).count();
        let own = |bit: &BitCell| operations(code, batches.clone()).any(|op| writes(&op, bit));
        match self.model.assumed.iter().all(|bit| own(bit) && writers(bit) == 1) {
            true => self.of_batches(batches),
            false => InputSet::MAX,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_rests_first_and_then_has_each_other_value_once() {
        let values = |low, high| {
            let input = Input::of(Choice { low, high, resting: 0.clamp(low, high) });
            std::iter::successors(Some(input.resting), |value| input.next(*value))
                .collect::<Vec<_>>()
        };
        assert_eq!(values(0, 1), [0, 1]);
        assert_eq!(values(-2, 2), [0, -2, -1, 1, 2]);
        assert_eq!(values(3, 5), [3, 4, 5]);
        assert_eq!(values(-5, -4), [-4, -5]);
        assert_eq!(values(i32::MAX, i32::MAX), [i32::MAX]);
    }
}
