//! Measures the time and memory from a ladder's text to its first scan.

use std::process::Command;
use std::time::Instant;

use anyhow::{Context, ensure};

use super::ladder;
use super::scanned::Scanned;
use super::workload::{Name, Workload};

/// Number of loads of each size.
const LOADS: usize = 9;

/// Runs a process for each size, so that each size has its own memory figures.
pub fn table() -> anyhow::Result<()> {
    println!("   rungs   text to first scan, ms   most memory resident, MB");
    for n in [1000, 10_000, 100_000] {
        let program = std::env::current_exe()?;
        let status = Command::new(program).args(["--load", "--n", &n.to_string()]).status()?;
        ensure!(status.success(), "loading {n} rungs failed");
    }
    Ok(())
}

pub fn row(n: usize) -> anyhow::Result<()> {
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
    let most = most_resident_kb()? as f64 / 1e3;
    println!("{n:8} {:24.1} {most:26.1}", times[LOADS / 2].as_secs_f64() * 1e3);
    Ok(())
}

fn most_resident_kb() -> anyhow::Result<usize> {
    let status = std::fs::read_to_string("/proc/self/status").context("cannot read memory use")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next());
    Ok(kilobytes.context("no peak of memory use")?.parse()?)
}
