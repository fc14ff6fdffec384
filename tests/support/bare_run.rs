//! Runs an engine program alone, from the cold start to the last row: without the rig, with which
//! `rungd sim` runs it.

use std::io;

use rungd_base::calendar::LocalTime;
use rungd_engine::{self as engine, Engine, EngineCall, ScanTimes};
use rungd_lab::traces::stimulus::{Stimulus, StimulusChange};
use rungd_lab::traces::trace::{RowName, Trace};

const NS_PER_MS: u64 = 1_000_000;
const US_PER_MS: u64 = 1000;
const MS_PER_S: u64 = 1000;

/// The parameters of a simulation.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The time between two scans, ms; at least 1.
    pub period_ms: u32,
    /// The number of scans.
    pub scans: u64,
    /// Whether the simulation ends with an orderly stop; its last scan is then the last of `scans`.
    pub stop: bool,
    /// The local time of the first scan, as seconds since 1970-01-01 00:00:00 of the local clock.
    pub clock_s: i64,
    /// The inputs and queued writes.
    pub stimulus: Stimulus,
}

/// Runs a program and passes the memory at the end of every scan to the trace. An orderly stop (by
/// the plan or the STOP instruction) adds the row `stop`.
///
/// # Errors
/// The error of the trace.
pub fn run(program: engine::EngineProgram, plan: &Plan, trace: &mut dyn Trace) -> io::Result<()> {
    let mut engine = Engine::new(program);
    let times = ScanTimes::default();
    let mut next_change = 0;
    engine.start(0);
    for scan in 0..plan.scans {
        let time_ms = scan * u64::from(plan.period_ms);
        if plan.stop && scan + 1 == plan.scans {
            engine.request_stop();
        }
        let local = LocalTime::of(plan.clock_s.saturating_add((time_ms / MS_PER_S) as i64));
        engine.begin_scan(time_ms * NS_PER_MS, &times, &local);
        for change in plan.stimulus.of_scan(scan, &mut next_change) {
            match change {
                StimulusChange::Input(n, on) => engine.set_input(n, on),
                StimulusChange::Bit(cell, on) => engine.apply(EngineCall::Write(cell, on.into())),
                StimulusChange::Word(cell, value) => engine.write_word(cell, value),
            }
        }
        let end = engine.execute();
        trace.row(RowName::Scan(scan), time_ms * US_PER_MS, engine.image())?;
        if end.last {
            engine.terminate();
            return trace.row(RowName::Stop, time_ms * US_PER_MS, engine.image());
        }
    }
    Ok(())
}
