//! Exploring agrees with an exhaustive search written apart, and with long random runs.
//!
//! The other search is in `exhaust.rs`. `RUNGD_PROVE_PROGRAMS` (8) is the number of random programs,
//! `RUNGD_PROVE_SEED` (1) the first seed, `RUNGD_PROVE_SCANS` (600) about the number of scans of each
//! exhaustive search.

use super::bench::{Asked, model};
use super::drawn::{Drawn, drawn};
use super::exhaust::{combinations, exhaust};
use rungd_engine::EngineState;
use rungd_prove::cone::cone;
use rungd_prove::explore::{
    Attained, ExploreLimits, Explored, StopCause, explore, explore_can, explore_traced,
};
use rungd_prove::model::{Path, ProofModel, Run, Target};
use rungd_test_support::model::rng::Rng;
use rungd_test_support::setting::setting;

/// Limits for small searches.
fn limits(memory: usize) -> ExploreLimits<'static> {
    ExploreLimits {
        memory,
        combinations: 64,
        threads: 2,
        deadline: None,
        stop: &|| false,
        states: Some(1_000),
        scans: None,
        depth: None,
    }
}

/// Whether a path is allowed and its last scan alone meets the target.
fn reaches(model: &ProofModel, target: Target, path: &Path) -> bool {
    let mut run = Run::new(model);
    let met = path.scans.iter().map(|inputs| {
        let outcome = run.scan(inputs);
        outcome.is_allowed.then(|| target.is_met(run.engine.image()))
    });
    let met: Option<Vec<bool>> = met.collect();
    met.is_some_and(|met| met.iter().position(|met| *met) == Some(met.len() - 1))
}

/// A random run of a model; panics if a scan that can be reached meets the target.
fn run_at_random(drawn: &Drawn, target: Target, scans: usize) {
    let mut rng = Rng::new(scans as u64);
    let mut run = Run::new(&drawn.model);
    let mut before = EngineState::of(&run.engine);
    let mut inputs = Vec::new();
    for scan in 0..scans {
        let wanted = drawn.inputs(&mut rng, &inputs);
        let outcome = run.scan(&wanted);
        if !outcome.is_allowed {
            // No such scan: try others from the state before.
            run.resume(&before, run.scans - 1);
            continue;
        }
        inputs = wanted;
        let is_met = target.is_met(run.engine.image());
        assert!(!is_met, "{target:?} at try {scan}, scan {}\n{}", run.scans, drawn.text);
        if outcome.is_last {
            run = Run::new(&drawn.model);
        }
        run.settle();
        before = EngineState::of(&run.engine);
    }
}

/// The numbers of answers of a kind.
#[derive(Debug, Default)]
struct Answers {
    all: u32,
    found: u32,
    stopped: u32,
}

fn judge(drawn: &Drawn, target: Target, answers: &mut Answers) {
    let model = &drawn.model;
    let explored = explore_traced(model, target, &limits(200_000), u64::MAX);
    let traced = explore_traced(model, target, &limits(200_000), 0);
    let seen = exhaust(model, target, setting("RUNGD_PROVE_SCANS", 600) as usize);
    let text = format!("{target:?}: {explored:?}\n{}", drawn.text);
    match (&explored, &traced) {
        (Explored::Found(path), Explored::Found(traced)) => {
            assert_eq!(path.scans.len(), traced.scans.len(), "{text}");
            assert!(reaches(model, target, traced), "the path {traced:?} fails: {text}");
        }
        // How much memory is taken at the end depends on the threads.
        (Explored::Stopped { .. }, _) | (_, Explored::Stopped { .. }) => {}
        _ => assert_eq!(explored, traced, "tracing differs: {text}"),
    }
    match explored {
        Explored::Found(path) => {
            answers.found += 1;
            assert!(reaches(model, target, &path), "the path fails: {text}");
            let length = path.scans.len();
            match seen.found {
                Some(found) => assert_eq!(found, length, "no shortest path: {text}"),
                None => assert!(length > seen.depth && !seen.is_all, "{}: {text}", seen.depth),
            }
        }
        Explored::All { .. } => {
            answers.all += 1;
            assert_eq!(seen.found, None, "{text}");
            run_at_random(drawn, target, 300);
        }
        Explored::Stopped { depth, .. } => {
            answers.stopped += 1;
            assert!(seen.found.is_none_or(|found| found > depth as usize), "{text}");
        }
    }
}

#[test]
fn exploring_agrees_with_an_exhaustive_search() {
    let first = setting("RUNGD_PROVE_SEED", 1);
    let mut answers = Answers::default();
    for seed in first..first + setting("RUNGD_PROVE_PROGRAMS", 8) {
        let drawn = drawn(seed);
        for bit in &drawn.model.judged {
            judge(&drawn, Target { bit: *bit, value: seed % 2 == 0 }, &mut answers);
        }
    }
    println!("{answers:?}");
}

/// A latch that one input sets and another one resets; a run of it takes three scans.
const LATCH: &str = r#"
[[program]]
name = "Main"
[[program.rung]]
when = ["X0", "!X1"]
do   = ["SET C0"]
[[program.rung]]
when = ["X1"]
do   = ["RST C0"]
[[program.rung]]
when = ["C0"]
do   = ["TMR T0 preset=200ms"]
[[program.rung]]
when = ["T0.Done", "C0"]
do   = ["OUT Y0"]
"#;

fn explored(asked: Asked, value: bool) -> Explored {
    let model = model(asked);
    let target = Target { bit: model.judged[0], value };
    explore(&model, target, &limits(1 << 20))
}

#[test]
fn a_found_path_is_a_shortest_one() {
    let asked = Asked { ladder: LATCH, inputs: &["X0", "X1"], assume: &[], judged: &["Y0"] };
    let Explored::Found(path) = explored(asked, true) else { panic!("not found") };
    assert_eq!(path.scans.len(), 21);
    assert_eq!(path.scans[0], [1, 0]);
    assert!(path.scans[1..].iter().all(|scan| scan[1] == 0), "{path:?}");
}

#[test]
fn a_timer_behind_its_preset_is_one_state() {
    let asked = Asked { ladder: LATCH, inputs: &["X0", "X1"], assume: &[], judged: &["!Y0 | C0"] };
    // OFF; ON with 0, 10 … 200 ms and behind them.
    assert_eq!(explored(asked, false), Explored::All { states: 23, depth: 22 });
}

/// A timer with a preset that an input selects within the limits of its tag.
const SELECTED: &str = r#"
[tags]
wait = { at = "D0", initial = "30ms", min = "20ms", max = "50ms" }
[[program]]
name = "Main"
[[program.rung]]
when = ["X1"]
do   = ["MOVE D1 to=wait"]
[[program.rung]]
when = ["X0"]
do   = ["TMR T0 preset=wait"]
[[program.rung]]
when = ["T0.Done"]
do   = ["OUT Y0"]
"#;

#[test]
fn a_timer_runs_on_behind_the_greatest_value_of_its_preset() {
    let ladder = SELECTED;
    let asked = Asked { ladder, inputs: &["X0", "X1"], assume: &[], judged: &["!Y0 | X0"] };
    // Two presets, 30 ms and 20 ms (of D1, which is 0); OFF; ON with 0, 10, 20, 30 ms and behind.
    assert_eq!(explored(asked, false), Explored::All { states: 12, depth: 5 });
}

#[test]
fn what_every_scan_begins_with_is_no_constant_beside_a_timer() {
    let ladder = "[[program]]\nname = \"Main\"\n[[program.rung]]\nwhen = [\"$On\"]\n\
                  do = [\"TMR T0 preset=50ms\"]";
    let judged = &["T0.Acc >= $ScanCounter"];
    // It holds, but for ever new scan counters.
    let explored = explored(Asked { ladder, inputs: &[], assume: &[], judged }, false);
    assert!(matches!(explored, Explored::Stopped { .. }), "{explored:?}");
}

#[test]
fn inputs_that_are_not_allowed_are_no_scans() {
    let asked =
        Asked { ladder: LATCH, inputs: &["X0", "X1"], assume: &["!X0 | Y0"], judged: &["C0"] };
    assert_eq!(explored(asked, true), Explored::All { states: 1, depth: 1 });
}

/// A motor that stops for each of twenty-four reasons.
fn motor() -> String {
    let reasons: Vec<String> = (1..25).map(|n| format!("\"!X{n}\"")).collect();
    let reasons = reasons.join(", ");
    format!(
        "[[program]]\nname = \"Main\"\n[[program.rung]]\nwhen = [\"X0 | Y0\", {reasons}]\n\
         do = [\"OUT Y0\"]\n[[program.rung]]\nwhen = [\"Y0\"]\ndo = [\"OUT Y1\"]"
    )
}

#[test]
fn of_many_inputs_only_those_are_tried_that_matter() {
    let (ladder, names) = (motor(), (0..25).map(|n| format!("X{n}")).collect::<Vec<String>>());
    let inputs: Vec<&str> = names.iter().map(String::as_str).collect();
    let asked = |judged| Asked { ladder: &ladder, inputs: &inputs, assume: &[], judged };
    assert_eq!(explored(asked(&["!Y1 | !X7"]), false), Explored::All { states: 2, depth: 1 });
    let Explored::Found(path) = explored(asked(&["Y1 & X0"]), true) else { panic!("not found") };
    assert_eq!(path.scans.len(), 1);
}

#[test]
fn too_many_combinations_stop_a_search() {
    let parity = (0..24).map(|n| format!("X{n}")).collect::<Vec<String>>();
    let ladder = format!(
        "[[program]]\nname = \"Main\"\n[[program.rung]]\nwhen = [\"$On\"]\n\
         do = [\"MATH D0 = {}\"]",
        parity.join(" + ")
    );
    let inputs: Vec<&str> = parity.iter().map(String::as_str).collect();
    let asked = Asked { ladder: &ladder, inputs: &inputs, assume: &[], judged: &["D0 < 25"] };
    let stopped = Explored::Stopped { states: 0, depth: 0, cause: StopCause::Combinations };
    assert_eq!(explored(asked, false), stopped);
}

/// Whether some inputs lead from the state of a run to the target within a number of scans.
fn attains(run: &mut Run, target: Target, scans: usize) -> bool {
    let (first, mut level) = (run.scans, vec![EngineState::of(&run.engine)]);
    let inputs = combinations(&run.model().choices());
    for depth in 0..scans {
        let mut next: Vec<EngineState> = Vec::new();
        for state_before in level {
            for values in &inputs {
                run.resume(&state_before, first + depth as u64);
                let outcome = run.scan(values);
                if !outcome.is_allowed {
                    continue;
                }
                if target.is_met(run.engine.image()) {
                    return true;
                }
                run.settle();
                let after = EngineState::of(&run.engine);
                if !outcome.is_last && !next.contains(&after) && next.len() < 40 {
                    next.push(after);
                }
            }
        }
        level = next;
    }
    false
}

#[test]
fn from_a_dead_end_a_plain_search_reaches_the_target_no_more() {
    let mut dead = 0;
    for seed in 1..=setting("RUNGD_PROVE_PROGRAMS", 8) {
        let drawn = drawn(seed);
        let target = Target { bit: drawn.model.judged[0], value: true };
        let cone = cone(&drawn.model, &[target.bit]);
        let Attained::NotFrom(path) = explore_can(&cone, target, &limits(200_000)) else {
            continue;
        };
        let path = cone.widened(&path);
        let mut run = Run::new(&drawn.model);
        path.scans.iter().for_each(|scan| drop(run.scan(scan)));
        assert!(!attains(&mut run, target, 4), "{}", drawn.text);
        dead += 1;
    }
    println!("{dead} dead ends");
}
