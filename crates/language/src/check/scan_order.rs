//! The order in which a scan executes rungs, and what may change between two places of it.
//!
//! Called by `runs_through`. A position counts the rungs and instructions of the Programs and
//! Tasks in the scan order; the built-in Tasks execute before or after all of them. Whether an
//! instruction's rung is ON is not considered: what it may write counts as changed. So does what a
//! termination pass may write, because a Stage's passes are among its instructions.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

use crate::resolve::program::{Block, Instruction, Program, ProgramPart, Rung};
use crate::resolve::writes::WrittenOperand;
use rungd_engine::isa::status::st;
pub use rungd_engine::isa::{
    Address, Bit, BitSpace, BlockId, Mnemonic, NumberMap, NumberRange, NumberRanges, Space,
    StageId, Structure, Word, WordSpace,
};

use super::context::{Context, ProgramInstruction, RungPlace};
use super::implied::Unchanged;

/// An instruction with its position.
#[derive(Clone, Copy)]
pub struct OrderedStep<'a> {
    pub placed: ProgramInstruction<'a>,
    /// Its own position.
    pub at: u32,
    /// The position at which its rung begins, and the position behind the rung.
    pub rung: (u32, u32),
}

/// All instructions in the order of execution, and the positions of their writes.
#[derive(Default)]
pub struct ScanOrder<'a> {
    pub steps: Vec<OrderedStep<'a>>,
    /// The positions of each block and Stage.
    blocks: HashMap<BlockId, Range<u32>>,
    stages: HashMap<StageId, Range<u32>>,
    /// The positions that write an address, start or stop a block, or name a structure.
    writes: NumberMap<Address, Vec<u32>>,
    block_moves: HashMap<BlockId, Vec<u32>>,
    structures: HashMap<Structure, Vec<u32>>,
    /// All arrays that anything writes.
    arrays: NumberRanges<Space>,
}

impl<'a> ScanOrder<'a> {
    pub fn of(context: &Context<'a>) -> ScanOrder<'a> {
        let program = context.program;
        let mut order = ScanOrder::default();
        for id in context.progress.during(&program.order) {
            let block = program.block(*id);
            let begin = order.next();
            order.part(program, ProgramPart { block, stage: None, rungs: &block.rungs });
            for stage in &block.stages {
                let begin = order.next();
                let part = ProgramPart { block, stage: Some(stage), rungs: &stage.rungs };
                order.part(program, part);
                order.stages.insert(stage.id, begin..order.next());
            }
            order.blocks.insert(*id, begin..order.next());
        }
        order
    }

    /// The next free position: behind the last rung.
    fn next(&self) -> u32 {
        self.steps.last().map_or(0, |step| step.rung.1)
    }

    fn part(&mut self, program: &'a Program, part: ProgramPart<'a>) {
        let ProgramPart { block, stage, rungs } = part;
        for (at, rung) in rungs.iter().enumerate() {
            let begin = self.next();
            let count = rung.instructions().count() as u32;
            for (n, (branch, instruction)) in (1..).zip(rung.instructions()) {
                let place = RungPlace { block, stage, rung, rung_number: at + 1, branch };
                let placed = ProgramInstruction { place, instruction };
                let step = OrderedStep { placed, at: begin + n, rung: (begin, begin + count + 1) };
                self.note(instruction, block, step.at);
                if let Some(subroutine) = instruction.called() {
                    self.note_call(program, subroutine, step.at);
                }
                self.steps.push(step);
            }
        }
    }

    fn note(&mut self, instruction: &Instruction, block: &Block, at: u32) {
        for written in instruction.writes() {
            match written.value {
                WrittenOperand::Bit(bit) => self.write(Address::Bit(bit).without_bit(), at),
                WrittenOperand::Word(word) => self.write(Address::Word(word), at),
                WrittenOperand::Array(array) => {
                    self.arrays.add(array.numbers(), 0);
                }
            }
        }
        if let Some(structure) = instruction.structure() {
            self.structures.entry(structure).or_default().push(at);
        }
        let exited = (instruction.mnemonic == Mnemonic::Exit).then_some(block.id);
        let target = instruction.target_block().map(|target| target.value);
        if let Some(block) = exited.or(target) {
            self.block_moves.entry(block).or_default().push(at);
        }
    }

    /// Notes what the instructions of a subroutine do, through its CALLs too, at the place of a
    /// CALL.
    fn note_call(&mut self, program: &'a Program, subroutine: BlockId, at: u32) {
        let (mut open, mut noted) = (vec![subroutine], BTreeSet::new());
        while let Some(id) = open.pop() {
            if !noted.insert(id) {
                continue;
            }
            let block = program.block(id);
            for (_, instruction) in block.rungs.iter().flat_map(Rung::instructions) {
                self.note(instruction, block, at);
                open.extend(instruction.called());
            }
        }
    }

    fn write(&mut self, address: Address, at: u32) {
        self.writes.entry(address).or_default().push(at);
    }

    /// The positions of a Stage.
    pub fn stage(&self, stage: StageId) -> Range<u32> {
        self.stages.get(&stage).cloned().unwrap_or_default()
    }

    /// The positions of a block.
    pub fn block(&self, block: BlockId) -> Range<u32> {
        self.blocks.get(&block).cloned().unwrap_or_default()
    }

    /// The instructions at these positions.
    pub fn steps(&self, positions: Range<u32>) -> &[OrderedStep<'a>] {
        let at = |position: u32| self.steps.partition_point(|step| step.at < position);
        &self.steps[at(positions.start)..at(positions.end).max(at(positions.start))]
    }

    /// The instructions at these positions that start or stop a block.
    pub fn moves_of(&self, block: BlockId, positions: &Range<u32>) -> &[u32] {
        let all = self.block_moves.get(&block).map_or(&[][..], Vec::as_slice);
        let at = |position: u32| all.partition_point(|move_at| *move_at < position);
        &all[at(positions.start)..at(positions.end).max(at(positions.start))]
    }
}

/// What executes between two conditions.
pub struct Between<'o, 'a> {
    pub order: &'o ScanOrder<'a>,
    pub positions: [Range<u32>; 2],
    /// The block in which both conditions are; `None`: they are in different blocks.
    pub block: Option<BlockId>,
}

impl Between<'_, '_> {
    fn none(&self, positions: Option<&Vec<u32>>) -> bool {
        let Some(positions) = positions else { return true };
        self.positions.iter().all(|range| {
            let first = positions.partition_point(|at| *at < range.start);
            positions.get(first).is_none_or(|at| *at >= range.end)
        })
    }

    fn is_unwritten(&self, address: Address) -> bool {
        let in_array =
            |(space, n)| self.order.arrays.first_in(NumberRange::one(space, n)).is_some();
        self.none(self.order.writes.get(&address)) && !Space::of(address).is_some_and(in_array)
    }

    fn is_at_rest(&self, structure: Structure) -> bool {
        self.none(self.order.structures.get(&structure))
    }

    fn is_elsewhere(&self, block: BlockId) -> bool {
        let moves = self.order.block_moves.get(&block);
        self.block.is_some_and(|here| here != block) && self.none(moves)
    }
}

impl Unchanged for Between<'_, '_> {
    fn bit(&self, bit: Bit) -> bool {
        match bit {
            Bit::Space(BitSpace::X, _) | Bit::Device(..) => true,
            // A MATH between may turn the others ON.
            Bit::Space(BitSpace::St, number) => number < st::DIVIDE_BY_ZERO,
            Bit::Space(..) => self.is_unwritten(Address::Bit(bit)),
            Bit::InWord(bit) => self.word(bit.word),
            Bit::Flag(structure, _) => self.is_at_rest(structure),
            Bit::Stage(_) => false,
            Bit::Running(block) | Bit::Done(block) => self.is_elsewhere(block),
        }
    }

    fn word(&self, word: Word) -> bool {
        let is_unwritten = self.is_unwritten(Address::Word(word));
        match word {
            Word::Space(WordSpace::Dst, _) => true,
            Word::Space(..) => is_unwritten,
            Word::Acc(structure) => is_unwritten && self.is_at_rest(structure),
            Word::Pre(number) => is_unwritten && self.is_at_rest(Structure::Sensaphone(number)),
        }
    }
}
