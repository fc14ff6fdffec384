//! Blocks and Stages: passes, turns, and blocks and Stages that do not run.

use expect_test::expect;

use super::tape::{check, ladder, tape};
use rungd_engine::EngineCall;

const SIDE: &str = r#"
    [[program.rung]]
    when = ["X0"]
    do = ["RUN Side"]
    [[program.rung]]
    when = ["X1"]
    do = ["HALT Side"]
    [[program.rung]]
    when = ["X2"]
    do = ["RESTART Side"]
    [[program]]
    name = "Side"
    [[program.rung]]
    when = ["$On"]
    do = ["OUT Y0"]
    [[program.stage]]
    name = "A"
    [[program.stage.rung]]
    when = ["X3"]
    do = ["JMP B"]
    [[program.stage.rung]]
    when = ["$On"]
    do = ["OUT Y1"]
    [[program.stage]]
    name = "B"
    [[program.stage.rung]]
    when = ["X4"]
    do = ["EXIT"]
"#;

#[test]
fn the_answer_for_a_bit_of_a_block_that_never_ran_names_the_block_to_start() {
    let mut plc = tape(SIDE);
    plc.scans(3);
    check(
        &plc,
        "Y0",
        expect![[r#"
            Y0 is OFF
              unchanged since rungd started: its initial value
              OUT Y0 does not execute (Side, rung 1, a.toml:17), because Side.Running is OFF
                unchanged since rungd started: its initial value
                RUN Side could change it, but does not: Main, rung 1, a.toml:6
                  the rung is OFF, because
                    X0 is OFF
                      unchanged since rungd started: its initial value
                RESTART Side could change it, but does not: Main, rung 3, a.toml:12
                  the rung is OFF, because
                    X2 is OFF
                      unchanged since rungd started: its initial value
            X0 ON would turn it ON in the next scan
        "#]],
    );
}

#[test]
fn a_termination_pass_is_explained_by_the_instruction_that_stopped_the_block() {
    let mut plc = tape(SIDE);
    plc.scan(&[("X0", 1)]);
    plc.scan(&[("X0", 0)]);
    plc.scans(5);
    plc.scan(&[("X1", 1)]);
    plc.scans(15);
    check(
        &plc,
        "Y0",
        expect![[r#"
    Y0 is OFF
      Side was stopped, which turned it OFF 150 ms ago, in scan 7: OUT Y0, Side, rung 1, a.toml:17
        because Side.Running was OFF
          HALT Side turned it OFF 150 ms ago, in scan 7: Main, rung 2, a.toml:9
            the rung was ON, because
              X1 was ON
                input X1 turned it ON 150 ms ago, in scan 7
      OUT Y0 does not execute (Side, rung 1, a.toml:17), because Side.Running is OFF (see above)
    X2 ON would turn it ON in the next scan
    "#]],
    );
}

#[test]
fn a_termination_pass_of_a_stage_is_explained_by_the_jump() {
    let mut plc = tape(SIDE);
    plc.scan(&[("X0", 1)]);
    plc.scan(&[("X3", 1)]);
    plc.scans(3);
    check(
        &plc,
        "Y1",
        expect![[r#"
Y1 is OFF
  Side.A was stopped, which turned it OFF 20 ms ago, in scan 2: OUT Y1, Side.A, rung 2, a.toml:25
    because Side.A was OFF
      JMP B turned it OFF 30 ms ago, in scan 1: Side.A, rung 1, a.toml:22
        the rung was ON, because
          X3 was ON
            input X3 turned it ON 30 ms ago, in scan 1
  OUT Y1 does not execute (Side.A, rung 2, a.toml:25), because Side.A is OFF (see above)
X2 ON would turn it ON in the next scan
"#]],
    );
    check(
        &plc,
        "Side.B",
        expect![[r#"
            Side.B is ON
              JMP B turned it ON 30 ms ago, in scan 1: Side.A, rung 1, a.toml:22
                the rung was ON, because
                  X3 was ON
                    input X3 turned it ON 30 ms ago, in scan 1
            X1 ON would turn it OFF in the next scan
        "#]],
    );
}

#[test]
fn a_restart_is_shown_as_a_stop_and_a_start_in_one_scan() {
    let mut plc = tape(SIDE);
    plc.scan(&[("X0", 1)]);
    plc.scan(&[("X0", 0), ("X3", 1)]);
    plc.scan(&[("X3", 0)]);
    plc.scan(&[("X2", 1)]);
    check(
        &plc,
        "Side.A",
        expect![[r#"
            Side.A is ON
              the restart of Side turned it ON in this scan: a.toml:14
                because of RESTART Side in this scan: Main, rung 3, a.toml:12
                  the rung is ON, because
                    X2 is ON
                      input X2 turned it ON in this scan
            X1 ON would turn it OFF in the next scan
        "#]],
    );
    check(
        &plc,
        "Side.B",
        expect![[r#"
            Side.B is OFF
              the restart of Side turned it OFF in this scan: a.toml:14
                because of RESTART Side in this scan: Main, rung 3, a.toml:12
                  the rung is ON, because
                    X2 is ON
                      input X2 turned it ON in this scan
            X3 ON would turn it ON in the next scan
        "#]],
    );
}

#[test]
fn a_bit_turned_off_by_a_controller_stop_is_explained_by_the_stop() {
    let mut plc = tape(SIDE);
    plc.scan(&[("X0", 1)]);
    plc.scans(3);
    plc.call(EngineCall::RequestStop);
    plc.scan(&[]);
    plc.call(EngineCall::Terminate);
    check(
        &plc,
        "Y0",
        expect![[r#"
        Y0 is OFF
          the controller stopped, which turned it OFF in this scan: OUT Y0, Side, rung 1, a.toml:17
        the controller does not scan: it stays
        "#]],
    );
    check(
        &plc,
        "Side.Running",
        expect![[r#"
            Side.Running is OFF
              the controller turned it OFF in this scan
            the controller does not scan: it stays
        "#]],
    );
}

#[test]
fn memory_has_its_initial_values_before_the_start() {
    let text = r#"
        [tags]
        size = { at = "D0", initial = 12, doc = "Parts in a crate" }
        [[program]]
        name = "Main"
        [[program.rung]]
        when = ["X0"]
        do = ["ADD size 1 to=size"]
    "#;
    check(
        &ladder(text),
        "size",
        expect![[r#"
        size (D0) is 12
          (Parts in a crate)
          unchanged since rungd started: its initial value
          ADD size 1 to=size does not execute (Main, rung 1, a.toml:8), because Main.Running is OFF
            unchanged since rungd started: its initial value
        "#]],
    );
    check(
        &ladder(text),
        "Main.Running",
        expect![[r#"
            Main.Running is OFF
              unchanged since rungd started: its initial value
            no input turns it ON in the next scan
        "#]],
    );
}
