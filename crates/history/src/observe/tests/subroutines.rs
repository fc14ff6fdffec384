//! Subroutines: an answer names the CALLs, and the power is of the last execution.

use expect_test::expect;

use super::tape::{Tape, check, tape};

const NESTED: &str = r#"
rung = [ { when = ["X0"], do = ["CALL Outer"] } ]
[[program]]
name = "P"
autostart = true
rung = [ { when = ["X3"], do = ["HALT P"] }, { when = ["X4"], do = ["CALL Inner"] } ]
[[subroutine]]
name = "Outer"
rung = [ { when = ["X1"], do = ["CALL Inner"] } ]
[[subroutine]]
name = "Inner"
rung = [ { when = ["X2"], do = ["RETURN"] }, { when = ["$On"], do = ["OUT Y0"] } ]
"#;

fn nested(inputs: &[(&str, i32)]) -> Tape {
    let mut plc = tape(NESTED);
    plc.scan(inputs);
    plc.scans(3);
    plc
}

#[test]
fn an_answer_names_the_chain_of_calls() {
    check(
        &nested(&[("X0", 1), ("X1", 1)]),
        "Y0",
        expect![[r#"
        Y0 is ON
          OUT Y0 turned it ON 30 ms ago, in scan 0, and keeps it ON: Inner, rung 2, a.toml:14
            by CALL Inner: Outer, rung 1, a.toml:11
            by CALL Outer: Main, rung 1, a.toml:4
            the rung is ON, because
              $On is ON
        one input is not enough to turn it OFF in the next scan (5 tried)
    "#]],
    );
}

#[test]
fn a_subroutine_that_is_not_called_is_explained_by_its_calls() {
    check(
        &nested(&[("X0", 1)]),
        "Y0",
        expect![[r#"
        Y0 is OFF
          unchanged since rungd started: its initial value
          CALL Inner could change it, but does not: P, rung 2, a.toml:8
            the rung is OFF, because
              X4 is OFF
                unchanged since rungd started: its initial value
          CALL Inner could change it, but does not: Outer, rung 1, a.toml:11
            the rung is OFF, because
              X1 is OFF
                unchanged since rungd started: its initial value
        X4 ON would turn it ON in the next scan
    "#]],
    );
}

#[test]
fn a_subroutine_ends_with_the_block_that_executed_it_last() {
    let mut plc = nested(&[("X4", 1)]);
    plc.scan(&[("X3", 1)]);
    plc.scan(&[]);
    check(
        &plc,
        "Y0",
        expect![[r#"
        Y0 is OFF
          Inner was stopped, which turned it OFF in this scan: OUT Y0, Inner, rung 2, a.toml:14
            because P.Running is OFF
              HALT P turned it OFF 10 ms ago, in scan 4: P, rung 1, a.toml:8
                the rung was ON, because
                  X3 was ON
                    input X3 turned it ON 10 ms ago, in scan 4
        X3 OFF and RUN P would turn it ON in the next scan
    "#]],
    );
}
