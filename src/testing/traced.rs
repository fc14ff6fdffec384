//! The trace of a scenario: a row for each scan.

use std::io;
use std::sync::Arc;

use super::player::{LoweredSuite, Spectator, play};
use super::suite::Suite;
use crate::rig::{Rig, RigProgram};
use crate::sim::trace::{RowName, Trace};

/// Passes rows to a trace.
struct Tracer<'a> {
    trace: &'a mut dyn Trace,
    program: &'a Arc<RigProgram>,
    failed: Option<io::Error>,
}

impl Spectator for Tracer<'_> {
    fn scanned(&mut self, rig: &Rig, scans: u64) {
        // After a reload the cells may differ.
        if self.failed.is_none() && Arc::ptr_eq(rig.program(), self.program) {
            let row = self.trace.row(RowName::Scan(scans), rig.next_ns() / 1000, rig.image());
            self.failed = row.err();
        }
    }
}

/// Plays a scenario, by its index in the suite, and passes each scan to a trace, until a `reload`
/// step. Scans are counted from 1, as in a failure, but a restart does not reset the count.
///
/// # Errors
/// The error of writing the trace.
pub fn trace(
    suite: &Suite,
    programs: &[Arc<RigProgram>],
    scenario: usize,
    trace: &mut dyn Trace,
) -> io::Result<()> {
    let stage = LoweredSuite { suite, programs };
    let mut tracer = Tracer { trace, program: &programs[0], failed: None };
    play(stage, &suite.scenarios[scenario], false, &mut tracer);
    tracer.failed.map_or(Ok(()), Err)
}
