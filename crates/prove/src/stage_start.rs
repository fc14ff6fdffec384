//! Retained Stages before the first scan: in which of them a Program goes on.
//!
//! `retained` makes it for `from = "retained"`. An image of retentive memory says of a Program that
//! it does not run, that it begins at its initial Stage, or that it goes on in some of its Stages,
//! perhaps in none. Each is chosen by private bits, which no operation reads: free inputs of the
//! first scan. `begin` gives the Program what they say, as the engine's start of RUN does, which
//! comes before: nothing of a ladder executes between the two. `encode` has gates for it.

use rungd_engine::isa::{Bit, BlockId, StageId};
use rungd_engine::{BitCell, BlockState, Cell, Engine, EngineProgram, ResumeBits};

/// A Program whose Stages are free before the first scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StageStart {
    /// The bits of its choice, which are private.
    pub chosen: ResumeBits,
    /// Whether it runs in any case, as Main does.
    pub runs: bool,
}

impl StageStart {
    /// The choice of a Program; `code` gets its bits.
    pub fn new(code: &mut EngineProgram, program: BlockId, runs: bool) -> StageStart {
        let (first, stages) = (code.bit_count, code.blocks[program.0 as usize].stages.len() as u32);
        code.bit_count += ResumeBits::bits(stages);
        StageStart { chosen: ResumeBits { program, first, stages }, runs }
    }

    /// The cell of the Program that knows a bit of its choice: its Stage, or that it runs.
    pub(crate) fn known_by(&self, code: &EngineProgram, bit: BitCell) -> Option<Cell> {
        let ResumeBits { program, first, stages } = self.chosen;
        let at = bit.0.checked_sub(first).filter(|at| *at < ResumeBits::bits(stages))?;
        let stage = at.checked_sub(ResumeBits::bits(0));
        let of_program = match stage {
            Some(n) => Bit::Stage(self.stage(code, n)),
            None => Bit::Running(program),
        };
        Some(Cell::Bit(code.layout.bit(of_program)))
    }

    /// The Program's n-th Stage.
    pub(crate) fn stage(&self, code: &EngineProgram, n: u32) -> StageId {
        StageId(code.blocks[self.chosen.program.0 as usize].stages.start + n)
    }

    /// Gives the Program what was chosen, on an engine whose first scan has begun.
    pub(crate) fn begin(&self, engine: &mut Engine) {
        let StageStart { chosen, runs } = *self;
        let is_on = |engine: &Engine, bit: BitCell| engine.image().bit(bit);
        let runs = runs || is_on(engine, chosen.running());
        let begins = runs && is_on(engine, chosen.begins());
        let bit = engine.program().layout.bit(Bit::Running(chosen.program));
        engine.restore(Cell::Bit(bit), runs.into());
        for n in 0..chosen.stages {
            let on = runs && !begins && is_on(engine, chosen.stage(n));
            let stage = self.stage(engine.program(), n);
            let bit = engine.program().layout.bit(Bit::Stage(stage));
            engine.restore(Cell::Bit(bit), on.into());
        }
        let state = engine.block_state(chosen.program);
        engine.put_block_state(chosen.program, BlockState { first_turn: begins, ..state });
    }
}
