//! What the first scan begins with, as the engine begins it.

use crate::model::ProofModel;
use rungd_base::calendar::LocalTime;
use rungd_engine::isa::BlockId;
use rungd_engine::ops::Timer;
use rungd_engine::record::timer_state::RUNNING;
use rungd_engine::record::{FLAGS, RECORD};
use rungd_engine::{BitCell, EngineProgram, Image, ScanTimes};
use rustc_hash::FxHashSet;

/// What the first scan begins with.
pub(super) struct Start {
    /// Memory, with the status words of step 1.
    pub image: Image,
    /// The blocks whose first turn is due.
    pub first_turns: FxHashSet<BlockId>,
    /// A timer is timing, because its state was restored.
    pub has_running_timer: bool,
}

impl Start {
    pub fn of(model: &ProofModel) -> Start {
        let mut engine = model.begun();
        let blocks = (0..model.code.blocks.len() as u32).map(BlockId);
        let first_turns = blocks.filter(|block| engine.has_first_turn_due(*block)).collect();
        engine.begin_scan(0, &ScanTimes::default(), &LocalTime::default());
        let image = engine.image().clone();
        let has_running_timer = begins_running(&model.code, &image);
        Start { image, first_turns, has_running_timer }
    }
}

/// Whether a timer is timing before the first scan.
fn begins_running(code: &EngineProgram, image: &Image) -> bool {
    let ops = &code.tables.ops;
    let simple = ops.tmr.iter().map(|op| op.timer).chain(ops.tmrdown.iter().map(|op| op.timer));
    let with_output = ops.ondtmr.iter().map(|op| op.timer);
    let with_output = with_output.chain(ops.offdtmr.iter().map(|op| op.timer));
    let adding = ops.tmra.iter().map(|op| op.timer).chain(ops.tmradown.iter().map(|op| op.timer));
    let running = |timer: Timer| BitCell(timer.at * RECORD as u32 + FLAGS as u32 + RUNNING);
    simple.chain(with_output).chain(adding).any(|timer| image.bit(running(timer)))
}
