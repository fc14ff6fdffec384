//! The effects of control instructions on others than the execution, as in the engine's `blocks`.

use super::encoder::Encoder;
use super::held::{Elapsed, OwnNumber};
use super::number::Number;
use crate::aig::Literal;
use crate::gates::Held;
use rungd_engine::isa::{BlockId, ElementId, StageId};
use rungd_engine::ops::StageList;

impl Encoder<'_> {
    /// Adds the time since the last execution to what the timers behind have missed.
    pub(super) fn keep_time(&mut self, missed_ms: u32) {
        let missed = self.word(missed_ms);
        let elapsed = self.elapsed_ms();
        let missed = missed.add(&mut self.graph, &elapsed);
        let missed = missed.clamp(&mut self.graph, i32::MIN, i32::MAX);
        self.put_word(missed_ms, missed);
    }

    /// Gives the timers behind the time that they have missed.
    pub(super) fn give_time(&mut self, missed_ms: u32) {
        self.elapsed = Some(Elapsed::Ms(self.word(missed_ms)));
        self.put_word(missed_ms, Number::constant(0));
    }

    pub(super) fn rises(&mut self, history: u32, on: Literal) -> Literal {
        let before = self.bit(history);
        self.put_bit(history, on);
        self.graph.and(on, !before)
    }

    pub(super) fn enable_once(&mut self, task: BlockId) {
        let runs = self.running(task);
        self.under(!runs, |scan| {
            scan.put_own_if(Literal::TRUE, Held::Recurrent(task), Literal::FALSE);
            scan.mark_started(task);
        });
    }

    pub(super) fn enable_every(&mut self, task: BlockId, every: u32, pick: Option<u32>) {
        if let Some(pick) = pick {
            self.picked(pick);
        }
        if self.written.interval(task).is_none() {
            let every = self.word(every).clamp(&mut self.graph, 0, i32::MAX);
            self.put_own_number(OwnNumber::Interval(task), &every, i32::MAX.into());
        }
        self.put_own_if(Literal::TRUE, Held::Recurrent(task), Literal::TRUE);
        self.mark_started(task);
    }

    pub(super) fn listed(&self, list: StageList) -> &[StageId] {
        &self.code.tables.stage_lists[list.places()]
    }

    pub(super) fn jump(&mut self, targets: StageList, element: ElementId) {
        let Some(from) = element.stage else { return };
        self.put_own_if(Literal::TRUE, Held::StagePassDue(from), Literal::TRUE);
        let targets = self.listed(targets).to_vec();
        self.switch_stage(from, Literal::constant(targets.contains(&from)));
        for target in targets {
            self.switch_stage(target, Literal::TRUE);
        }
    }

    pub(super) fn converge(&mut self, from: StageList, to: StageId) {
        let from = self.listed(from).to_vec();
        let mut all = Literal::TRUE;
        for stage in &from {
            let on = self.stage_on(*stage);
            all = self.graph.and(all, on);
        }
        self.under(all, |scan| {
            from.iter().for_each(|stage| scan.leave_stage(*stage));
            scan.switch_stage(to, Literal::TRUE);
        });
    }
}
