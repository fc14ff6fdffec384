//! A program that judges itself does the same as without judges, and its bits have the values of
//! the conditions.

use super::bench::{Asked, model};
use rungd_prove::model::{Run, ScanOutcome};

const LATCH: &str = r#"
[[program]]
name = "Main"
[[program.rung]]
when = ["X0"]
do   = ["SET C0"]
[[program.rung]]
when = ["X1"]
do   = ["RST C0"]
[[program.rung]]
when = ["C0"]
do   = ["OUT Y0"]
"#;

#[test]
fn an_assumption_is_judged_behind_the_inputs_and_before_the_rungs() {
    let asked = Asked {
        ladder: LATCH,
        inputs: &["X0", "X1"],
        assume: &["!(X0 & X1)", "!X1 | Y0"],
        judged: &["!Y0", "rise(Y0)", "!(Y0 & X1)"],
    };
    let model = model(asked);
    let mut run = Run::new(&model);
    let outcome = |is_allowed, judged: [bool; 3]| ScanOutcome {
        is_allowed,
        judged: judged.to_vec(),
        is_last: false,
    };
    assert_eq!(run.scan(&[0, 0]), outcome(true, [true, false, true]));
    assert_eq!(run.scan(&[1, 0]), outcome(true, [false, true, true]));
    assert_eq!(run.scan(&[0, 1]), outcome(true, [true, false, true]));
    assert_eq!(run.scan(&[0, 1]), outcome(false, [true, false, true]));
    assert_eq!(run.scan(&[1, 1]), outcome(false, [true, false, true]));
}
