//! Reloads of random programs: an identical program leaves no trace, a different program keeps data
//! memory.
//!
//! Programs and stimuli come from the reference model's generator; each seed gives a program. Tests
//! `RUNGD_PROPERTY_PROGRAMS` (30) programs from the seed `RUNGD_PROPERTY_SEED` (1) on.

#[allow(dead_code, unused_imports)]
use rungd_base::calendar::LocalTime;
use rungd_engine::isa::{Bit, BitSpace, Word, WordSpace};
use rungd_engine::{Cell, Engine, EngineCall, PassStep, ScanTimes, Transfer, WordCell};
use rungd_lab::traces::stimulus::{Stimulus, StimulusChange};
use rungd_language::lower::{Symbols, lower};
use rungd_state::reload::{LoweredProgram, ReloadPlan};
use rungd_test_support::model::case::Case;
use rungd_test_support::model::generate::generate;
use rungd_test_support::model::rng::Rng;
use rungd_test_support::run::{load, target};
use rungd_test_support::setting::setting;

pub fn seeds() -> std::ops::Range<u64> {
    let first = setting("RUNGD_PROPERTY_SEED", 1);
    first..first + setting("RUNGD_PROPERTY_PROGRAMS", 30)
}

struct Loaded {
    program: rungd_engine::EngineProgram,
    symbols: Symbols,
    stimulus: Stimulus,
}

fn loaded(case: &Case) -> Loaded {
    let program = load(&case.ladder()).unwrap_or_else(|e| panic!("seed {}: {e}", case.seed));
    let (code, symbols) = lower(&program);
    let stimulus = Stimulus::parse(&case.stimulus(), &|name| target(&program, &symbols, name));
    let stimulus = stimulus.unwrap_or_else(|e| panic!("seed {}: {}", case.seed, e.message));
    Loaded { program: code, symbols, stimulus }
}

fn plan(old: &Loaded, new: &Loaded) -> ReloadPlan {
    let side = |of: &Loaded| -> (rungd_engine::EngineProgram, Symbols) {
        (of.program.clone(), of.symbols.clone())
    };
    let ((a, b), (c, d)) = (side(old), side(new));
    ReloadPlan::new(
        LoweredProgram { program: &a, symbols: &b },
        LoweredProgram { program: &c, symbols: &d },
    )
}

fn swapped(engine: &mut Engine, to: &Loaded, transfer: &Transfer) -> Engine {
    let mut next = Engine::new(to.program.clone());
    next.adopt(engine, transfer, true, &[]);
    next
}

/// Public memory after every scan.
type Rows = Vec<(Vec<u8>, Vec<i32>)>;

/// Runs a case with a reload of the same program before each scan that `at` selects.
fn trace(case: &Case, of: &Loaded, at: impl Fn(u64) -> bool) -> Rows {
    rows(case, of, of, at)
}

/// Runs a case with one reload of a different program with the same blocks.
fn trace_into(case: &Case, of: &Loaded, other: &Loaded, reload: u64) -> Rows {
    rows(case, of, other, |scan| scan == reload)
}

fn rows(case: &Case, of: &Loaded, other: &Loaded, at: impl Fn(u64) -> bool) -> Rows {
    let same = plan(of, other);
    let mut engine = Engine::new(of.program.clone());
    engine.start(0);
    let (mut rows, mut next) = (Vec::new(), 0);
    let layout = &of.symbols.layout;
    let (bits, words) = (layout.bit_count() as usize, layout.word_count() as usize);
    for scan in 0..case.scans as u64 {
        if case.stop && scan + 1 == case.scans as u64 {
            engine.request_stop();
        }
        if at(scan) {
            engine = swapped(&mut engine, other, &same.transfer);
        }
        let now_ns = scan * case.period as u64 * 1_000_000;
        engine.begin_scan(now_ns, &ScanTimes::default(), &LocalTime::default());
        for change in of.stimulus.of_scan(scan, &mut next) {
            match change {
                StimulusChange::Input(n, on) => engine.set_input(n, on),
                StimulusChange::Bit(cell, on) => engine.apply(EngineCall::Write(cell, on.into())),
                StimulusChange::Word(cell, value) => engine.write_word(cell, value),
            }
        }
        let last = engine.execute().last;
        rows.push((engine.image().bits()[..bits].into(), engine.image().words()[..words].into()));
        if last {
            engine.terminate();
            rows.push((
                engine.image().bits()[..bits].into(),
                engine.image().words()[..words].into(),
            ));
            break;
        }
    }
    rows
}

#[test]
fn a_reload_of_the_identical_program_does_not_change_the_trace() {
    for seed in seeds() {
        let case = generate(seed);
        let of = loaded(&case);
        let without = trace(&case, &of, |_| false);
        for every in [1, 3 + seed % 5] {
            let with = trace(&case, &of, |scan| scan % every == 0);
            let differs = without.iter().zip(&with).position(|(a, b)| a != b);
            assert!(
                without == with,
                "seed {seed}, every {every}: scan {differs:?}\n{}",
                case.ladder()
            );
        }
    }
}

/// Adds rungs at random places, each with the contacts of an existing rung and its own instruction.
fn with_more(case: &Case, rng: &mut Rng) -> Case {
    let mut more = case.clone();
    let blocks = more.blocks.iter_mut();
    let lists = blocks.flat_map(|block| {
        let stages = block.stages.iter_mut().map(|stage| &mut stage.rungs);
        std::iter::once(&mut block.rungs).chain(stages)
    });
    for rungs in lists.filter(|rungs| !rungs.is_empty()) {
        for _ in 0..1 + rng.below(3) {
            let mut rung = rungs[rng.below(rungs.len())].clone();
            if rung.legs.len() == 1 && rung.legs[0].0 == "when" {
                rung.branches.clear();
                rung.instrs = vec!["SET C2000".to_owned()];
                rungs.insert(rng.below(rungs.len() + 1), rung);
            }
        }
    }
    more
}

#[test]
fn inserted_rungs_do_not_change_other_rungs() {
    for seed in seeds() {
        let (case, mut rng) = (generate(seed), Rng::new(seed ^ 0xadd));
        let (of, more) = (loaded(&case), loaded(&with_more(&case, &mut rng)));
        let at = rng.below(case.scans as usize) as u64;
        let without = trace(&case, &of, |_| false);
        let with = trace_into(&case, &of, &more, at);
        let own = of.symbols.layout.bit(Bit::Space(BitSpace::C, 2000)).0 as usize;
        for (scan, (a, mut b)) in without.iter().zip(with).enumerate() {
            b.0[own] = a.0[own];
            assert!(*a == b, "seed {seed}, reload at {at}: scan {scan}\n{}", case.ladder());
        }
    }
}

#[test]
fn the_plan_for_the_identical_program_is_empty() {
    for seed in seeds() {
        let of = loaded(&generate(seed));
        let transfer = plan(&of, &of).transfer;
        assert!(transfer.gone.is_empty() && transfer.moved.is_empty(), "seed {seed}");
        assert!(transfer.fresh.is_empty() && transfer.gone_blocks.is_empty(), "seed {seed}");
        assert!(transfer.new_bits.is_empty() && transfer.new_words.is_empty(), "seed {seed}");
    }
}

#[test]
fn a_different_program_keeps_data_memory() {
    for seed in seeds() {
        let (a, b) = (generate(seed), generate(seed + 100_000));
        let (old, new) = (loaded(&a), loaded(&b));
        let (there, back) = (plan(&old, &new), plan(&new, &old));
        // A reload turns a bit of a word OFF that the other program does not drive.
        let passes = [&old, &new].into_iter().flat_map(|of| &of.program.tables.terminations);
        let driven: Vec<Cell> =
            passes.filter_map(PassStep::bit_off).map(|bit| bit.whole()).collect();
        let mut engine = Engine::new(old.program.clone());
        engine.start(0);
        let mut next = 0;
        for scan in 0..a.scans as u64 {
            engine.begin_scan(scan * 10_000_000, &ScanTimes::default(), &LocalTime::default());
            for change in old.stimulus.of_scan(scan, &mut next) {
                if let StimulusChange::Input(n, on) = change {
                    engine.set_input(n, on);
                }
            }
            if engine.execute().last {
                break;
            }
            let before = data(&engine, &old);
            let mut other = swapped(&mut engine, &new, &there.transfer);
            let touched: Vec<u32> = there.transfer.new_words.iter().map(|(w, _)| w.0).collect();
            let first = new.symbols.layout.word(Word::Space(WordSpace::D, 0)).0;
            for (at, (was, is)) in before.iter().zip(data(&other, &new)).enumerate() {
                let cell = first + at as u32;
                let is_driven = driven.contains(&Cell::Word(WordCell(cell)));
                let initial = touched.contains(&cell);
                assert!(
                    is_driven || initial || *was == is,
                    "seed {seed}, scan {scan}: D{at} {was} {is}"
                );
            }
            other.begin_scan(
                scan * 10_000_000 + 5_000_000,
                &ScanTimes::default(),
                &LocalTime::default(),
            );
            other.execute();
            engine = swapped(&mut other, &old, &back.transfer);
        }
        engine.terminate();
    }
}

fn data(engine: &Engine, of: &Loaded) -> Vec<i32> {
    let first = of.symbols.layout.word(Word::Space(WordSpace::D, 0)).0 as usize;
    // The places of tags with a `type` come after the addresses that programs name.
    let count = of.symbols.layout.sizes().d as usize / 2;
    engine.image().words()[first..first + count].to_vec()
}
