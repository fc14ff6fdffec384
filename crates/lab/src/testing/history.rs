//! Notes the changes of some operands while a scenario is played.

use std::collections::VecDeque;
use std::sync::Arc;

use super::condition::Condition;
use super::judge::Judge;
use super::player::Spectator;
use crate::rig::{Rig, RigProgram};
use rungd_engine::Cell;

/// The maximum number of changes of an operand that are kept. The oldest changes are dropped first.
const CHANGES_MAX: usize = 12;

/// A change of an operand, or its first value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct OperandChange {
    /// The scan, from 1 in its process.
    pub scan: u64,
    /// Its time, ns.
    pub now_ns: u64,
    pub value: i32,
}

/// The last changes of the operands of a condition.
pub(super) struct OperandHistory<'a> {
    program: Arc<RigProgram>,
    condition: &'a Condition,
    /// The operands that decide the value of the condition at the last scan.
    pub deciding: Vec<Cell>,
    /// The last scan to note, counted over all processes.
    until: u64,
    changes: Vec<VecDeque<OperandChange>>,
}

impl<'a> OperandHistory<'a> {
    /// The history of a condition over a program's cells, up to a scan.
    pub fn new(
        program: Arc<RigProgram>,
        condition: &'a Condition,
        until: u64,
    ) -> OperandHistory<'a> {
        let changes = vec![VecDeque::new(); condition.operands.len()];
        OperandHistory { program, condition, deciding: Vec::new(), until, changes }
    }

    /// The changes of each cell, the newest last.
    pub fn changes(&self) -> &[VecDeque<OperandChange>] {
        &self.changes
    }
}

impl Spectator for OperandHistory<'_> {
    fn scanned(&mut self, rig: &Rig, judge: &Judge, scans: u64) {
        if scans > self.until || !Arc::ptr_eq(rig.program(), &self.program) {
            return;
        }
        let (scan, now_ns) = (rig.scans() + 1, rig.next_ns());
        if scans == self.until {
            self.deciding = self.condition.deciding(judge.image(rig));
        }
        let operands = self.condition.operands.iter();
        for ((_, cell), changes) in operands.zip(&mut self.changes) {
            let value = judge.image(rig).value(*cell);
            if changes.back().is_none_or(|last| last.value != value) {
                if changes.len() == CHANGES_MAX {
                    changes.pop_front();
                }
                changes.push_back(OperandChange { scan, now_ns, value });
            }
        }
    }

    fn begins(&mut self, _: &Rig) {
        self.changes.iter_mut().for_each(VecDeque::clear);
    }
}
