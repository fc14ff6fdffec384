//! Exploring and deducing agree about random programs, and what each finds holds on the engine.
//!
//! `RUNGD_PROVE_WAYS` (6) is the number of programs, `RUNGD_PROVE_SEED` (1) the first seed. A
//! question that one of the ways leaves open is counted, not judged.

use super::drawn::{Drawn, drawn};
use rungd_prove::deduce::Patience;
use rungd_prove::explore::{ExploreLimits, Explored, explore};
use rungd_prove::model::{Path, Run, Target};
use rungd_prove::race::{Decision, by_deducing};
use rungd_test_support::setting::setting;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// The memory for states, bytes.
const MEMORY: usize = 2_000_000;
/// The time of the solver for a question; a question that takes longer is left open.
const TIME: Duration = Duration::from_millis(500);

#[derive(Debug, Default)]
struct Tally {
    never: u32,
    found: u32,
    open: u32,
}

fn explored(drawn: &Drawn, target: Target) -> Explored {
    let limits = ExploreLimits {
        memory: MEMORY,
        combinations: 64,
        threads: 2,
        deadline: None,
        stop: &|| false,
        states: None,
        depth: None,
    };
    explore(&drawn.model, target, &limits)
}

/// Whether the last scan of a path, and no earlier one, meets the target.
fn reaches(drawn: &Drawn, target: Target, path: &Path) -> bool {
    let mut run = Run::new(&drawn.model);
    let met = path.scans.iter().map(|scan| {
        let outcome = run.scan(scan);
        assert!(outcome.is_allowed, "{}", drawn.text);
        target.is_met(run.engine.image())
    });
    let met: Vec<bool> = met.collect();
    met.last() == Some(&true)
}

fn judge(drawn: &Drawn, target: Target, tally: &mut Tally) {
    let patience = Patience::new(TIME, &Arc::new(AtomicBool::new(false)));
    let deduced = by_deducing(&drawn.model, target, &patience);
    let explored = explored(drawn, target);
    let text = || format!("{target:?}: {explored:?}\n{deduced:?}\n{}", drawn.text);
    match (&explored, &deduced) {
        (Explored::Stopped { .. }, _) | (_, Decision::Open(_)) => tally.open += 1,
        (Explored::All { .. }, Decision::Never(..)) => tally.never += 1,
        (Explored::Found(short), Decision::Found(_, path)) => {
            assert!(reaches(drawn, target, path), "{}", text());
            assert!(path.scans.len() >= short.scans.len(), "{}", text());
            tally.found += 1;
        }
        (Explored::All { .. }, Decision::Found(..)) | (Explored::Found(_), Decision::Never(..)) => {
            panic!("{}", text())
        }
    }
}

#[test]
fn both_ways_agree_about_random_programs() {
    let (first, count) = (setting("RUNGD_PROVE_SEED", 1), setting("RUNGD_PROVE_WAYS", 6));
    let mut tally = Tally::default();
    for seed in first..first + count {
        let drawn = drawn(seed);
        for bit in &drawn.model.judged {
            judge(&drawn, Target { bit: *bit, value: seed % 2 == 0 }, &mut tally);
        }
    }
    println!("{tally:?}");
    assert!(tally.never + tally.found > 0, "{tally:?}");
}
