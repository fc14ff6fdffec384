//! Mutants of instructions on blocks and Stages.

use expect_test::expect;

use super::check;

const BLOCKS: &str = r#"
[[program]]
name = "Main"
rung = [
{ when = ["rise(X0)"], do = ["RESTART Fill"] },
{ when = ["X1"], do = ["ENTASK Log every=1s", "HALT Fill", "RUN Fill"] },
{ when = ["rise(X2)"], do = ["ENTASK Once"] },
]
[[program]]
name = "Fill"
[[program.rung]]
when = ["X7"]
do = ["EXIT"]
[[task]]
name = "Log"
rung = [{ when = ["$On"], do = ["MOVE 1 to=D0"] }]
[[task]]
name = "Once"
rung = [{ when = ["$On"], do = ["MOVE 2 to=D0"] }]
"#;

const STAGES: &str = r#"
[[program]]
name = "Main"
rung = [{ when = ["X0"], do = ["RUN Fill"] }]
[[program]]
name = "Fill"
[[program.stage]]
name = "Open"
[[program.stage.rung]]
when = ["$On"]
do = ["OUT Y0"]
[[program.stage.rung]]
when = ["X9"]
[[program.stage.rung.branch]]
when = ["X3"]
do = ["JMP Wait"]
[[program.stage]]
name = "Wait"
[[program.stage.rung]]
when = ["X4"]
do = ["SGDIVRG Open Left"]
[[program.stage.rung.branch]]
when = ["X5"]
do = ["SGSET Right", "SGRST Left"]
[[program.stage]]
name = "Left"
[[program.stage.rung]]
when = ["X6"]
do = ["SGCONVRG Left Right to=Open"]
[[program.stage]]
name = "Right"
[[program.stage.rung]]
when = ["X7"]
do = ["EXIT"]
"#;

#[test]
fn blocks_have_the_listed_mutants() {
    check(
        &[("ladder.toml", BLOCKS)],
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
              inverted: contact `rise(X0)` is `!rise(X0)`
              contact-out: contact `rise(X0)` is always ON
              other-edge: `rise(X0)` is `fall(X0)`
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              instruction-out: `ENTASK Log every=1s` left out
              number: every 1s is 1s100ms in `ENTASK Log every=1s`
              number: every 1s is 900ms in `ENTASK Log every=1s`
              instruction-out: `HALT Fill` left out
              instruction-out: `RUN Fill` left out
            Main, rung 3
              rung-out: the rung left out
              inverted: contact `rise(X2)` is `!rise(X2)`
              contact-out: contact `rise(X2)` is always ON
              other-edge: `rise(X2)` is `fall(X2)`
            Fill, rung 1
              rung-out: the rung left out
              inverted: contact `X7` is `!X7`
              contact-out: contact `X7` is always ON
            Log, rung 1
              rung-out: the rung left out
              number: 1 is 2 in `MOVE 1 to=D0`
              number: 1 is 0 in `MOVE 1 to=D0`
            Once, rung 1
              rung-out: the rung left out
              number: 2 is 3 in `MOVE 2 to=D0`
              number: 2 is 1 in `MOVE 2 to=D0`
        "#]],
    );
}

#[test]
fn stages_have_the_listed_mutants() {
    check(
        &[("ladder.toml", STAGES)],
        expect![[r#"
        Main, rung 1
          rung-out: the rung left out
          inverted: contact `X0` is `!X0`
          contact-out: contact `X0` is always ON
        Fill.Open, rung 1
          rung-out: the rung left out
          instruction: `OUT Y0` is `SET Y0`
        Fill.Open, rung 2
          rung-out: the rung left out
          inverted: contact `X9` is `!X9`
          contact-out: contact `X9` is always ON
        Fill.Open, rung 2, branch 1
          inverted: contact `X3` is `!X3`
          contact-out: contact `X3` is always ON
          stage: `Wait` is `Left` in `JMP Wait`
        Fill.Wait, rung 1
          rung-out: the rung left out
          inverted: contact `X4` is `!X4`
          contact-out: contact `X4` is always ON
          instruction-out: `SGDIVRG Open Left` left out
          stage: `Open` is `Wait` in `SGDIVRG Open Left`
          stage: `Left` is `Right` in `SGDIVRG Open Left`
        Fill.Wait, rung 1, branch 1
          inverted: contact `X5` is `!X5`
          contact-out: contact `X5` is always ON
          branch-out: the branch left out
          instruction-out: `SGSET Right` left out
          instruction-out: `SGRST Left` left out
        Fill.Left, rung 1
          rung-out: the rung left out
          inverted: contact `X6` is `!X6`
          contact-out: contact `X6` is always ON
          stage: `Open` is `Wait` in `SGCONVRG Left Right to=Open`
        Fill.Right, rung 1
          rung-out: the rung left out
          inverted: contact `X7` is `!X7`
          contact-out: contact `X7` is always ON
    "#]],
    );
}

const CALLS: &str = r#"
[[program]]
name = "Main"
rung = [
{ when = ["X0"], do = ["CALL Fill"] },
{ when = ["X1"], do = ["OUT Y1", "CALL Fill"] },
]
[[subroutine]]
name = "Fill"
rung = [
{ when = ["X2"], do = ["RETURN"] },
{ when = ["X3"], do = ["OUT Y0"] },
]
"#;

#[test]
fn calls_and_returns_are_left_out() {
    check(
        &[("ladder.toml", CALLS)],
        expect![[r#"
        Main, rung 1
          rung-out: the rung left out
          inverted: contact `X0` is `!X0`
          contact-out: contact `X0` is always ON
        Main, rung 2
          rung-out: the rung left out
          inverted: contact `X1` is `!X1`
          contact-out: contact `X1` is always ON
          instruction-out: `OUT Y1` left out
          instruction: `OUT Y1` is `SET Y1`
          instruction-out: `CALL Fill` left out
        Fill, rung 1
          rung-out: the rung left out
          inverted: contact `X2` is `!X2`
          contact-out: contact `X2` is always ON
        Fill, rung 2
          rung-out: the rung left out
          inverted: contact `X3` is `!X3`
          contact-out: contact `X3` is always ON
          instruction: `OUT Y0` is `SET Y0`
    "#]],
    );
}
