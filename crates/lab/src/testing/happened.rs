//! The scans of a recording, on a grid of virtual time.
//!
//! A test runs in virtual time, with one scan in each period. Each recorded scan gets the place on
//! that grid that is nearest to its time. If the recording skipped scans, the test runs additional
//! scans.

use rungd_engine::{Cell, Engine, EngineCall};
use rungd_runtime::TapeSection;

/// The maximum number of additional scans between the recorded scans: almost three hours at 10 ms.
/// After that number, each recorded scan follows the one before directly, so that no recorded time
/// makes a test endless.
const IDLE_MAX: u64 = 1_000_000;

/// A recorded scan.
#[derive(Clone, Debug, Default)]
pub(super) struct HappenedScan {
    /// Its place in virtual time: the number of scans since the first scan.
    pub at: u64,
    /// The calls before it: inputs, queued writes, forces.
    pub calls: Vec<EngineCall>,
    /// Whether an orderly stop was requested before it, so that it is the last scan of its RUN.
    pub is_last: bool,
    /// Whether RUN begins with it, and it is not the first scan.
    pub begins_run: bool,
    /// The values of the watched cells at its end, before any passes.
    pub values: Vec<i32>,
}

/// Executes sections from their first state on, and notes the watched cells at the end of each
/// scan.
pub(super) fn happened(
    mut engine: Engine,
    sections: &[TapeSection],
    period_ns: u64,
    watched: &[Cell],
) -> Vec<HappenedScan> {
    let mut scans: Vec<HappenedScan> = Vec::new();
    let mut next = HappenedScan::default();
    let (mut first_ns, mut idle, mut begun) = (None, 0, false);
    let entries = sections.iter().flat_map(|section| &section.entries);
    for call in entries.filter_map(|entry| entry.call()) {
        engine.apply(call);
        match call {
            EngineCall::Start { .. } => next.begins_run = !scans.is_empty(),
            EngineCall::RequestStop => next.is_last = true,
            EngineCall::Begin { now_ns, .. } => {
                let since_ns = now_ns.saturating_sub(*first_ns.get_or_insert(now_ns));
                let place = since_ns.saturating_add(period_ns / 2) / period_ns;
                next.at = scans.last().map_or(0, |last| {
                    let follows = last.at + 1;
                    let between = place.saturating_sub(follows).min(IDLE_MAX - idle);
                    idle += between;
                    follows + between
                });
                begun = true;
            }
            EngineCall::Write(..) | EngineCall::Force(..) | EngineCall::Release(_) => {
                next.calls.push(call);
            }
            // The start of this scan was not recorded.
            EngineCall::Execute if !begun => {}
            EngineCall::Execute => {
                begun = false;
                next.values = watched.iter().map(|cell| engine.image().value(*cell)).collect();
                scans.push(std::mem::take(&mut next));
            }
            EngineCall::Terminate => {}
        }
    }
    scans
}
