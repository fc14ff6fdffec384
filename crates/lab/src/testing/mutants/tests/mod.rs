//! The mutants of small ladders as lists, and the mutants of the shipped ladders.
//!
//! Each mutant is tried: it differs from its ladder and from every other mutant, and it runs.

mod blocks;
mod contacts;
mod instructions;
mod shipped;
mod templates;

use std::collections::HashMap;
use std::fmt::Write as _;
use std::hash::{DefaultHasher, Hash, Hasher};

use expect_test::Expect;

use super::{Mutant, mutants};
use rungd_base::calendar::LocalTime;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::{Address, Bit, BitSpace, Word, WordSpace};
use rungd_engine::{self as engine, Cell, Engine, EngineCall, ScanTimes};
use rungd_language::lower::lower;
use rungd_language::resolve::program::Program;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;

const PERIOD: ScanPeriod = ScanPeriod::of_ms(10);

fn load(files: &[(&str, &str)]) -> (Program, Vec<SourceFile>) {
    let file = |(name, text): &(&str, &str)| SourceFile {
        name: (*name).to_owned(),
        text: (*text).to_owned(),
    };
    let files: Vec<SourceFile> = files.iter().map(file).collect();
    let (program, findings) = load_ladders(&files, &LoadOptions::default());
    (program.unwrap_or_else(|| panic!("{findings:#?}")), files)
}

/// Checks the list of the mutants of ladder files. Each mutant runs, and no two are the same.
fn check(files: &[(&str, &str)], expected: Expect) {
    let (program, files) = load(files);
    let mutants = mutants(&program, &files, PERIOD);
    let mut text = String::new();
    let mut rung = "";
    for mutant in &mutants {
        if rung != mutant.rung {
            rung = &mutant.rung;
            let _ = writeln!(text, "{rung}");
        }
        let _ = writeln!(text, "  {}: {}", mutant.kind.name(), mutant.what);
    }
    expected.assert_eq(&text);
    try_all(&program, &mutants);
}

/// As [`check`], for the rungs of `Main`.
fn check_main(rungs: &str, expected: Expect) {
    let rungs: Vec<&str> = rungs.trim().lines().map(str::trim).collect();
    let text = format!(
        "[tags]\nbits = {{ at = \"C16\", count = 4 }}\nwords = {{ at = \"D16\", count = 4 }}\n\
         speed = {{ at = \"D20\", max = 9 }}\nlimit = {{ value = 80 }}\n\
         patience = {{ value = \"2s\" }}\n[[program]]\nname = \"Main\"\nrung = [\n{}\n]\n",
        rungs.join("\n")
    );
    check(&[("ladder.toml", &text)], expected);
}

/// Runs every mutant. Each differs from the ladder and from every other mutant.
fn try_all(program: &Program, mutants: &[Mutant]) {
    let mut seen = HashMap::from([(digest(&lower(program).0), "the ladder itself".to_owned())]);
    let mut same = Vec::new();
    for mutant in mutants {
        let mutated = mutant.apply_to(program);
        let (code, _) = lower(&mutated);
        let name = format!("{}: {}", mutant.rung, mutant.what);
        if let Some(other) = seen.insert(digest(&code), name.clone()) {
            same.push(format!("{name} = {other}"));
        }
        run(&mutated, code);
    }
    assert!(same.is_empty(), "{same:#?}");
}

fn digest(code: &engine::EngineProgram) -> u64 {
    let mut hasher = DefaultHasher::new();
    format!("{code:?}").hash(&mut hasher);
    hasher.finish()
}

/// Runs 200 scans with inputs and words that change at random.
fn run(program: &Program, code: engine::EngineProgram) {
    let layout = code.layout.clone();
    let inputs = (0..program.sizes.x).take(16).map(|n| Address::Bit(Bit::Space(BitSpace::X, n)));
    let words = (0..8).map(|n| Address::Word(Word::Space(WordSpace::D, n)));
    let cells: Vec<Cell> = inputs.chain(words).filter_map(|at| layout.cell(at)).collect();
    let mut engine = Engine::new(code);
    engine.apply(EngineCall::Start { now_ns: 0 });
    let mut random = 0x2545_f491_4f6c_dd1d_u64;
    for scan in 0..200_u64 {
        engine.begin_scan(
            scan * PERIOD.ns(),
            &ScanTimes::default(),
            &LocalTime::of(LocalTime::SIMULATED_S),
        );
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        let cell = cells[(random % cells.len() as u64) as usize];
        let value = (random >> 32) as i32 & if matches!(cell, Cell::Bit(_)) { 1 } else { 15 };
        engine.apply(EngineCall::Write(cell, value));
        if scan == 199 {
            engine.request_stop();
        }
        if engine.execute().last {
            engine.terminate();
        }
    }
}
