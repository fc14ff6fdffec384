//! Properties of every program: the same input gives the same trace, the order of operations within
//! a scan has no visible effect, and inputs do not change during a scan.
//!
//! Programs, inputs and queued writes come from the generator of the reference model; each seed
//! gives one program. `RUNGD_PROPERTY_PROGRAMS` (75) is the number of programs,
//! `RUNGD_PROPERTY_SEED` (1) the first seed.

use rungd_base::calendar::{LocalTime, parse_seconds};
use rungd_engine::isa::{Bit, BitSpace};
use rungd_engine::{Cell, Engine, EngineCall, ScanTimes};
use rungd_lab::traces::stimulus::{Stimulus, StimulusChange};
use rungd_lab::traces::trace::{CsvTrace, TracedOperand};
use rungd_language::lower::{lower, lower_with};
use rungd_language::resolve::program::Program;
use rungd_test_support::bare_run::{Plan, run};
#[allow(dead_code, unused_imports)]
use rungd_test_support::model::case::Case;
use rungd_test_support::model::clock;
use rungd_test_support::model::generate::generate;
use rungd_test_support::run::{cell, load, target};
use rungd_test_support::setting::setting;

fn cases() -> impl Iterator<Item = Case> {
    let first = setting("RUNGD_PROPERTY_SEED", 1);
    (first..first + setting("RUNGD_PROPERTY_PROGRAMS", 75)).map(generate)
}

fn loaded(case: &Case) -> (Program, Plan) {
    let program = load(&case.ladder()).unwrap_or_else(|e| panic!("seed {}: {e}", case.seed));
    let (_, symbols) = lower(&program);
    let stimulus = Stimulus::parse(&case.stimulus(), &|name| target(&program, &symbols, name));
    let stimulus = stimulus.unwrap_or_else(|e| panic!("seed {}: {}", case.seed, e.message));
    let clock_s = parse_seconds(&clock::text(case.clock)).expect("a time");
    let (period_ms, scans) = (case.period as u32, case.scans as u64);
    (program, Plan { period_ms, scans, stop: case.stop, clock_s, stimulus })
}

/// The trace of everything that the program can name; `window` as in `lower_with`.
fn trace(case: &Case, program: &Program, plan: &Plan, window: Option<usize>) -> String {
    let (engine_program, symbols) = match window {
        Some(window) => lower_with(program, window),
        None => lower(program),
    };
    let watched = case.watch().into_iter().map(|name| {
        let cell = cell(program, &symbols, &name).unwrap_or_else(|error| panic!("{error}"));
        TracedOperand::new(&name, cell, &symbols.layout)
    });
    let watched: Vec<TracedOperand> = watched.collect();
    let mut trace = CsvTrace::new(&watched, Vec::new()).expect("a Vec takes all");
    run(engine_program, plan, &mut trace).expect("a Vec takes all");
    String::from_utf8(trace.finish().expect("a Vec takes all")).expect("CSV is text")
}

fn assert_same(case: &Case, a: &str, b: &str, what: &str) {
    let differs = a.lines().zip(b.lines()).find(|(a, b)| a != b);
    let seed = case.seed;
    assert!(a == b, "seed {seed}: {what}: {differs:?}\n{}\n{}", case.ladder(), case.stimulus());
}

#[test]
fn two_runs_give_the_same_trace() {
    for case in cases() {
        let (program, plan) = loaded(&case);
        let first = trace(&case, &program, &plan, None);
        let (again, plan) = loaded(&case);
        assert_same(&case, &first, &trace(&case, &again, &plan, None), "a second run");
    }
}

#[test]
fn the_order_of_operations_does_not_change_the_trace() {
    for case in cases() {
        let (program, plan) = loaded(&case);
        let in_file_order = trace(&case, &program, &plan, Some(1));
        for window in [Some(2), Some(7), None] {
            let batched = trace(&case, &program, &plan, window);
            assert_same(&case, &in_file_order, &batched, &format!("window {window:?}"));
        }
    }
}

#[test]
fn inputs_do_not_change_within_a_scan() {
    for case in cases() {
        let (program, plan) = loaded(&case);
        let (engine_program, symbols) = lower(&program);
        let inputs: Vec<Cell> = (0..symbols.layout.sizes().x)
            .map(|n| Cell::Bit(symbols.layout.bit(Bit::Space(BitSpace::X, n))))
            .collect();
        let mut engine = Engine::new(engine_program);
        engine.start(0);
        let mut next = 0;
        for scan in 0..plan.scans {
            let now_ns = scan * u64::from(plan.period_ms) * 1_000_000;
            if plan.stop && scan + 1 == plan.scans {
                engine.request_stop();
            }
            engine.begin_scan(now_ns, &ScanTimes::default(), &LocalTime::default());
            for change in plan.stimulus.of_scan(scan, &mut next) {
                match change {
                    StimulusChange::Input(n, on) => engine.set_input(n, on),
                    StimulusChange::Bit(cell, on) => {
                        engine.apply(EngineCall::Write(cell, on.into()))
                    }
                    StimulusChange::Word(cell, value) => engine.write_word(cell, value),
                }
            }
            let image = |engine: &Engine| -> Vec<i64> {
                inputs
                    .iter()
                    .map(|cell| rungd_test_support::run::value(engine.image(), *cell))
                    .collect()
            };
            let before = image(&engine);
            let last = engine.execute().last;
            assert_eq!(before, image(&engine), "seed {}, scan {scan}", case.seed);
            if last {
                engine.terminate();
                assert_eq!(before, image(&engine), "seed {}, the passes", case.seed);
                break;
            }
        }
    }
}

#[test]
fn independent_rungs_execute_in_few_batches() {
    let rung = |n: u32| {
        format!(
            "{{ when = [\"X{n}\", \"rise(X{})\"], do = [\"OUT C{n}\", \"MOVE D{n} to=V{n}\"] }},\n\
             {{ leg.up = [\"X{n}\"], leg.rst = [\"C{n}\"], do = [\"CNT CT{n} preset=D{n}\"] }},\n\
             {{ when = [\"C{n}\"], do = [\"TMR T{n} preset=1s\", \"CTU N{n} preset=D{n}\"] }},\n",
            n + 100
        )
    };
    let rungs: String = (0..50).map(rung).collect();
    let ladder = format!("[[program]]\nname = \"Main\"\nrung = [\n{rungs}]\n");
    let program = load(&ladder).unwrap_or_else(|errors| panic!("{errors}"));
    let (batched, _) = lower(&program);
    let (in_file_order, _) = lower_with(&program, 1);
    assert!(batched.tables.batches.len() <= 8, "{} batches", batched.tables.batches.len());
    assert_eq!(in_file_order.tables.batches.len(), 50 * 8);
}
