//! Measures the swap of two programs of 1,000 rungs: the time that a reload adds to a scan.
//!
//! `cargo bench --bench reload` makes a new engine for every swap, as a reload does, and prints the
//! times of [`Engine::adopt`] between two scans. `-- N` sets the number of rungs. A third of the
//! rungs is edited, a third is moved, some are removed and some added. `docs/reload.md` has a
//! result.

use std::fmt::Write as _;
use std::time::Instant;

use rungd_base::calendar::LocalTime;
use rungd_engine::{Engine, ScanTimes};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;
use rungd_state::reload::{LoweredProgram, ReloadPlan};

const SWAPS: usize = 1000;

fn main() {
    let rungs = std::env::args().skip(1).find_map(|text| text.parse().ok()).unwrap_or(1000);
    println!("rungs    swaps   p50 us   p99 us   max us   first scan p50 us");
    row("same", rungs, |_| Some(0));
    row("other", rungs, |n| match n % 10 {
        0 => None,
        1..4 => Some(7),
        _ => Some(0),
    });
}

fn row(name: &str, rungs: usize, edit: impl Fn(usize) -> Option<usize>) {
    let old = program(rungs, |_| Some(0));
    let new = program(rungs, edit);
    let plan = ReloadPlan::new(
        LoweredProgram { program: &old.0, symbols: &old.1 },
        LoweredProgram { program: &new.0, symbols: &new.1 },
    );
    let (mut swaps, mut scans) = (Vec::new(), Vec::new());
    let mut now_ns = 0;
    let mut scan = |engine: &mut Engine| {
        now_ns += 1_000_000;
        engine.begin_scan(now_ns, &ScanTimes::default(), &LocalTime::default());
        for x in 0..256 {
            engine.set_input(x, (now_ns / 1_000_000 + u64::from(x)) % 3 == 0);
        }
        engine.execute();
    };
    for _ in 0..SWAPS {
        let mut before = Engine::new(old.0.clone());
        before.start(0);
        (0..5).for_each(|_| scan(&mut before));
        let mut after = Engine::new(new.0.clone());
        after.touch();
        // The old program runs while the new one is prepared.
        (0..3).for_each(|_| scan(&mut before));
        let begin = Instant::now();
        after.adopt(&mut before, &plan.transfer, true, &[]);
        swaps.push(begin.elapsed().as_nanos() as u64);
        let begin = Instant::now();
        scan(&mut after);
        scans.push(begin.elapsed().as_nanos() as u64);
    }
    swaps.sort_unstable();
    scans.sort_unstable();
    let us = |ns: u64| ns as f64 / 1000.0;
    println!(
        "{rungs} {name:<6} {SWAPS:>4} {:>8.1} {:>8.1} {:>8.1} {:>12.1}",
        us(swaps[SWAPS / 2]),
        us(swaps[SWAPS * 99 / 100]),
        us(swaps[SWAPS - 1]),
        us(scans[SWAPS / 2]),
    );
}

/// A program of counters, timers and edges in turn, 250 each of 1,000. `edit` returns the change of
/// a rung's preset, or `None` if the rung is left out.
fn program(
    rungs: usize,
    edit: impl Fn(usize) -> Option<usize>,
) -> (rungd_engine::EngineProgram, Symbols) {
    let mut text = String::from("[[program]]\nname = \"Main\"\nrung = [\n");
    for n in 0..rungs {
        let Some(more) = edit(n) else { continue };
        let (at, x, preset) = (n / 4, n % 256, 3 + n % 9 + more);
        let _ = match n % 4 {
            0 => writeln!(
                text,
                "{{ leg.up = [\"X{x}\"], leg.rst = [\"C1\"], do = [\"CNT CT{at} preset={preset}\"] }},"
            ),
            1 => writeln!(
                text,
                "{{ when = [\"X{x}\", \"!C2\"], do = [\"ONDTMR T{at} preset={preset}ms output=Y{at}\"] }},"
            ),
            2 => writeln!(text, "{{ when = [\"rise(X{x})\"], do = [\"PONOFF C{}\"] }},", at + 100),
            _ => writeln!(
                text,
                "{{ when = [\"X{x}\", \"fall(X3)\"], do = [\"OUT Y{}\"] }},",
                at + 1000
            ),
        };
    }
    text += "]\n";
    let sizes = rungd_engine::isa::MemorySizes {
        ct: rungs as u32,
        t: rungs as u32,
        c: 2 * rungs as u32 + 2048,
        y: rungs as u32 + 2048,
        ..Default::default()
    };
    let file = SourceFile { name: "bench.toml".into(), text };
    let (program, findings) = load_ladders(&[file], &LoadOptions { sizes, ..Default::default() });
    lower(&program.unwrap_or_else(|| panic!("{findings:#?}")))
}
