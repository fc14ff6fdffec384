//! An operand that the last scan wrote without a change: when and why it changed, then the reason
//! that it keeps its value.

use expect_test::expect;

use super::tape::{Tape, check, tape};
use crate::observe::{Limits, QuestionTime};
use rungd_engine::EngineCall;
use rungd_runtime::exchange::{Mode, StopReason, Ticket};
use rungd_runtime::{Origin, TapeEntry};

const SEALED: &str = r#"
    [[program.rung]]
    name = "run"
    when = ["start | motor", "!stop"]
    do = ["OUT motor"]
    [[program.rung]]
    name = "fan"
    when = ["motor"]
    do = ["OUT fan"]
    [tags]
    start = { at = "X0" }
    stop = { at = "X2" }
    motor = { at = "Y0" }
    fan = { at = "Y1" }
"#;

/// Started, stopped, and OFF since then.
fn stopped() -> Tape {
    let mut plc = tape(SEALED);
    plc.scans(5);
    plc.scan(&[("start", 1)]);
    plc.scan(&[("start", 0)]);
    plc.scans(10);
    plc.scan(&[("stop", 1)]);
    plc.scan(&[]);
    plc.scan(&[("stop", 0)]);
    plc.scans(30);
    plc
}

#[test]
fn the_answer_for_a_seal_in_names_what_dropped_it_and_what_keeps_it_off() {
    let plc = stopped();
    check(
        &plc,
        "motor",
        expect![[r#"
            motor (Y0) is OFF
              OUT motor turned it OFF 320 ms ago, in scan 17: Main, rung run, a.toml:7
                the rung was OFF, because
                  stop (X2) was ON
                    input X2 turned it ON 320 ms ago, in scan 17
              OUT motor keeps it OFF: Main, rung run, a.toml:7
                the rung is OFF, because
                  start (X0) is OFF
                    input X0 turned it OFF 430 ms ago, in scan 6
                  motor (Y0) is OFF (see above)
            start (X0) ON would turn it ON in the next scan
        "#]],
    );
    check(
        &plc,
        "fan",
        expect![[r#"
            fan (Y1) is OFF
              OUT fan turned it OFF 320 ms ago, in scan 17: Main, rung fan, a.toml:11
                the rung was OFF, because
                  motor (Y0) was OFF
                    OUT motor turned it OFF 320 ms ago, in scan 17: Main, rung run, a.toml:7
                      the rung was OFF, because
                        stop (X2) was ON
                          input X2 turned it ON 320 ms ago, in scan 17
              OUT fan keeps it OFF: Main, rung fan, a.toml:11
                the rung is OFF, because
                  motor (Y0) is OFF
                    OUT motor keeps it OFF: Main, rung run, a.toml:7
                      the rung is OFF, because
                        start (X0) is OFF
                          input X0 turned it OFF 430 ms ago, in scan 6
                        motor (Y0) is OFF (see above)
            start (X0) ON would turn it ON in the next scan
        "#]],
    );
    let json = plc.answer("motor", QuestionTime::Now).json();
    assert_eq!(json["changed"]["since"]["scan"], 17);
    assert_eq!(json["changed"]["from"], true);
    let contact = &json["changed"]["cause"]["legs"][0]["contacts"][0];
    assert_eq!(contact["place"]["text"], "stop");
}

#[test]
fn a_bit_read_by_a_rung_above_its_coil_is_explained_by_the_coil() {
    let mut plc = tape(
        r#"
        [[program.rung]]
        when = ["C0"]
        do = ["OUT Y0"]
        [[program.rung]]
        when = ["X0"]
        do = ["OUT C0"]
        "#,
    );
    plc.scans(3);
    plc.scan(&[("X0", 1)]);
    plc.scans(20);
    check(
        &plc,
        "Y0",
        expect![[r#"
        Y0 is ON
          OUT Y0 turned it ON 190 ms ago, in scan 4, and keeps it ON: Main, rung 1, a.toml:6
            the rung is ON, because
              C0 is ON
                OUT C0 turned it ON 200 ms ago, in scan 3: Main, rung 2, a.toml:9
                  the rung was ON, because
                    X0 was ON
                      input X0 turned it ON 200 ms ago, in scan 3
        one input is not enough to turn it OFF in the next scan (1 tried)
    "#]],
    );
}

#[test]
fn an_active_seal_in_is_explained_by_its_own_coil() {
    let mut plc = tape(SEALED);
    plc.scans(5);
    plc.scan(&[("start", 1)]);
    plc.scan(&[("start", 0)]);
    plc.scans(25);
    check(
        &plc,
        "motor",
        expect![[r#"
        motor (Y0) is ON
          OUT motor turned it ON 260 ms ago, in scan 5: Main, rung run, a.toml:7
            the rung was ON, because
              start (X0) was ON
                input X0 turned it ON 260 ms ago, in scan 5
              stop (X2) was OFF
                until then unchanged since rungd started: its initial value
          OUT motor keeps it ON: Main, rung run, a.toml:7
            the rung is ON, because
              motor (Y0) is ON (see above)
              stop (X2) is OFF (see above)
        stop (X2) ON would turn it OFF in the next scan
    "#]],
    );
    check(
        &plc,
        "fan",
        expect![[r#"
        fan (Y1) is ON
          OUT fan turned it ON 260 ms ago, in scan 5: Main, rung fan, a.toml:11
            the rung was ON, because
              motor (Y0) was ON
                OUT motor turned it ON 260 ms ago, in scan 5: Main, rung run, a.toml:7
                  the rung was ON, because
                    start (X0) was ON
                      input X0 turned it ON 260 ms ago, in scan 5
                    stop (X2) was OFF
                      until then unchanged since rungd started: its initial value
          OUT fan keeps it ON: Main, rung fan, a.toml:11
            the rung is ON, because
              motor (Y0) is ON
                OUT motor keeps it ON: Main, rung run, a.toml:7
                  the rung is ON, because
                    motor (Y0) is ON (see above)
                    stop (X2) is OFF (see above)
        stop (X2) ON would turn it OFF in the next scan
    "#]],
    );
}

#[test]
fn a_contact_that_is_the_cause_is_always_shown() {
    let mut plc = tape(
        r#"
        [[program.rung]]
        when = ["X3"]
        do = ["OUT C2"]
        [[program.rung]]
        when = ["X0 | C0", "!C2"]
        do = ["OUT C0"]
        [[program.rung]]
        when = ["C0"]
        do = ["OUT Y0"]
        "#,
    );
    plc.scan(&[("X0", 1)]);
    plc.scan(&[("X0", 0)]);
    plc.scans(5);
    plc.scan(&[("X3", 1)]);
    plc.scans(12);
    check(
        &plc,
        "Y0",
        expect![[r#"
        Y0 is OFF
          OUT Y0 turned it OFF 120 ms ago, in scan 7: Main, rung 3, a.toml:12
            the rung was OFF, because
              C0 was OFF
                OUT C0 turned it OFF 120 ms ago, in scan 7: Main, rung 2, a.toml:9
                  the rung was OFF, because
                    C2 was ON
                      OUT C2 turned it ON 120 ms ago, in scan 7: Main, rung 1, a.toml:6
                        the rung was ON, because
                          X3 was ON
                            input X3 turned it ON 120 ms ago, in scan 7
          OUT Y0 keeps it OFF: Main, rung 3, a.toml:12
            the rung is OFF, because
              C0 is OFF
                OUT C0 keeps it OFF: Main, rung 2, a.toml:9
                  the rung is OFF, because
                    X0 is OFF
                      input X0 turned it OFF 180 ms ago, in scan 1
                    C0 is OFF (see above)
                    also ON: C2 (see above)
        X0 ON and X3 OFF would turn it ON in the next scan
    "#]],
    );
}

#[test]
fn a_released_force_is_shown_as_a_change() {
    let mut plc = tape("[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"OUT Y0\"]\n");
    plc.scans(4);
    plc.force("Y0", 1, "root (uid 0)");
    plc.scans(12);
    plc.release("Y0");
    plc.scan(&[("X0", 1)]);
    check(
        &plc,
        "Y0",
        expect![[r#"
        Y0 is ON
          a force by root (uid 0) turned it ON 130 ms ago, in scan 3
          OUT Y0 keeps it ON: Main, rung 1, a.toml:5
            the rung is ON, because
              X0 is ON
                input X0 turned it ON in this scan
        X0 OFF would turn it OFF in the next scan
    "#]],
    );
}

#[test]
fn equal_reasons_are_shown_only_once() {
    let mut plc = tape("[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"OUT Y0\", \"MOVE 7 to=D0\"]\n");
    plc.scan(&[("X0", 1)]);
    plc.scans(3);
    plc.scan(&[("X0", 0)]);
    plc.scans(20);
    check(
        &plc,
        "Y0",
        expect![[r#"
            Y0 is OFF
              OUT Y0 turned it OFF 200 ms ago, in scan 4, and keeps it OFF: Main, rung 1, a.toml:5
                the rung is OFF, because
                  X0 is OFF
                    input X0 turned it OFF 200 ms ago, in scan 4
            X0 ON would turn it ON in the next scan
        "#]],
    );
    plc.scan(&[("X0", 1)]);
    plc.scans(4);
    check(
        &plc,
        "D0",
        expect![[r#"
            D0 is 7
              MOVE 7 to=D0 keeps it at 7, unchanged for 290 ms, since scan 0: Main, rung 1, a.toml:5
                the rung is ON, because
                  X0 is ON
                    input X0 turned it ON 40 ms ago, in scan 25
        "#]],
    );
    assert!(plc.answer("Y0", QuestionTime::Scan(4)).changed.is_none());
}

#[test]
fn an_answer_without_the_change_option_has_no_change() {
    let plc = stopped();
    let limits = Limits { change: false, ..Limits::default() };
    let answer = plc.limited("motor", limits);
    assert!(answer.changed.is_none() && answer.change.is_none());
}

#[test]
fn compares_and_edges_show_their_operands_and_values() {
    let mut plc = tape(
        r#"
        [[program.rung]]
        when = ["level >= least", "level < full", "rise(X0 & !X1)", "rise(X1)"]
        do = ["OUT Y0"]
        [tags]
        full = { value = 500 }
        level = { at = "D0" }
        least = { at = "D1" }
        "#,
    );
    plc.scan(&[("level", 200), ("least", 100), ("X0", 1)]);
    plc.scans(3);
    check(
        &plc,
        "Y0",
        expect![[r#"
        Y0 is OFF
          OUT Y0 keeps it OFF, unchanged since rungd started: Main, rung 1, a.toml:6
            the rung is OFF, because
              rise(X0 & !X1) is OFF; last ON 30 ms ago, in scan 0
                inside: X0 & !X1 is ON, because
                  X0 is ON
                    input X0 turned it ON 30 ms ago, in scan 0
                  X1 is OFF
                    unchanged since rungd started: its initial value
              also OFF: rise(X1); never ON since rungd started
                inside: X1 is OFF (see above)
        one input is not enough to turn it ON in the next scan (2 tried), nor two or three (1 tried)
        "#]],
    );
    plc.scan(&[("level", 80)]);
    check(
        &plc,
        "Y0",
        expect![[r#"
    Y0 is OFF
      OUT Y0 keeps it OFF, unchanged since rungd started: Main, rung 1, a.toml:6
        the rung is OFF, because
          level >= least is OFF: level = 80, least = 100
            level (D0) is 80
              input D0 made it 80 in this scan
            least (D1) is 100
              input D1 made it 100 40 ms ago, in scan 0
          also OFF: rise(X0 & !X1); last ON 40 ms ago, in scan 0
            inside: X0 & !X1 is ON, because
              X0 is ON
                input X0 turned it ON 40 ms ago, in scan 0
              X1 is OFF
                unchanged since rungd started: its initial value
          also OFF: rise(X1); never ON since rungd started
            inside: X1 is OFF (see above)
    one input is not enough to turn it ON in the next scan (8 tried), nor two or three (84 tried)
    "#]],
    );
}

#[test]
fn a_done_timer_is_shown_as_done() {
    let mut plc = tape("[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"TMR T0 preset=2s\"]\n");
    plc.scans(3);
    check(
        &plc,
        "T0.Done",
        expect![[r#"
            T0.Done is OFF
              TMR T0 preset=2s keeps it OFF, unchanged since rungd started: Main, rung 1, a.toml:5
              0 ms of 2 s, not timing
                the rung is OFF, because
                  X0 is OFF
                    unchanged since rungd started: its initial value
            one input is not enough to turn it ON in the next scan (1 tried)
        "#]],
    );
    plc.scan(&[("X0", 1)]);
    plc.scans(230);
    check(
        &plc,
        "T0.Done",
        expect![[r#"
    T0.Done is ON
      TMR T0 preset=2s turned it ON 300 ms ago, in scan 203, and keeps it ON: Main, rung 1, a.toml:5
      done for 300 ms, since scan 203: 2.3 s of 2 s
        the rung is ON, because
          X0 is ON
            input X0 turned it ON 2.3 s ago, in scan 3
    X0 OFF would turn it OFF in the next scan
    "#]],
    );
}

#[test]
fn writes_are_shown_with_their_users() {
    let mut plc = tape(SEALED);
    plc.scans(3);
    plc.begin();
    plc.from(Origin::Batch(Ticket(4)), "root (uid 0)");
    let cell = plc.cell("stop");
    plc.write(cell, 1);
    plc.execute();
    plc.scans(8);
    check(
        &plc,
        "stop",
        expect![[r#"
        stop (X2) is ON
          root (uid 0) wrote ON 80 ms ago, in scan 3
        nothing in the ladder writes it
    "#]],
    );
}

#[test]
fn an_answer_in_stop_names_the_mode_and_its_reason() {
    let mut plc = stopped();
    plc.call(EngineCall::RequestStop);
    plc.scan(&[]);
    plc.call(EngineCall::Terminate);
    plc.entry(TapeEntry::Mode(Mode::Stop(StopReason::Operator)));
    let text = plc.why("motor");
    let last = text.lines().last().expect("a line");
    expect![
        "the controller is in STOP since scan 50 (an operator requested it): no scan changes it"
    ]
    .assert_eq(last);
}

#[test]
fn a_truncated_answer_names_the_depth_that_shows_more() {
    let mut plc = tape(
        r#"
        [[program.rung]]
        when = ["C1", "C2"]
        do = ["OUT C0"]
        [[program.rung]]
        when = ["C2"]
        do = ["OUT C1"]
        [[program.rung]]
        when = ["X0"]
        do = ["OUT C2"]
        "#,
    );
    plc.scans(3);
    let at = |depth| plc.limited("C0", Limits { depth, ..Limits::default() });
    for depth in 0..6 {
        let answer = at(depth);
        let text = answer.text();
        assert_eq!(answer.deeper.is_some(), text.contains('…'), "{text}");
        let Some(deeper) = answer.deeper else { continue };
        assert_eq!(answer.hints(), format!("…: more with --depth {deeper}\n"));
        let more = at(deeper).text();
        for cut in text.lines().filter(|line| line.ends_with('…')) {
            assert!(!more.lines().any(|line| line == cut), "depth {depth}:\n{text}\n{more}");
        }
    }
    assert_eq!((at(0).deeper, at(5).deeper), (Some(3), None));
    let few = plc.limited("C0", Limits { nodes: 1, ..Limits::default() });
    assert!(few.is_long && few.hints().contains("too long"), "{}", few.text());
}
