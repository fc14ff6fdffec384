//! Subroutines: the pass after a crash, a state that is resumed, and the rungs in place of a CALL.
//!
//! `RUNGD_PROPERTY_CALLS` (60) is the number of random programs, `RUNGD_PROPERTY_SEED` (1) the first
//! seed.

use rungd_engine::{Engine, EngineState};
use rungd_lab::traces::stimulus::Stimulus;
use rungd_lab::traces::trace::{CsvTrace, TracedOperand};
use rungd_language::lower::lower;
use rungd_test_support::bare_run::{Plan, run};
use rungd_test_support::model::case::{Block, Case, Expr, Rung};
use rungd_test_support::model::generate::generate;
use rungd_test_support::model::rng::Rng;
use rungd_test_support::plc::{plc, stopped};
use rungd_test_support::run::{cell, load, target};
use rungd_test_support::setting::setting;

const CALLING: &str = r#"
rung = [ { when = ["X0"], do = ["CALL S", "TMR T1 preset=1s"] } ]
[[program]]
name = "P"
autostart = true
[[program.stage]]
name = "A"
rung = [ { when = ["X1"], do = ["CALL S"] }, { when = ["X3"], do = ["JMP B"] } ]
[[program.stage]]
name = "B"
rung = [ { when = ["X4"], do = ["JMP A"] } ]
[[subroutine]]
name = "S"
rung = [
  { when = ["X2"], do = ["RETURN"] },
  { when = ["$On"], do = ["OUT Y0", "TMR T0 preset=1s"] },
]
"#;

#[test]
fn the_pass_after_a_crash_reaches_every_subroutine() {
    let mut plc = stopped(CALLING);
    for (name, value) in [("Y0", 1), ("T0.Acc", 70), ("T1.Acc", 70)] {
        let cell = plc.cell(name);
        plc.engine.restore(cell, value);
    }
    plc.engine.terminate_all();
    assert_eq!(plc.values(["Y0", "T0.Acc", "T0.Reset", "T1.Acc"]), [0, 0, 1, 0]);
    plc.engine.start(0);
    plc.scan(&[("X0", 1)]);
    plc.scans(2);
    assert_eq!(plc.values(["Y0", "T0.Acc", "T1.Acc"]), [1, 20, 20]);
}

/// A state that is written, read and resumed in a new engine at every scan changes nothing: who
/// executed a subroutine, and the time behind a RETURN, are in it.
#[test]
fn a_state_that_is_resumed_continues_in_the_subroutines() {
    let mut one = plc(CALLING);
    let mut other = plc(CALLING);
    let inputs = [
        [1, 1, 0, 0, 0],
        [0, 1, 0, 0, 0],
        [0, 1, 1, 0, 0],
        [0, 1, 1, 0, 0],
        [0, 1, 0, 0, 0],
        [0, 1, 0, 1, 0],
        [0, 1, 0, 0, 0],
        [1, 1, 0, 0, 1],
        [0, 0, 0, 0, 0],
    ];
    let watch = ["Y0", "T0.Acc", "T0.Reset", "P.A", "P.B"];
    let mut seen = Vec::new();
    for scan in inputs {
        let names = ["X0", "X1", "X2", "X3", "X4"];
        let changes: Vec<(&str, i32)> = names.into_iter().zip(scan).collect();
        one.scan(&changes);
        other.scan(&changes);
        assert_eq!(one.values(watch), other.values(watch));
        seen.push(one.values(watch)[1]);
        let mut bytes = Vec::new();
        EngineState::of(&other.engine).write(&mut bytes);
        let state = EngineState::read(&bytes).expect("a state");
        let mut fresh = Engine::new(other.engine.program().clone());
        assert!(fresh.resume(&state));
        assert!(!plc("rung = [ { when = [\"X0\"], do = [\"OUT Y0\"] } ]").engine.resume(&state));
        other.engine = fresh;
    }
    assert_eq!(seen, [0, 10, 10, 10, 40, 50, 0, 0, 0]);
}

#[test]
fn a_state_with_a_caller_that_has_no_turn_is_refused() {
    let mut plc = plc(CALLING);
    plc.scan(&[("X0", 1)]);
    let mut bytes = Vec::new();
    EngineState::of(&plc.engine).write(&mut bytes);
    let caller = bytes.len() - 5;
    assert_eq!(bytes[caller..], [1, 0, 0, 0, 0], "Main called it");
    for (forged, is_read) in [
        ([2, 1, 0, 0, 0], true),
        ([2, 9, 0, 0, 0], true),
        ([1, 2, 0, 0, 0], true),
        ([3, 0, 0, 0, 0], false),
    ] {
        bytes[caller..].copy_from_slice(&forged);
        let state = EngineState::read(&bytes);
        assert_eq!(state.is_some(), is_read, "{forged:?}");
        let resumed = state.is_some_and(|state| plc.engine.resume(&state));
        assert_eq!(resumed, forged == [2, 1, 0, 0, 0], "{forged:?}");
    }
}

/// Moves the last rungs of an element into a subroutine that `$On` calls once in their place.
fn with_subroutine(case: &Case, rng: &mut Rng) -> Option<Case> {
    let mut case = case.clone();
    let block = rng.below(case.blocks.len());
    let block = &mut case.blocks[block];
    let stage = rng.below(block.stages.len() + 1);
    let rungs = match stage {
        0 => &mut block.rungs,
        stage => &mut block.stages[stage - 1].rungs,
    };
    let stays = ["JMP", "SGSET", "SGRST", "SGDIVRG", "SGCONVRG", "EXIT"];
    let may_move = |rung: &Rung| {
        let branches = rung.branches.iter().flat_map(|branch| &branch.instrs);
        let mut all = rung.instrs.iter().chain(branches);
        all.all(|text| !stays.iter().any(|word| text.starts_with(word)))
    };
    if block.subroutine {
        return None;
    }
    let last = rungs.iter().rev().take_while(|rung| may_move(rung)).count();
    let count = 1 + rng.below(last.max(1));
    if last == 0 {
        return None;
    }
    let moved: Vec<Rung> = rungs.split_off(rungs.len() - count);
    let when = vec![Expr::Leaf("$On".to_owned())];
    let instrs = vec!["CALL Once".to_owned()];
    rungs.push(Rung { legs: vec![("when".to_owned(), when)], instrs, branches: Vec::new() });
    case.blocks.push(Block {
        name: "Once".to_owned(),
        task: false,
        subroutine: true,
        autostart: false,
        short: false,
        rungs: moved,
        stages: Vec::new(),
    });
    Some(case)
}

fn trace(case: &Case) -> String {
    let ladder = case.ladder();
    let program = load(&ladder).unwrap_or_else(|error| panic!("{error}\n{ladder}"));
    let (engine_program, symbols) = lower(&program);
    let stimulus = Stimulus::parse(&case.stimulus(), &|name| target(&program, &symbols, name));
    let stimulus = stimulus.unwrap_or_else(|error| panic!("{}", error.message));
    let (period_ms, scans) = (case.period as u32, case.scans as u64);
    let plan = Plan { period_ms, scans, stop: case.stop, clock_s: 0, stimulus };
    let watched = case.watch().into_iter().map(|name| {
        let cell = cell(&program, &symbols, &name).unwrap_or_else(|error| panic!("{error}"));
        TracedOperand::new(&name, cell, &symbols.layout)
    });
    let watched: Vec<TracedOperand> = watched.collect();
    let mut trace = CsvTrace::new(&watched, Vec::new()).expect("a Vec takes all");
    run(engine_program, &plan, &mut trace).expect("a Vec takes all");
    String::from_utf8(trace.finish().expect("a Vec takes all")).expect("CSV is text")
}

#[test]
fn a_subroutine_called_once_equals_its_rungs_in_place() {
    let first = setting("RUNGD_PROPERTY_SEED", 1);
    let mut compared = 0;
    for seed in first..first + setting("RUNGD_PROPERTY_CALLS", 60) {
        let case = generate(seed);
        let Some(called) = with_subroutine(&case, &mut Rng::new(seed)) else { continue };
        let (in_place, by_call) = (trace(&case), trace(&called));
        let differs = in_place.lines().zip(by_call.lines()).find(|(a, b)| a != b);
        assert!(
            in_place == by_call,
            "seed {seed}: {differs:?}\n{}\n---\n{}\n{}",
            case.ladder(),
            called.ladder(),
            case.stimulus()
        );
        compared += 1;
    }
    assert!(compared > 20, "only {compared} programs had rungs to move");
}
