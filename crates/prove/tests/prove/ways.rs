//! Exploring, deducing and an exhaustive search agree about random programs, and what each finds
//! holds on the engine.
//!
//! `RUNGD_PROVE_WAYS` (6) is the number of programs, `RUNGD_PROVE_SEED` (1) the first seed,
//! `RUNGD_PROVE_STATES` (2000) the greatest number of states that exploring keeps: what it decides,
//! it mostly decides with far fewer; `RUNGD_PROVE_EFFORT` (20000) the number of decisions of the
//! solver. A question that a way leaves open is counted, and judged by what
//! the others say. Exploring's paths are the shortest.

use super::drawn::{Drawn, drawn, with_stages_at_start};
use super::exhaust::{Exhausted, exhaust};
use rungd_engine::isa::{Structure, Word};
use rungd_engine::record::{FLAGS, timer_state};
use rungd_engine::{BitCell, Cell, Engine};
use rungd_prove::deduce::Patience;
use rungd_prove::explore::{ExploreLimits, Explored, explore};
use rungd_prove::model::{FreeInput, Path, Run, Target};
use rungd_prove::race::{Decision, by_deducing};
use rungd_test_support::model::rng::Rng;
use rungd_test_support::patience::PATIENCE;
use rungd_test_support::setting::setting;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};

/// The memory for states, bytes.
const MEMORY: usize = 2_000_000;
/// The decisions of the solver for a question; a question that takes more is left open, on every
/// machine.
const EFFORT: u64 = 20_000;
/// About the number of scans of an exhaustive search.
const SCANS: usize = 400;

#[derive(Debug, Default)]
pub struct Tally {
    /// Exploring and deducing: never so.
    pub never: u32,
    /// Exploring and deducing: so.
    pub found: u32,
    /// The exhaustive search came to its end, or found it, and agrees.
    exhausted: u32,
    /// Left open by exploring.
    open_explored: u32,
    /// Left open by deducing.
    open_deduced: u32,
}

fn explored(drawn: &Drawn, target: Target) -> Explored {
    let limits = ExploreLimits {
        memory: MEMORY,
        combinations: 64,
        threads: 2,
        deadline: None,
        stop: &|| false,
        states: Some(setting("RUNGD_PROVE_STATES", 2000)),
        scans: None,
        depth: None,
    };
    explore(&drawn.model, target, &limits)
}

/// Whether the last scan of a path meets the target.
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

/// What a way says: the length of its path, `Some(None)` for never; nothing if it left it open.
type Said = Option<Option<usize>>;

/// Whether the exhaustive search allows what a way says; `is_shortest`: of its path, too.
fn allows(seen: &Exhausted, said: Option<usize>, is_shortest: bool) -> bool {
    match (seen.found, said) {
        (Some(found), Some(said)) => {
            if is_shortest {
                said == found
            } else {
                said >= found
            }
        }
        (None, Some(said)) => said > seen.depth && !seen.is_all,
        (found, None) => found.is_none(),
    }
}

pub fn judge(drawn: &Drawn, target: Target, tally: &mut Tally) {
    let patience = Patience {
        effort: Some(Arc::new(AtomicU64::new(setting("RUNGD_PROVE_EFFORT", EFFORT)))),
        ..Patience::new(PATIENCE, &Arc::new(AtomicBool::new(false)))
    };
    let deduced = by_deducing(&drawn.model, target, &patience);
    let explored = explored(drawn, target);
    let seen = exhaust(&drawn.model, target, SCANS);
    let text = || format!("{target:?}: {explored:?}\n{deduced:?}\n{}", drawn.text);
    let short: Said = match &explored {
        Explored::Stopped { .. } => None,
        Explored::All { .. } => Some(None),
        Explored::Found(path) => Some(Some(path.scans.len())),
    };
    let any: Said = match &deduced {
        Decision::Open(_) => None,
        Decision::Never(..) => Some(None),
        Decision::Found(_, path) => {
            assert!(reaches(drawn, target, path), "{}", text());
            Some(Some(path.scans.len()))
        }
    };
    if let (Some(short), Some(any)) = (short, any) {
        assert_eq!(short.is_some(), any.is_some(), "{}", text());
        assert!(any >= short, "no shortest path: {}", text());
    }
    for (said, is_shortest) in [(short, true), (any, false)] {
        assert!(said.is_none_or(|said| allows(&seen, said, is_shortest)), "{}", text());
    }
    tally.never += u32::from(short == Some(None) && any == Some(None));
    tally.found += u32::from(matches!((short, any), (Some(Some(_)), Some(Some(_)))));
    tally.exhausted += u32::from(seen.is_all || seen.found.is_some());
    tally.open_explored += u32::from(short.is_none());
    tally.open_deduced += u32::from(any.is_none());
}

#[test]
fn all_ways_agree_about_random_programs() {
    let (first, count) = (setting("RUNGD_PROVE_SEED", 1), setting("RUNGD_PROVE_WAYS", 6));
    let mut tally = Tally::default();
    for seed in first..first + count {
        let drawn = drawn(seed);
        for bit in &drawn.model.judged {
            judge(&drawn, Target { bit: *bit, value: seed % 2 == 0 }, &mut tally);
        }
    }
    println!("{count} programs: {tally:?}");
    assert!(tally.never + tally.found > 0, "{tally:?}");
}

/// The same model, in which some counters and timers begin with any flags, and what their
/// instructions keep, all but that a timer times; and retained Stages are ON or OFF.
fn with_retained_at_start(mut drawn: Drawn, rng: &mut Rng) -> Drawn {
    let layout = &drawn.model.code.layout;
    let mut cells = Vec::new();
    for structure in [Structure::Counter(0), Structure::Timer(0), Structure::Counter(1)] {
        let record = layout.record_bits(structure);
        let is_running = |bit: &u32| {
            let place = record.start + FLAGS as u32 + timer_state::RUNNING;
            matches!(structure, Structure::Timer(_)) && *bit == place
        };
        let all = record.clone().filter(|bit| !is_running(bit)).map(|bit| Cell::Bit(BitCell(bit)));
        cells.extend(all.chain([Cell::Word(layout.word(Word::Acc(structure)))]));
    }
    let cold = Engine::new(drawn.model.code.clone());
    for cell in cells.into_iter().filter(|_| rng.chance(10)) {
        let low = cold.image().value(cell).min(0);
        let input = FreeInput { cell, low, high: 1, cold: Some(cold.image().value(cell)) };
        if drawn.model.inputs.iter().all(|known| known.cell != cell) {
            drawn.model.inputs.push(input);
        }
    }
    drawn.model = with_stages_at_start(drawn.model, rng);
    drawn
}

#[test]
fn all_ways_agree_about_random_programs_that_begin_with_retained_structures_and_stages() {
    let (first, count) = (setting("RUNGD_PROVE_SEED", 1), setting("RUNGD_PROVE_WAYS", 6));
    let mut tally = Tally::default();
    // Other programs than those above.
    for seed in first + count..first + 2 * count {
        let drawn = with_retained_at_start(drawn(seed), &mut Rng::new(seed ^ 0x57A7));
        let bit = drawn.model.judged[seed as usize % drawn.model.judged.len()];
        judge(&drawn, Target { bit, value: seed % 2 == 0 }, &mut tally);
    }
    println!("{count} programs: {tally:?}");
    assert!(tally.never + tally.found > 0, "{tally:?}");
}
