//! Random ladders with templates are reloaded with edited templates, with additional uses among the
//! rungs, and with additional tags that have a `type` before the others. The parts that were there
//! before continue as if nothing had been edited.
//!
//! Tests `RUNGD_PROPERTY_TEMPLATES` (12) ladders from the seed `RUNGD_PROPERTY_SEED` (1) on.

use rungd_base::calendar::LocalTime;
use rungd_engine::{Cell, Engine, EngineCall, EngineProgram, ScanTimes};
use rungd_lab::traces::stimulus::{Stimulus, StimulusChange};
use rungd_language::lower::{Symbols, lower};
use rungd_state::reload::{LoweredProgram, ReloadPlan};
use rungd_test_support::run::{cell, load, target, value};
use rungd_test_support::setting::setting;
use rungd_test_support::written_out::Case;

const SCANS: u64 = 60;

/// A program, and the cells that are compared.
struct Version {
    program: EngineProgram,
    symbols: Symbols,
    stimulus: Stimulus,
    watch: Vec<Cell>,
}

impl Version {
    fn new(ladder: &str, stimulus: &str, watch: &[(String, String)]) -> Version {
        let program = load(ladder).unwrap_or_else(|error| panic!("{error}\n{ladder}"));
        let (code, symbols) = lower(&program);
        let stimulus = Stimulus::parse(stimulus, &|name| target(&program, &symbols, name));
        let stimulus = stimulus.unwrap_or_else(|error| panic!("{}", error.message));
        let of = |name| cell(&program, &symbols, name).unwrap_or_else(|error| panic!("{error}"));
        let watch = watch.iter().map(|(name, _)| of(name)).collect();
        Version { program: code, symbols, stimulus, watch }
    }

    fn side(&self) -> LoweredProgram<'_> {
        LoweredProgram { program: &self.program, symbols: &self.symbols }
    }
}

/// The values at the end of every scan, with reloads before some of them.
fn trace(first: &Version, reloads: &[(u64, &Version)]) -> Vec<Vec<i64>> {
    let mut engine = Engine::new(first.program.clone());
    engine.start(0);
    let (mut rows, mut next, mut now) = (Vec::new(), 0, first);
    for scan in 0..SCANS {
        for (_, to) in reloads.iter().filter(|(at, _)| *at == scan) {
            let plan = ReloadPlan::new(now.side(), to.side());
            let mut successor = Engine::new(to.program.clone());
            successor.adopt(&mut engine, &plan.transfer, true, &[]);
            (engine, now) = (successor, to);
        }
        engine.begin_scan(scan * 10_000_000, &ScanTimes::default(), &LocalTime::default());
        for change in now.stimulus.of_scan(scan, &mut next) {
            match change {
                StimulusChange::Input(n, on) => engine.set_input(n, on),
                StimulusChange::Bit(cell, on) => engine.apply(EngineCall::Write(cell, on.into())),
                StimulusChange::Word(cell, value) => engine.write_word(cell, value),
            }
        }
        engine.execute();
        rows.push(now.watch.iter().map(|cell| value(engine.image(), *cell)).collect());
    }
    rows
}

#[test]
fn named_elements_keep_their_state_over_template_edits() {
    let first = setting("RUNGD_PROPERTY_SEED", 1);
    for seed in first..first + setting("RUNGD_PROPERTY_TEMPLATES", 12) {
        let case = Case::of(seed);
        let (_, watch) = case.written_out();
        let texts = [case.with_templates(), case.edited(seed).with_templates()];
        let [plain, edited] =
            texts.each_ref().map(|text| Version::new(text, &case.stimulus, &watch));
        let expected = trace(&plain, &[]);
        let at = 1 + seed % (SCANS - 20);
        for (how, found) in [
            ("edited", trace(&plain, &[(at, &edited)])),
            ("edited and back", trace(&plain, &[(at, &edited), (at + 7, &plain)])),
            ("taken away and back", trace(&edited, &[(at, &plain), (at + 1, &edited)])),
        ] {
            let Some(scan) = (0..expected.len()).find(|at| expected[*at] != found[*at]) else {
                continue;
            };
            let pairs = watch.iter().zip(expected[scan].iter().zip(&found[scan]));
            let differ: Vec<_> = pairs.filter(|(_, (a, b))| a != b).collect();
            panic!(
                "seed {seed}, {how} at {at}: scan {scan}: {differ:?}\n{}\n---\n{}",
                texts[0], texts[1]
            );
        }
    }
}
