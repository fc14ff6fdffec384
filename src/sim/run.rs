//! One simulation, from the cold start to the last row.

use std::io;

use super::stimulus::{Change, Stimulus};
use super::trace::{RowName, Trace};
use crate::engine::{self, BitCell, Engine, ScanTimes};

const NS_PER_MS: u64 = 1_000_000;

/// What is simulated.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The time between two scans, ms; at least 1.
    pub period_ms: u32,
    /// How many scans.
    pub scans: u64,
    /// Whether the last of them is the last scan of an orderly stop.
    pub stop: bool,
    /// Bits that are ON from the first scan on, until a stimulus writes them: devices are well.
    pub well: Vec<BitCell>,
    /// What comes from outside.
    pub stimulus: Stimulus,
}

impl Plan {
    /// Whether the time of the last scan can be counted, in nanoseconds of 64 bits.
    pub fn fits(&self) -> bool {
        let (scans, period_ns) =
            (self.scans.saturating_sub(1), u64::from(self.period_ms) * NS_PER_MS);
        scans.checked_mul(period_ns).is_some()
    }
}

/// Runs a program and hands every scan's end to the trace; an orderly stop (asked for, or by the
/// STOP instruction) adds the row `stop`.
///
/// # Errors
/// What the trace gives.
pub fn run(program: engine::Program, plan: &Plan, trace: &mut dyn Trace) -> io::Result<()> {
    let mut engine = Engine::new(program);
    let times = ScanTimes::default();
    let mut next_change = 0;
    engine.start(0);
    if !plan.fits() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "more scans than time can count"));
    }
    for scan in 0..plan.scans {
        let time_ms = scan * u64::from(plan.period_ms);
        if plan.stop && scan + 1 == plan.scans {
            engine.request_stop();
        }
        engine.begin_scan(time_ms * NS_PER_MS, &times);
        if scan == 0 {
            plan.well.iter().for_each(|cell| engine.write_bit(*cell, true));
        }
        for change in plan.stimulus.of_scan(scan, &mut next_change) {
            match change {
                Change::Input(n, on) => engine.set_input(n, on),
                Change::Bit(cell, on) => engine.write_bit(cell, on),
                Change::Word(cell, value) => engine.write_word(cell, value),
            }
        }
        let end = engine.execute();
        trace.row(RowName::Scan(scan), time_ms, engine.image())?;
        if end.last {
            engine.terminate();
            return trace.row(RowName::Stop, time_ms, engine.image());
        }
    }
    Ok(())
}
