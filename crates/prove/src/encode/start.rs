//! What the first scan begins with, as the engine begins it.

use super::acc_forms::timer_of;
use super::held::OwnNumber;
use crate::model::{ProofModel, ProofStart};
use rungd_base::calendar::LocalTime;
use rungd_engine::isa::{BlockId, StageId};
use rungd_engine::ops::Timer;
use rungd_engine::record::timer_state::RUNNING;
use rungd_engine::record::{FLAGS, RECORD};
use rungd_engine::{
    BitCell, BlockCode, BlockRole, BlockState, Cell, Element, ElementCode, Engine, EngineProgram,
    EngineState, Image, ScanTimes, StageState,
};
use rustc_hash::FxHashSet;

/// What the first scan begins with.
pub(super) struct Start {
    /// Memory, with the status words of step 1.
    pub image: Image,
    /// An engine before the first scan.
    engine: Engine,
    /// The blocks whose first turn is due.
    pub first_turns: FxHashSet<BlockId>,
    /// A timer is timing from a cold start, because its state was restored.
    pub has_running_timer: bool,
    /// Whether scans came before it.
    pub is_given: bool,
    /// The time of the first scan since RUN began, ms.
    pub since_start_ms: u64,
    /// The memory of a process that finds nothing, if a process may end.
    fresh: Option<EngineState>,
    /// The time of the first scan, ms.
    first_ms: u64,
    period_ms: u64,
}

impl Start {
    pub fn of(model: &ProofModel) -> Start {
        let engine = model.begun();
        let mut scanned = model.begun();
        let blocks = (0..model.code.blocks.len() as u32).map(BlockId);
        let first_turns = blocks.filter(|block| engine.has_first_turn_due(*block)).collect();
        let first_ns = model.first_ns();
        scanned.begin_scan(first_ns, &ScanTimes::default(), &LocalTime::default());
        let image = scanned.image().clone();
        let (is_given, start_ns) = match &model.start {
            ProofStart::Cold(_) => (false, 0),
            ProofStart::Given(state) => (true, state.start_ns()),
        };
        Start {
            has_running_timer: !is_given && begins_running(&model.code, &image),
            since_start_ms: first_ns.saturating_sub(start_ns) / NS_PER_MS,
            fresh: (!model.events.kinds.is_empty()).then(|| model.fresh()),
            first_ms: first_ns / NS_PER_MS,
            period_ms: u64::from(model.period_ms().max(1)),
            image,
            engine,
            first_turns,
            is_given,
        }
    }

    /// The value of a cell in a process that finds nothing.
    pub fn fresh_value(&self, cell: Cell) -> i32 {
        self.fresh.as_ref().map_or_else(|| self.image.value(cell), |fresh| fresh.value(cell))
    }

    pub fn block(&self, block: BlockId) -> BlockState {
        self.engine.block_state(block)
    }

    pub fn stage(&self, stage: StageId) -> StageState {
        self.engine.stage_state(stage)
    }

    /// Whether a subroutine, by its index, was executed last in the turn of an element.
    pub fn is_caller(&self, subroutine: u32, element: Element) -> bool {
        let id = self.engine.program().subroutines[subroutine as usize];
        self.engine.caller(id) == Some(element)
    }

    /// A number of a block, Stage or subroutine.
    pub fn number(&self, number: OwnNumber) -> u64 {
        if !self.is_given {
            return 0;
        }
        match number {
            OwnNumber::Interval(task) => self.block(task).every_ns / NS_PER_MS,
            OwnNumber::Phase(task) => {
                let BlockState { enabled_ns, every_ns, .. } = self.block(task);
                let since_ns = self.engine.now_ns().saturating_sub(enabled_ns);
                since_ns.checked_rem(every_ns).unwrap_or(0) / NS_PER_MS
            }
            OwnNumber::Age(element) => self.age_ms(element) / self.period_ms,
        }
    }

    /// The time from the last execution of an element to the first scan, ms.
    fn age_ms(&self, element: Element) -> u64 {
        let executed_ms = match element {
            Element::Block(block) => self.block(block).executed_ms,
            Element::Stage(stage) => self.stage(stage).executed_ms,
        };
        self.first_ms.saturating_sub(executed_ms)
    }

    /// Why a given state has no gates; `None`: it has.
    pub fn obstacle(&self) -> Option<&'static str> {
        let program = self.engine.program();
        let blocks = (0..).map(BlockId).zip(&program.blocks);
        let counts_scans = |(id, block): &(BlockId, &BlockCode)| {
            let state = self.block(*id);
            let may_skip = block.role == BlockRole::Subroutine || state.recurrent;
            may_skip && state.executed && has_timer_on(program, &block.own, &self.image)
        };
        let between = |(id, _): (BlockId, &BlockCode)| {
            !self.age_ms(Element::Block(id)).is_multiple_of(self.period_ms)
        };
        match () {
            () if !self.is_given => None,
            () if self.engine.stops() => Some("the controller is about to stop"),
            () if self.engine.scans() == 0 => Some("no scan has come since RUN began"),
            () if blocks.filter(counts_scans).any(between) => {
                Some("the time since a timer's last scan is no whole number of periods")
            }
            () => None,
        }
    }
}

const NS_PER_MS: u64 = 1_000_000;

/// Whether a timer of an element is timing: it will add the time since the last execution, also
/// what a RETURN has withheld of it.
fn has_timer_on(program: &EngineProgram, element: &ElementCode, image: &Image) -> bool {
    let batches = element.batches.clone().map(|at| program.tables.batches[at as usize]);
    let mut timers = batches.flat_map(|batch| program.tables.ops_of(batch));
    timers.any(|op| timer_of(&op).is_some_and(|(timer, _)| is_running(image, timer)))
}

fn is_running(image: &Image, timer: Timer) -> bool {
    image.bit(BitCell(timer.at * RECORD as u32 + FLAGS as u32 + RUNNING))
}

/// Whether a timer is timing before the first scan.
fn begins_running(code: &EngineProgram, image: &Image) -> bool {
    let ops = &code.tables.ops;
    let simple = ops.tmr.iter().map(|op| op.timer).chain(ops.tmrdown.iter().map(|op| op.timer));
    let with_output = ops.ondtmr.iter().map(|op| op.timer);
    let with_output = with_output.chain(ops.offdtmr.iter().map(|op| op.timer));
    let adding = ops.tmra.iter().map(|op| op.timer).chain(ops.tmradown.iter().map(|op| op.timer));
    simple.chain(with_output).chain(adding).any(|timer| is_running(image, timer))
}
