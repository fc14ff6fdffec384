//! How long a ladder takes from its text to the first scan, and how much memory it then holds.

use std::time::Instant;

use anyhow::Context;

use super::ladder;
use super::scanned::Scanned;
use super::workload::{Name, Workload};

/// How often each size is loaded.
const LOADS: usize = 5;

pub fn table() -> anyhow::Result<()> {
    println!("rungs     text to first scan, ms   resident memory, bytes a rung");
    for n in [1000, 10_000, 100_000] {
        let workload = Workload::new(Name::Shuffled, n);
        let (text, sizes) = (ladder::text(&workload), ladder::sizes(&workload));
        let mut times = Vec::new();
        for _ in 0..LOADS {
            let start = Instant::now();
            let mut engine = Scanned::load(&text, sizes.clone(), n)?;
            engine.scan();
            times.push(start.elapsed());
        }
        times.sort();
        let before = resident_bytes()?;
        let mut engine = Scanned::load(&text, sizes, n)?;
        engine.scan();
        let held = resident_bytes()?.saturating_sub(before) / n;
        println!("{n:8} {:20.1} {held:20}", times[LOADS / 2].as_secs_f64() * 1e3);
    }
    Ok(())
}

fn resident_bytes() -> anyhow::Result<usize> {
    let status = std::fs::read_to_string("/proc/self/statm").context("cannot read memory use")?;
    let pages: usize = status.split(' ').nth(1).context("no resident size")?.parse()?;
    Ok(pages * 4096)
}
