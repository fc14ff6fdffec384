//! The kinds of writers: instructions by their rule, inputs, writes, devices, forces, memory.

use expect_test::expect;

use super::tape::{Tape, check, tape};
use crate::observe::QuestionTime;
use rungd_runtime::Origin;
use rungd_runtime::command::CommandId;
use rungd_runtime::exchange::Ticket;

fn rung(when: &str, text: &str) -> Tape {
    tape(&format!("[[program.rung]]\nwhen = [{when}]\ndo = [{text}]\n"))
}

#[test]
fn the_answer_for_a_coil_names_the_contacts_and_inputs_that_decide_it() {
    let mut plc = rung(r#""X0", "!X1 | X2", "X3""#, r#""OUT Y0""#);
    plc.scan(&[("X1", 1)]);
    plc.scans(25);
    check(
        &plc,
        "Y0",
        expect![[r#"
            Y0 is OFF
              OUT Y0 keeps it OFF, unchanged since rungd started: Main, rung 1, a.toml:5
                the rung is OFF, because
                  X0 is OFF
                    unchanged since rungd started: its initial value
                  also ON: X1
                    input X1 turned it ON 250 ms ago, in scan 0
                  also OFF: X2
                    unchanged since rungd started: its initial value
                  also OFF: X3
                    unchanged since rungd started: its initial value
            X0 ON and X1 OFF and X3 ON would turn it ON in the next scan
        "#]],
    );
    plc.scan(&[("X0", 1), ("X2", 1), ("X3", 1)]);
    check(
        &plc,
        "Y0",
        expect![[r#"
            Y0 is ON
              OUT Y0 turned it ON in this scan: Main, rung 1, a.toml:5
                the rung is ON, because
                  X0 is ON
                    input X0 turned it ON in this scan
                  X2 is ON
                    input X2 turned it ON in this scan
                  X3 is ON
                    input X3 turned it ON in this scan
            X0 OFF would turn it OFF in the next scan
        "#]],
    );
}

#[test]
fn a_set_bit_is_explained_before_and_after_set_has_acted() {
    let mut plc = tape(
        r#"
        [[program.rung]]
        name = "on"
        when = ["X0"]
        do = ["SET C0"]
        [[program.rung]]
        name = "off"
        when = ["X1"]
        do = ["RST C0"]
        "#,
    );
    plc.scans(3);
    check(
        &plc,
        "C0",
        expect![[r#"
            C0 is OFF
              unchanged since rungd started: its initial value
              SET C0 could change it, but does not: Main, rung on, a.toml:7
                the rung is OFF, because
                  X0 is OFF
                    unchanged since rungd started: its initial value
            X0 ON would turn it ON in the next scan
        "#]],
    );
    plc.scan(&[("X0", 1)]);
    plc.scan(&[("X0", 0)]);
    plc.scans(30);
    check(
        &plc,
        "C0",
        expect![[r#"
            C0 is ON
              SET C0 turned it ON 310 ms ago, in scan 3: Main, rung on, a.toml:7
                the rung was ON, because
                  X0 was ON
                    input X0 turned it ON 310 ms ago, in scan 3
              RST C0 could change it, but does not: Main, rung off, a.toml:11
                the rung is OFF, because
                  X1 is OFF
                    unchanged since rungd started: its initial value
            X1 ON would turn it OFF in the next scan
        "#]],
    );
}

#[test]
fn two_writes_in_one_scan_that_restore_the_value_are_found() {
    let mut plc = tape(
        r#"
        [[program.rung]]
        when = ["X0"]
        do = ["RST C0"]
        [[program.rung]]
        when = ["X0"]
        do = ["SET C0"]
        [[program.rung]]
        when = ["C1"]
        do = ["SET C0"]
        "#,
    );
    plc.scan(&[("C1", 1)]);
    plc.scan(&[("C1", 0)]);
    plc.scans(15);
    plc.scan(&[("X0", 1)]);
    plc.scan(&[("X0", 0)]);
    plc.scans(15);
    check(
        &plc,
        "C0",
        expect![[r#"
            C0 is ON
              SET C0 turned it ON 160 ms ago, in scan 17: Main, rung 2, a.toml:9
                the rung was ON, because
                  X0 was ON
                    input X0 turned it ON 160 ms ago, in scan 17
              RST C0 could change it, but does not: Main, rung 1, a.toml:6
                the rung is OFF, because
                  X0 is OFF
                    input X0 turned it OFF 150 ms ago, in scan 18
            one input is not enough to turn it OFF in the next scan (2 tried)
        "#]],
    );
}

#[test]
fn the_answer_for_a_counter_shows_its_last_count_and_reset() {
    let mut plc = tape(
        r#"
        [[program.rung]]
        leg.up = ["X0"]
        leg.rst = ["X1"]
        do = ["CNT CT0 preset=3"]
        "#,
    );
    plc.scan(&[("X1", 1)]);
    plc.scan(&[("X1", 0)]);
    plc.scans(4);
    plc.scan(&[("X0", 1)]);
    plc.scans(20);
    check(
        &plc,
        "CT0.Done",
        expect![[r#"
        CT0.Done is OFF
          CNT CT0 preset=3 keeps it OFF, unchanged since rungd started: Main, rung 1, a.toml:7
          1 of 3, last counted 200 ms ago, in scan 6, last reset 260 ms ago, in scan 0
            up is ON, because
              X0 is ON
                input X0 turned it ON 200 ms ago, in scan 6
            rst is OFF, because
              X1 is OFF
                input X1 turned it OFF 250 ms ago, in scan 1
        one input is not enough to turn it ON in the next scan (2 tried), nor two or three (1 tried)
        "#]],
    );
}

#[test]
fn the_answer_for_a_timer_shows_its_time_and_its_start() {
    let mut plc = rung(r#""X0""#, r#""TMR T0 preset=2s""#);
    plc.scans(3);
    plc.scan(&[("X0", 1)]);
    plc.scans(120);
    check(
        &plc,
        "T0.Done",
        expect![[r#"
            T0.Done is OFF
              TMR T0 preset=2s keeps it OFF, unchanged since rungd started: Main, rung 1, a.toml:5
              1.2 s of 2 s, timing for 1.2 s, since scan 3
                the rung is ON, because
                  X0 is ON
                    input X0 turned it ON 1.2 s ago, in scan 3
            one input is not enough to turn it ON in the next scan (1 tried)
        "#]],
    );
}

#[test]
fn the_answer_for_a_word_names_the_operands_of_its_value() {
    let mut plc = tape(
        r#"
        [[program.rung]]
        when = ["D0 >= 3", "rise(X0)"]
        do = ["ADD D0 D1 to=D2"]
        "#,
    );
    plc.from(Origin::Batch(Ticket(7)), "Modbus client 10.0.0.7");
    plc.scan(&[("D0", 5), ("D1", 2), ("X0", 1)]);
    plc.scans(14);
    check(
        &plc,
        "D2",
        expect![[r#"
            D2 is 7
              ADD D0 D1 to=D2 made it 7 140 ms ago, in scan 0: Main, rung 1, a.toml:6
                the rung was ON, because
                  D0 >= 3 was ON: D0 = 5
                    D0 was 5
                      input D0 made it 5 140 ms ago, in scan 0
                  rise(X0) was ON
                    inside: X0 was ON
                      input X0 turned it ON 140 ms ago, in scan 0
                with D0 = 5 (see above)
                with D1 = 2
                  input D1 made it 2 140 ms ago, in scan 0
              ADD D0 D1 to=D2 could change it, but does not: Main, rung 1, a.toml:6
                the rung is OFF, because
                  rise(X0) is OFF; last ON 140 ms ago, in scan 0
                    inside: X0 is ON (see above)
        "#]],
    );
}

#[test]
fn forces_and_writes_are_shown_with_their_users() {
    let mut plc = rung(r#""X0""#, r#""OUT Y0""#);
    plc.scans(4);
    plc.force("Y0", 1, "root");
    plc.scans(12);
    check(
        &plc,
        "Y0",
        expect![[r#"
            Y0 is ON
              forced to ON by root since scan 3, 120 ms ago
            it is forced: only a release lets it change
        "#]],
    );
    let cell = plc.cell("X0");
    plc.begin();
    plc.from(Origin::Device(0), "rack");
    plc.write(cell, 1);
    plc.execute();
    plc.scans(3);
    check(
        &plc,
        "X0",
        expect![[r#"
            X0 is ON
              device rack turned it ON 30 ms ago, in scan 16
            nothing in the ladder writes it
        "#]],
    );
    plc.from(Origin::Command(CommandId(3)), "anna");
    plc.release("Y0");
    plc.scan(&[]);
    check(
        &plc,
        "Y0",
        expect![[r#"
            Y0 is ON
              a force by root turned it ON 170 ms ago, in scan 3
              OUT Y0 keeps it ON: Main, rung 1, a.toml:5
                the rung is ON, because
                  X0 is ON
                    device rack turned it ON 40 ms ago, in scan 16
            X0 OFF would turn it OFF in the next scan
        "#]],
    );
}

#[test]
fn a_rung_is_explained_by_the_values_at_its_execution() {
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
    plc.scans(12);
    plc.scan(&[("X0", 1)]);
    check(
        &plc,
        "Y0",
        expect![[r#"
            Y0 is OFF
              OUT Y0 keeps it OFF, unchanged since rungd started: Main, rung 1, a.toml:6
                the rung is OFF, because
                  C0 is OFF
                    unchanged since rungd started: its initial value
            it turns ON in the next scan by itself
        "#]],
    );
    let text = plc.answer("Y0", QuestionTime::Scan(3)).text();
    assert!(text.starts_with("Y0 is OFF\n"), "{text}");
}

#[test]
fn two_inputs_are_found_if_neither_alone_is_sufficient() {
    let mut plc = rung(r#""X0", "X1""#, r#""OUT Y0""#);
    plc.scans(2);
    check(
        &plc,
        "Y0",
        expect![[r#"
            Y0 is OFF
              OUT Y0 keeps it OFF, unchanged since rungd started: Main, rung 1, a.toml:5
                the rung is OFF, because
                  X0 is OFF
                    unchanged since rungd started: its initial value
                  also OFF: X1
                    unchanged since rungd started: its initial value
            X0 ON and X1 ON would turn it ON in the next scan
        "#]],
    );
}

#[test]
fn indexed_elements_are_shown_with_their_index() {
    let mut plc = tape(
        r#"
        [[program.rung]]
        when = ["bits[D0]"]
        do = ["MOVE D1 to=row[D0]"]
        [tags]
        bits = { at = "C0", count = 4 }
        row = { at = "D10", count = 4 }
        "#,
    );
    plc.scan(&[("D0", 2), ("D1", 9), ("C2", 1)]);
    plc.scan(&[("D0", 1)]);
    plc.scans(3);
    check(
        &plc,
        "D12",
        expect![[r#"
            row[2] (D12) is 9
              MOVE D1 to=row[D0] made it 9 40 ms ago, in scan 0: Main, rung 1, a.toml:6
                the rung was ON, because
                  bits[D0] (bits[2]) was ON
                    input C2 turned it ON 40 ms ago, in scan 0
                    with D0 = 2
                      input D0 made it 2 40 ms ago, in scan 0
                with D1 = 9
                  input D1 made it 9 40 ms ago, in scan 0
                with D0 = 2 (see above)
              MOVE D1 to=row[D0] could change it, but does not: Main, rung 1, a.toml:6
                the rung is OFF, because
                  bits[D0] (bits[1]) is OFF
                    unchanged since rungd started: its initial value
                    with D0 = 1
                      input D0 made it 1 30 ms ago, in scan 1
        "#]],
    );
}

#[test]
fn the_json_answer_contains_the_facts_of_the_text() {
    let mut plc = rung(r#""X0""#, r#""OUT Y0""#);
    plc.scan(&[("X0", 1)]);
    let json = plc.answer("Y0", QuestionTime::Now).json();
    let cause = &json["operand"]["write"]["cause"];
    assert_eq!(cause["kind"], "instruction");
    assert_eq!(cause["place"]["line"], 5);
    let contact = &cause["legs"][0]["contacts"][0];
    assert_eq!((&contact["on"], &contact["place"]["text"]), (&true.into(), &"X0".into()));
    assert_eq!(contact["is"]["why"]["write"]["cause"]["kind"], "input");
    assert_eq!(json["change"]["edits"][0]["write"]["name"], "X0");
    assert_eq!(json["change"]["edits"][0]["value"], false);
}

#[test]
fn a_structure_is_refused_with_the_name_of_one_of_its_members() {
    let plc = rung(r#""X0""#, r#""OUT Y0""#);
    for (name, member) in [("T0", "T0.Acc"), ("CT0", "CT0.Acc"), ("N0", "N0.ACC")] {
        let refusal = plc.subject.cell(name).expect_err(name);
        assert_eq!(refusal, format!("`{name}` is a structure: name a member, as `{member}`"));
        assert!(plc.subject.cell(member).is_ok());
    }
}

#[test]
fn the_times_in_an_expression_are_shown_as_durations() {
    let mut plc = tape(
        r#"
        [[program.rung]]
        when = ["$On"]
        do = ["TMR T1 preset=10s", "TMR T2 preset=1m"]
        [[program.rung]]
        when = ["T1.Acc + 500ms > T2.Acc / 2", "T2.Acc - 2s < D1 + 1"]
        do = ["OUT Y0"]
        "#,
    );
    plc.scans(151);
    check(
        &plc,
        "Y0",
        expect![[r#"
            Y0 is ON
              OUT Y0 turned it ON 1.5 s ago, in scan 0, and keeps it ON: Main, rung 2, a.toml:9
                the rung is ON, because
                  T1.Acc + 500ms > T2.Acc / 2 is ON: T1.Acc + 500ms = 2s, T2.Acc / 2 = 750ms
                    T1.Acc is 1.5 s
                      TMR T1 preset=10s made it 1.5 s in this scan: Main, rung 1, a.toml:6
                      1.5 s of 10 s, timing for 1.5 s, since scan 0
                        the rung is ON, because
                          $On is ON
                    T2.Acc is 1.5 s
                      TMR T2 preset=1m made it 1.5 s in this scan: Main, rung 1, a.toml:6
                      1.5 s of 1 min 0 s, timing for 1.5 s, since scan 0
                        the rung is ON, because
                          $On is ON
                  T2.Acc - 2s < D1 + 1 is ON: T2.Acc - 2s = -500ms, D1 + 1 = 1ms
                    T2.Acc is 1.5 s (see above)
                    D1 is 0
                      unchanged since rungd started: its initial value
            no input turns it OFF in the next scan
        "#]],
    );
}
