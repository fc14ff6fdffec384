//! Reasons of many parts, of the members of a Sensaphone counter, and of the rungs of a template.

use expect_test::{Expect, expect};

use super::tape::{Tape, tape};
use rungd_runtime::Origin;
use rungd_runtime::exchange::Ticket;

/// Checks the answer for the current time, without the line of the write, which is long.
#[track_caller]
fn reasons(plc: &Tape, name: &str, expected: Expect) {
    let text = plc.why(name);
    let (head, rest) = text.split_once('\n').expect("a head");
    expected.assert_eq(&format!("{head}\n{}", rest.split_once('\n').expect("a write").1));
}

const BOTH_WAYS: &str = r#"
[[program.rung]]
name = "in"
when = ["X0"]
do = ["CTU N0 preset=3"]
[[program.rung]]
name = "out"
when = ["X1"]
do = ["CTD N0"]
[[program.rung]]
name = "clear"
when = ["X2"]
do = ["RES N0"]
[[program.rung]]
name = "by-word"
when = ["X3"]
do = ["CTU N1 preset=D0"]
"#;

#[test]
fn enable_bits_are_explained_by_their_own_instruction() {
    let mut plc = tape(BOTH_WAYS);
    plc.scan(&[("X0", 1)]);
    plc.scans(25);
    reasons(
        &plc,
        "N0.CU",
        expect![[r#"
            N0.CU is ON
                the rung is ON, because
                  X0 is ON
                    input X0 turned it ON 250 ms ago, in scan 0
            X0 OFF would turn it OFF in the next scan
        "#]],
    );
    reasons(
        &plc,
        "N0.CD",
        expect![[r#"
            N0.CD is OFF
                the rung is OFF, because
                  X1 is OFF
                    unchanged since rungd started: its initial value
            X1 ON would turn it ON in the next scan
        "#]],
    );
}

#[test]
fn a_preset_is_not_explained_by_res() {
    let mut plc = tape(BOTH_WAYS);
    plc.scan(&[("X2", 1)]);
    plc.scans(5);
    let preset = plc.why("N0.PRE");
    assert!(preset.contains("unchanged since rungd started: its initial value"), "{preset}");
    assert!(!preset.contains("RES"), "{preset}");
    reasons(
        &plc,
        "N1.PRE",
        expect![[r#"
            N1.PRE is 0
                the rung is OFF, because
                  X3 is OFF
                    unchanged since rungd started: its initial value
                with D0 = 0
                  unchanged since rungd started: its initial value
        "#]],
    );
}

#[test]
fn an_unnamed_rung_of_a_template_is_shown_with_its_use() {
    let ladder = r#"
        rung = [
          { use = "Pump", name = "p1", with = { want = "X0", motor = "Y0" } },
          { use = "Pump", name = "p2", with = { want = "X1", motor = "Y1" } },
        ]

        [[template]]
        name = "Pump"
        parameters = { want = { type = "contact" }, motor = { type = "output" } }
        rung = [{ when = ["want"], do = ["OUT motor"] }]
    "#;
    let mut plc = tape(ladder);
    plc.scans(2);
    let text = plc.why("Y1");
    assert!(text.contains("Main, rung 2 (p2), a.toml:"), "{text}");
}

/// Twelve fault bits; the last one to change stands first, and the quiet ones are counted.
#[test]
fn the_last_changed_of_many_contacts_are_shown() {
    let any: Vec<String> = (0..12).map(|at| format!("X{at}")).collect();
    let mut plc =
        tape(&format!("rung = [{{ when = [\"{}\"], do = [\"OUT Y0\"] }}]\n", any.join(" | ")));
    plc.scan(&[("X3", 1)]);
    plc.scan(&[("X3", 0), ("X9", 1)]);
    plc.scan(&[("X9", 0)]);
    plc.scans(5);
    reasons(
        &plc,
        "Y0",
        expect![[r#"
            Y0 is OFF
                the rung is OFF, because
                  X9 is OFF
                    input X9 turned it OFF 50 ms ago, in scan 2
                  X3 is OFF
                    input X3 turned it OFF 60 ms ago, in scan 1
                  X0 is OFF
                    unchanged since rungd started: its initial value
                  X1 is OFF
                    unchanged since rungd started: its initial value
                  and 8 that are OFF
            X9 ON would turn it ON in the next scan
        "#]],
    );
}

#[test]
fn the_zero_operands_of_a_long_sum_are_counted() {
    let all: Vec<String> = (0..12).map(|at| format!("D{at}")).collect();
    let (sum, product) = (all.join(" + "), all[..7].join(" * "));
    let (or, sum) = (all.join(" | "), format!("({sum}) * D20"));
    let mut plc = tape(&format!(
        "rung = [ {{ when = [\"$On\"], do = [\"MATH D30 = {sum}\", \"MATH D31 = {or}\", \
         \"MATH D32 = {product}\"] }} ]\n"
    ));
    let cell = plc.cell("D7");
    plc.begin();
    plc.from(Origin::Batch(Ticket(7)), "Modbus client 10.0.0.7");
    plc.write(cell, 4);
    plc.execute();
    plc.scans(5);
    reasons(
        &plc,
        "D30",
        expect![[r#"
            D30 is 0
                the rung is ON, because
                  $On is ON
                with D7 = 4
                  Modbus client 10.0.0.7 wrote 4 50 ms ago, in scan 0
                with D20 = 0
                  unchanged since rungd started: its initial value
                with D0 = 0
                  unchanged since rungd started: its initial value
                and 10 that are 0
        "#]],
    );
    reasons(
        &plc,
        "D31",
        expect![[r#"
            D31 is 4
                the rung is ON, because
                  $On is ON
                with D7 = 4
                  Modbus client 10.0.0.7 wrote 4 50 ms ago, in scan 0
                with D0 = 0
                  unchanged since rungd started: its initial value
                with D1 = 0
                  unchanged since rungd started: its initial value
                and 9 that are 0
        "#]],
    );
    reasons(
        &plc,
        "D32",
        expect![[r#"
            D32 is 0
                the rung is ON, because
                  $On is ON
                with D0 = 0
                  unchanged since rungd started: its initial value
                with D1 = 0
                  unchanged since rungd started: its initial value
                with D2 = 0
                  unchanged since rungd started: its initial value
                with D3 = 0
                  unchanged since rungd started: its initial value
                with D4 = 0
                  unchanged since rungd started: its initial value
                with D5 = 0
                  unchanged since rungd started: its initial value
                with D6 = 0
                  unchanged since rungd started: its initial value
        "#]],
    );
}
