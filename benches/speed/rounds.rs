//! Times the native side and the engine in turns, so that disturbances affect both alike.
//!
//! Only scans count: the time to write inputs and queued writes is measured separately and
//! subtracted. (Reading the clock around each scan would cost as much as a scan of a hundred native
//! rungs.) The clock is the thread's processor time, so that other processes disturb only the
//! caches.

use super::native::{Native, thread_time_s};
use super::scanned::Scanned;
use super::workload::{Outside, Workload};

/// Both sides of one workload, just started.
pub struct Sides {
    pub native: Native,
    pub engine: Scanned,
}

/// The results of one workload: medians over the rounds.
pub struct Figures {
    pub native_ns: f64,
    pub engine_ns: f64,
    pub ratio: f64,
    /// The quartiles of the rounds' ratios.
    pub ratio_quartiles: [f64; 2],
}

/// Runs both sides and compares all coils after every scan; returns the number of changes of coils.
pub fn check(workload: &Workload, sides: Sides, scans: usize) -> anyhow::Result<usize> {
    let Sides { mut native, mut engine } = sides;
    let mut before = native.coils().to_vec();
    let mut changes = 0;
    for (scan, outside) in workload.scene.iter().cycle().take(scans).enumerate() {
        native.outside(outside);
        engine.outside(outside);
        native.scan();
        engine.scan();
        let (native, engine) = (native.coils(), engine.coils());
        if let Some(coil) = (0..native.len()).find(|at| native[*at] != engine[*at]) {
            anyhow::bail!("scan {scan}: C{coil} differs (engine {})", engine[coil]);
        }
        changes += before.iter().zip(native).filter(|(a, b)| a != b).count();
        before.copy_from_slice(native);
    }
    Ok(changes)
}

pub fn measure(workload: &Workload, sides: Sides, rounds: usize) -> Figures {
    let Sides { mut native, mut engine } = sides;
    let rungs = workload.rungs_per_scan();
    // A native round takes a fraction of a millisecond: shorter than a time slice.
    let scans = (200_000 / rungs).clamp(8, 2_000);
    let per_rung = |seconds: f64| seconds * 1e9 / (scans * rungs) as f64;
    let mut scene = workload.scene.iter().cycle();
    let mut both = Vec::with_capacity(rounds);
    for _ in 0..rounds + 2 {
        let outsides: Vec<&Outside> = scene.by_ref().take(scans).collect();
        let native_s = scans_alone(&outsides, &mut native, Native::outside, Native::scan);
        let engine_s = scans_alone(&outsides, &mut engine, Scanned::outside, Scanned::scan);
        both.push((per_rung(native_s), per_rung(engine_s)));
    }
    // The first two rounds warm the caches.
    let both = &both[2..];
    let ratios = sorted(both.iter().map(|(native, engine)| engine / native));
    Figures {
        native_ns: middle(&sorted(both.iter().map(|b| b.0))),
        engine_ns: middle(&sorted(both.iter().map(|b| b.1))),
        ratio: middle(&ratios),
        ratio_quartiles: [ratios[ratios.len() / 4], ratios[ratios.len() * 3 / 4]],
    }
}

/// Seconds for the scans alone: scans with inputs and queued writes, minus the inputs and queued
/// writes.
fn scans_alone<S>(
    outsides: &[&Outside],
    side: &mut S,
    outside: impl Fn(&mut S, &Outside),
    scan: impl Fn(&mut S),
) -> f64 {
    let start_s = thread_time_s();
    for from_outside in outsides {
        outside(side, from_outside);
        scan(side);
    }
    let between_s = thread_time_s();
    for from_outside in outsides {
        outside(side, from_outside);
    }
    (between_s - start_s) - (thread_time_s() - between_s)
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<_> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

fn middle(sorted: &[f64]) -> f64 {
    sorted[sorted.len() / 2]
}
