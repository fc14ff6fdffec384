//! Measures the speed of the scan engine and of straight-line native Rust that does the same work.
//!
//! `cargo run --profile bench -p rungd-speed` checks that both give the same outputs, times them in turns and
//! prints a table; `-- --help` lists the options. `docs/speed.md` describes the workloads and has
//! the results; `benches/instructions.sh` counts instructions with `--side`.

#![allow(unsafe_code)]

mod ladder;
mod load;
mod math;
mod native;
mod rounds;
mod scanned;
mod straight;
mod word_bits;
mod workload;

use std::hint::black_box;

use clap::{Parser, ValueEnum};
use native::Native;
use rounds::Sides;
use rungd_language::lower::schedule::WINDOW;
use scanned::Scanned;
use word_bits::BitKind;
use workload::{Name, Workload};

/// The side to run alone.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Side {
    Native,
    Engine,
    /// Only the inputs and queued writes, on the engine's side.
    Outside,
    /// Only the inputs and queued writes, on the native side.
    NativeOutside,
    /// Only the ladder's text, once.
    Text,
    /// The text, and the load of it: to the engine before its first scan.
    Load,
}

/// The scan engine beside straight-line native Rust.
#[derive(Debug, Parser)]
struct Arguments {
    /// Only workloads with this text in their name.
    #[arg(default_value = "")]
    only: String,
    /// Only this size.
    #[arg(long)]
    n: Option<usize>,
    /// Rounds of each workload.
    #[arg(long, default_value_t = 501)]
    rounds: usize,
    /// Scans to check before timing; with --side, scans to run.
    #[arg(long, default_value_t = 3000)]
    scans: usize,
    /// Number of operations that are scheduled together; 1: file order.
    #[arg(long, default_value_t = WINDOW)]
    window: usize,
    /// Run one side for --scans scans, without a table (for instruction counts).
    #[arg(long)]
    side: Option<Side>,
    /// Print the ladder text, or the straight-line Rust, and stop.
    #[arg(long, value_name = "ladder|rust")]
    print: Option<String>,
    /// Time loading instead: from text to the first scan.
    #[arg(long)]
    load: bool,
    /// Run only rungs of plain bits, or of bits of words, for --scans scans (for instruction counts).
    #[arg(long)]
    bits: Option<BitKind>,
    /// Time MATH instead, beside the same expressions.
    #[arg(long)]
    math: bool,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    if arguments.load {
        return arguments.n.map_or_else(load::table, load::row);
    }
    if let Some(kind) = arguments.bits {
        return word_bits::run(kind, arguments.n.unwrap_or(1000), arguments.scans);
    }
    if arguments.math {
        return math::table(arguments.rounds);
    }
    if arguments.print.is_none() && arguments.side.is_none() {
        println!(
            "workload          n   native ns   engine ns   ratio   (quartiles)   coil changes"
        );
    }
    for name in Name::ALL {
        for n in name.sizes().iter().filter(|n| arguments.n.is_none_or(|only| only == **n)) {
            if name.text().contains(&arguments.only) {
                one(&arguments, &Workload::new(name, *n))?;
            }
        }
    }
    Ok(())
}

fn one(arguments: &Arguments, workload: &Workload) -> anyhow::Result<()> {
    match (arguments.print.as_deref(), arguments.side) {
        (Some("ladder"), _) => print!("{}", ladder::text(workload)),
        (Some(_), _) => print!("{}", straight::source(workload)),
        (None, Some(side)) => alone(workload, side, arguments)?,
        (None, None) => {
            let sides = || {
                let engine = Scanned::new(workload, arguments.window)?;
                anyhow::Ok(Sides { native: Native::new(workload)?, engine })
            };
            let changes = rounds::check(workload, sides()?, arguments.scans)?;
            let figures = rounds::measure(workload, sides()?, arguments.rounds);
            let [low, high] = figures.ratio_quartiles;
            println!(
                "{:10} {:8} {:11.2} {:11.2} {:7.2}   ({low:.2} {high:.2}) {changes:14}",
                workload.name.text(),
                workload.n,
                figures.native_ns,
                figures.engine_ns,
                figures.ratio,
            );
        }
    }
    Ok(())
}

fn alone(workload: &Workload, side: Side, arguments: &Arguments) -> anyhow::Result<()> {
    let text = || black_box(ladder::text(workload));
    let scene = workload.scene.iter().cycle().take(arguments.scans);
    match side {
        Side::Native | Side::NativeOutside => {
            let mut native = Native::new(workload)?;
            for outside in scene {
                native.outside(outside);
                if matches!(side, Side::Native) {
                    native.scan();
                }
            }
        }
        Side::Engine | Side::Outside => {
            let mut engine = Scanned::new(workload, arguments.window)?;
            for outside in scene {
                engine.outside(outside);
                if matches!(side, Side::Engine) {
                    engine.scan();
                }
            }
        }
        Side::Text => drop(text()),
        Side::Load => {
            Scanned::load(&text(), ladder::sizes(workload), workload.coils())?;
        }
    }
    Ok(())
}
