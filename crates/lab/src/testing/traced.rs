//! The trace of a scenario: a row for each scan.

use std::io;
use std::sync::Arc;

use super::judge::Judge;
use super::lowered_suite::LoweredSuite;
use super::player::{Spectator, play};
use super::suite::{ProgramId, Suite};
use crate::rig::{Rig, RigProgram};
use rungd_engine::Image;

/// The end of a scan.
#[derive(Clone, Copy, Debug)]
pub struct TracedScan<'a> {
    /// The program that has been executed: after a `reload` step another one.
    pub program: ProgramId,
    /// Its number: from 1, as in a failure, but a restart does not reset the count.
    pub number: u64,
    /// Its time, µs.
    pub time_us: u64,
    /// Memory at its end.
    pub image: &'a Image,
    /// Memory at its end as conditions see it, if the test file has an observer or a `was(x)`.
    pub observed: Option<&'a Image>,
}

/// Passes rows to a trace.
struct Tracer<'a> {
    row: &'a mut dyn FnMut(TracedScan<'_>) -> io::Result<()>,
    programs: &'a [Arc<RigProgram>],
    failed: Option<io::Error>,
}

impl Spectator for Tracer<'_> {
    fn scanned(&mut self, rig: &Rig, judge: &Judge, number: u64) {
        let mut programs = self.programs.iter();
        let program = programs.position(|program| Arc::ptr_eq(program, rig.program()));
        let Some(program) = program.filter(|_| self.failed.is_none()) else { return };
        let (program, time_us, image) = (ProgramId(program), rig.next_ns() / 1000, rig.image());
        let observed = judge.view().map(|_| judge.image(rig));
        self.failed = (self.row)(TracedScan { program, number, time_us, image, observed }).err();
    }
}

/// Plays a scenario, by its index in the suite, and passes each scan to a trace.
///
/// # Errors
/// The error of writing the trace.
pub fn trace(
    suite: &Suite,
    programs: &[Arc<RigProgram>],
    scenario: usize,
    row: &mut dyn FnMut(TracedScan<'_>) -> io::Result<()>,
) -> io::Result<()> {
    let stage = LoweredSuite { suite, programs, given_up: None };
    let mut tracer = Tracer { row, programs, failed: None };
    play(stage, &suite.scenarios[scenario], false, &mut tracer);
    tracer.failed.map_or(Ok(()), Err)
}
