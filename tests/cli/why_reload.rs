//! `rungd why` on a recording with reloads: the answer goes on behind them.

use crate::cli::replay::{Line, Place};
use expect_test::{Expect, expect};
use serde_json::Value;

const LADDER: &str = r#"[tags]
start = { at = "X0" }
stop  = { at = "X1" }
ready = { at = "C0" }
motor = { at = "Y0" }
horn  = { at = "Y1" }

[[program]]
name = "Main"

[[program.rung]]
name = "ready"
when = ["start"]
do   = ["SET ready"]

[[program.rung]]
name = "motor"
when = ["ready", "!stop"]
do   = ["OUT motor"]

[[program.rung]]
name = "horn"
when = ["stop"]
do   = ["OUT horn"]
"#;

/// A controller whose horn is edited twice: `ready` and `motor` changed before both reloads.
fn recording(place: &Place) {
    let ladders = [
        LADDER.to_owned(),
        LADDER.replace(r#"when = ["stop"]"#, r#"when = ["!ready"]"#),
        LADDER.replace(r#"when = ["stop"]"#, r#"when = ["start"]"#),
    ];
    let mut line = Line::new(&ladders[0]);
    line.scan(&[("start", 1)]);
    line.scan(&[("start", 0)]);
    for generation in 1..3 {
        (0..150).for_each(|_| assert!(!line.scan(&[])));
        line.reload(&ladders[generation - 1], &ladders[generation], generation as u32);
    }
    (0..150).for_each(|_| assert!(!line.scan(&[])));
    place.write("plant.rungd-log", &line.bytes());
}

#[track_caller]
fn check(place: &Place, operand: &str, expected: Expect) {
    let output = place.rungd(&["why", operand, "--recording", "plant.rungd-log"]);
    assert!(output.status.success(), "{output:?}");
    expected.assert_eq(&String::from_utf8(output.stdout).unwrap());
}

#[test]
fn an_answer_continues_across_reloads() {
    let place = Place::new("why_reload");
    recording(&place);
    check(
        &place,
        "ready",
        expect![[r#"
        ready (C0) is ON
          before the program was reloaded, after scan 152:
            SET ready turned it ON 4.5 s ago, in scan 1: Main, rung ready, main.toml:14
              the rung was ON, because
                start (X0) was ON
                  input X0 turned it ON 4.5 s ago, in scan 1
        one input is not enough to turn it OFF in the next scan (1 tried)
    "#]],
    );
    check(
        &place,
        "motor",
        expect![[r#"
            motor (Y0) is ON
              OUT motor keeps it ON, unchanged since the program was reloaded, after scan 302: Main, rung motor, main.toml:19
                the rung is ON, because
                  ready (C0) is ON
                    before the program was reloaded, after scan 152:
                      SET ready turned it ON 4.5 s ago, in scan 1: Main, rung ready, main.toml:14
                        the rung was ON, because
                          start (X0) was ON
                            input X0 turned it ON 4.5 s ago, in scan 1
                  stop (X1) is OFF
                    before the program was reloaded, after scan 152:
                      until then unchanged since rungd started: its initial value
              before the program was reloaded, after scan 152:
                OUT motor turned it ON 4.5 s ago, in scan 1, and kept it ON: Main, rung motor, main.toml:19
                  the rung was ON, because
                    ready (C0) was ON (see above)
                    stop (X1) was OFF (see above)
            stop (X1) ON would turn it OFF in the next scan
        "#]],
    );
    check(
        &place,
        "horn",
        expect![[r#"
        horn (Y1) is OFF
          OUT horn keeps it OFF, unchanged since the program was reloaded, after scan 302: Main, rung horn, main.toml:24
            the rung is OFF, because
              start (X0) is OFF
                before the program was reloaded, after scan 152:
                  input X0 turned it OFF 4.5 s ago, in scan 2
          before the program was reloaded, after scan 152:
            OUT horn kept it OFF, unchanged since rungd started: Main, rung horn, main.toml:24
              the rung was OFF, because
                stop (X1) was OFF
                  until then unchanged since rungd started: its initial value
        start (X0) ON would turn it ON in the next scan
    "#]],
    );
}

#[test]
fn the_json_answer_contains_the_earlier_programs() {
    let place = Place::new("why_reload_json");
    recording(&place);
    let output = place.rungd(&["why", "ready", "--json", "--recording", "plant.rungd-log"]);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let write = &json["operand"]["earlier"]["operand"]["earlier"]["operand"]["write"];
    assert_eq!(
        (&write["cause"]["rung"]["name"], &write["since"]["scan"]),
        (&"ready".into(), &1.into())
    );
}
