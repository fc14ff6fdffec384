//! A ladder in a random layout, formatted, runs as before: the trace is the same, byte for byte.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use rungd_config::load::ladder_files;
use rungd_lab::traces::stimulus::Stimulus;
use rungd_lab::traces::trace::{CsvTrace, TracedOperand};
use rungd_language::format::formatted;
use rungd_language::lower::lower;
use rungd_language::resolve::program::Program;

use rungd_test_support::bare_run::{Plan, run};
use rungd_test_support::mangled::{Chance, mangled};
use rungd_test_support::run::{cell, target};

const SCANS: u64 = 300;

/// A stimulus that changes the inputs X0 to X11 at random.
fn stimulus() -> String {
    let mut chance = Chance(1);
    let names: Vec<String> = (0..12).map(|n| format!("X{n}")).collect();
    let mut text = format!("scan,{}\n", names.join(","));
    for scan in (0..SCANS).step_by(7) {
        let cells: Vec<String> = names.iter().map(|_| chance.below(2).to_string()).collect();
        text.push_str(&format!("{scan},{}\n", cells.join(",")));
    }
    text
}

fn trace(program: &Program) -> String {
    let (engine_program, symbols) = lower(program);
    let stimulus = Stimulus::parse(&stimulus(), &|name| target(program, &symbols, name));
    let stimulus = stimulus.unwrap_or_else(|error| panic!("{}", error.message));
    let (period_ms, scans) = (50, SCANS);
    let plan = Plan { period_ms, scans, stop: true, clock_s: 0, stimulus };
    let operands = program.named(64);
    let watched = operands.iter().filter_map(|operand| {
        let cell = cell(program, &symbols, &operand.name()).ok()?;
        Some(TracedOperand::new(&operand.name(), cell, &symbols.layout))
    });
    let watched: Vec<TracedOperand> = watched.collect();
    let mut trace = CsvTrace::new(&watched, Vec::new()).expect("a Vec takes all");
    run(engine_program, &plan, &mut trace).expect("a Vec takes all");
    String::from_utf8(trace.finish().expect("a Vec takes all")).expect("CSV is text")
}

/// The program of a ladder, with the files of the library that its controller file names.
fn program(ladder: &Path, controller: &str) -> Program {
    let library = controller.split('"').filter(|text| text.starts_with("lib:"));
    let mut paths: Vec<PathBuf> = library.map(PathBuf::from).collect();
    paths.push(ladder.to_owned());
    let loaded = ladder_files(&paths).expect("readable");
    loaded.program.unwrap_or_else(|| panic!("{}: {:?}", ladder.display(), loaded.findings))
}

/// The columns of a trace, sorted, because the order of the operands in a trace is that of the
/// file.
fn columns(trace: &str) -> Vec<Vec<&str>> {
    let mut columns: Vec<Vec<&str>> = Vec::new();
    for line in trace.lines() {
        for (at, cell) in line.split(',').enumerate() {
            if columns.len() <= at {
                columns.push(Vec::new());
            }
            columns[at].push(cell);
        }
    }
    columns.sort_unstable();
    columns
}

#[test]
fn a_formatted_ladder_gives_the_trace_of_the_original() {
    let config = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("config");
    let mut ladders = 0;
    for entry in fs::read_dir(config.join("programs")).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name");
        let text = fs::read_to_string(&path).expect("readable");
        let controller = fs::read_to_string(config.join(name)).expect("readable");
        let before = trace(&program(&path, &controller));
        for seed in 1..=2 {
            let other = formatted(&mangled(&text, seed)).expect("it is TOML");
            assert_ne!(other, text, "nothing is different");
            let own = format!("formatted-{seed}-{}", name.display());
            let own = Path::new(env!("CARGO_TARGET_TMPDIR")).join(own);
            fs::write(&own, other).expect("written");
            let after = trace(&program(&own, &controller));
            assert_eq!(columns(&before), columns(&after), "{}, seed {seed}", path.display());
        }
        let rows: BTreeSet<&str> =
            before.lines().filter_map(|row| row.splitn(3, ',').nth(2)).collect();
        assert!(rows.len() > 10, "nothing moves in {}", path.display());
        ladders += 1;
    }
    assert!(ladders > 10, "{ladders} ladders");
}
