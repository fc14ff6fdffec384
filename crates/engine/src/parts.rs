//! The parts of an engine's state, one by one: for a search over states, which stores only the
//! parts that later scans can read.
//!
//! Called by `rungd-prove` between two scans. It passes parts of states of the same program, and
//! for times what leads to the same future. Everything else takes whole states (`state`).

use super::events::Element;
use super::machine::{BlockState, StageState};
use super::scan::Engine;
use crate::isa::{BlockId, StageId};

/// All bits (each 0 or 1) and words, the program's own included.
#[derive(Debug)]
#[allow(missing_docs)]
pub struct MemoryCells<'e> {
    pub bits: &'e mut [u8],
    pub words: &'e mut [i32],
}

impl Engine {
    /// All cells, to be changed whether or not they are forced. A word stays within the range of
    /// its memory, and a constant keeps its value.
    pub fn cells_mut(&mut self) -> MemoryCells<'_> {
        let image = &mut self.machine.memory.image;
        MemoryCells { bits: &mut image.bits, words: &mut image.words }
    }

    /// The state of a block.
    pub fn block_state(&self, block: BlockId) -> BlockState {
        self.machine.blocks[block.0 as usize]
    }

    /// Replaces the state of a block. `.Running` and `.Done` are bits in memory.
    pub fn put_block_state(&mut self, block: BlockId, state: BlockState) {
        self.machine.blocks[block.0 as usize] = state;
    }

    /// The state of a Stage.
    pub fn stage_state(&self, stage: StageId) -> StageState {
        self.machine.stages[stage.0 as usize]
    }

    /// Replaces the state of a Stage, whose own bit is in memory.
    pub fn put_stage_state(&mut self, stage: StageId, state: StageState) {
        self.machine.stages[stage.0 as usize] = state;
    }

    /// Replaces the element that executed a subroutine last, by the subroutine's index in the
    /// program.
    pub fn put_caller(&mut self, subroutine: usize, caller: Option<Element>) {
        self.machine.callers[subroutine] = caller;
    }

    /// Scans since RUN began.
    pub fn scans(&self) -> u64 {
        self.scans
    }

    /// When RUN began, ns.
    pub fn start_ns(&self) -> u64 {
        self.start_ns
    }

    /// Sets the number of scans since RUN began, which was at 0 ns, and whether the next scan is
    /// the last one.
    pub fn resume_after(&mut self, scans: u64, stops: bool) {
        (self.start_ns, self.scans, self.last) = (0, scans, false);
        self.machine.stop_requested = stops;
    }
}
