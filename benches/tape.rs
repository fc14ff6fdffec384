//! Measures the tape of the scan log: the time that it adds to a scan on the scan thread.
//!
//! `cargo bench --bench tape` prints a table; `docs/speed.md` has the results. The same calls are
//! made with and without a tape in turns, scan by scan, and the medians are compared. All inputs of
//! the default memory are set at every scan; the number of inputs that change differs from row to
//! row.

use std::time::Instant;

use rungd_engine::isa::MemorySizes;
use rungd_engine::{Engine, EngineState, ScanTimes};
use rungd_language::lower::lower;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;
use rungd_runtime::{ScanStart, ScannedMachine, Taped, tape};

const SCANS: u64 = 20_000;
const PERIOD_NS: u64 = 10_000_000;

fn main() {
    println!("tape: µs a scan, p50 of {SCANS} scans each (p99, max)");
    println!("changes   without              with                 more, p50");
    for changes in [0, 10, 100, 1000] {
        compare(changes);
    }
    state();
}

fn program() -> rungd_engine::EngineProgram {
    let text = "[[program]]\nname = \"Main\"\nrung = [ { when = [\"X0\"], do = [\"OUT Y0\"] } ]\n";
    let file = SourceFile { name: "bench.toml".into(), text: text.into() };
    let options = LoadOptions { sizes: MemorySizes::default(), ..LoadOptions::default() };
    let (program, _) = load_ladders(&[file], &options);
    lower(&program.expect("it loads")).0
}

fn compare(changes: u32) {
    let inputs = MemorySizes::default().x;
    let mut bare = Taped::new(Engine::new(program()));
    let (mut taped, mut reader) = tape(Engine::new(program()));
    for machine in [&mut bare, &mut taped] {
        machine.start(0);
    }
    let (mut without, mut with) = (Vec::new(), Vec::new());
    for number in 0..SCANS {
        without.push(scan(&mut bare, number, inputs, changes));
        with.push(scan(&mut taped, number, inputs, changes));
        while let Some((_, state)) = reader.take() {
            if let Some(state) = state {
                reader.give_back(state);
            }
        }
    }
    let (a, b) = (spread(&mut without), spread(&mut with));
    let text = |[p50, p99, max]: [f64; 3]| format!("{p50:.2} ({p99:.2}, {max:.1})");
    println!("{changes:>7}   {:<20} {:<20} {:+.2}", text(a), text(b), b[0] - a[0]);
}

/// Makes one scan; returns the time from its first call to its end, ns.
fn scan(machine: &mut Taped, number: u64, inputs: u32, changes: u32) -> u64 {
    let now_ns = number * PERIOD_NS;
    let start = ScanStart { number, now_ns, times: ScanTimes::default(), local_s: 0 };
    let begin = Instant::now();
    machine.begin_scan(&start);
    for x in 0..inputs {
        machine.set_input(x, x < changes && number.is_multiple_of(2));
    }
    machine.execute();
    machine.settle();
    begin.elapsed().as_nanos() as u64
}

/// The median, the 99th percentile and the maximum, µs.
fn spread(times: &mut [u64]) -> [f64; 3] {
    times.sort_unstable();
    let at = |part: usize| times[(times.len() - 1) * part / 100] as f64 / 1000.0;
    [at(50), at(99), at(100)]
}

/// Measures the copy of a state, which the tape makes once per second.
fn state() {
    let engine = Engine::new(program());
    let mut times: Vec<u64> = (0..SCANS / 10)
        .map(|_| {
            let begin = Instant::now();
            std::hint::black_box(EngineState::of(&engine));
            begin.elapsed().as_nanos() as u64
        })
        .collect();
    let [p50, p99, max] = spread(&mut times);
    println!("a state allocated and copied: {p50:.1} µs (p99 {p99:.1}, max {max:.1})");
}
