//! A program with templates has the same trace, byte for byte, as the ladder written out without
//! templates.
//!
//! `RUNGD_PROPERTY_TEMPLATES` (60) is the number of random ladders, `RUNGD_PROPERTY_SEED` (1) the
//! first seed.

use rungd_lab::traces::stimulus::Stimulus;
use rungd_lab::traces::trace::{CsvTrace, TracedOperand};
use rungd_language::lower::lower;

use rungd_test_support::bare_run::{Plan, run};
use rungd_test_support::run::{cell, load, target};
use rungd_test_support::setting::setting;
use rungd_test_support::written_out::Case;

fn trace(ladder: &str, stimulus: &str, watch: &[&str]) -> String {
    let program = load(ladder).unwrap_or_else(|error| panic!("{error}\n{ladder}"));
    let (engine_program, symbols) = lower(&program);
    let stimulus = Stimulus::parse(stimulus, &|name| target(&program, &symbols, name));
    let stimulus = stimulus.unwrap_or_else(|error| panic!("{}", error.message));
    let (period_ms, scans) = (10, 60);
    let plan = Plan { period_ms, scans, stop: true, clock_s: 0, stimulus };
    let watched = watch.iter().map(|name| {
        let cell = cell(&program, &symbols, name).unwrap_or_else(|error| panic!("{error}"));
        TracedOperand::new(name, cell, &symbols.layout)
    });
    let watched: Vec<TracedOperand> = watched.collect();
    let mut trace = CsvTrace::new(&watched, Vec::new()).expect("a Vec takes all");
    run(engine_program, &plan, &mut trace).expect("a Vec takes all");
    let text = String::from_utf8(trace.finish().expect("a Vec takes all")).expect("CSV is text");
    text.split_once('\n').expect("a header").1.to_owned()
}

#[test]
fn a_templated_ladder_equals_its_expansion() {
    let first = setting("RUNGD_PROPERTY_SEED", 1);
    let mut moved = 0;
    for seed in first..first + setting("RUNGD_PROPERTY_TEMPLATES", 60) {
        let case = Case::of(seed);
        let (plain, watch) = case.written_out();
        let templates = case.with_templates();
        let names: Vec<&str> = watch.iter().map(|(name, _)| name.as_str()).collect();
        let expanded = trace(&templates, &case.stimulus, &names);
        let names: Vec<&str> = watch.iter().map(|(_, name)| name.as_str()).collect();
        let by_hand = trace(&plain, &case.stimulus, &names);
        let differs = expanded.lines().zip(by_hand.lines()).find(|(a, b)| a != b);
        assert!(
            expanded == by_hand,
            "seed {seed}: {differs:?}\n{names:?}\n{templates}\n---\n{plain}\n{}",
            case.stimulus
        );
        let rows: std::collections::HashSet<_> =
            expanded.lines().map(|row| row.splitn(3, ',').nth(2)).collect();
        moved += usize::from(rows.len() > 10);
    }
    assert!(moved > 0, "nothing moves in these ladders");
}
