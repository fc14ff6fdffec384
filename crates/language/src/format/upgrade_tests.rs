//! Tests of `rungd fmt --upgrade` on texts: what is rewritten, what stays, and all comments.

use super::upgraded;
use expect_test::{Expect, expect};

#[track_caller]
fn check(text: &str, wanted: &Expect) {
    let once = upgraded(text).expect("TOML");
    wanted.assert_eq(&format!("{}---\n{}\n", once.text, once.notes.join("\n")));
    let again = upgraded(&once.text).expect("TOML");
    assert_eq!(again.text, once.text, "a present file is not changed again");
    assert!(again.notes.iter().all(|note| once.notes.contains(note)), "{:?}", again.notes);
}

#[test]
fn old_tables_become_plant_parts_and_keep_every_comment() {
    check(
        r#"ladder = ["a.toml"]   # the line
# --- the plant ---

# parts
[[simulated-device]]        # every 400 ms
input  = "part_eye"   # the eye
pulse  = "100ms"
# how often
every  = "400ms"
while  = "feeder"

# contactors
[[simulated-device]]
input   = "X4"
follows = "Y1"
after   = "1s"
release = "500ms"
while   = "C0"
invert  = true
# the end
"#,
        &expect![[r#"
            ladder = ["a.toml"]   # the line
            # --- the plant ---

            [[device]]
            name   = "simulated"
            driver = "simulated"
            poll   = "1ms"

            # parts
            [[device.part]]       # every 400 ms
            name  = "part_eye"
            kind  = "pulse"
            to    = "part_eye"    # the eye
            pulse = "100ms"
            # how often
            every = "400ms"
            run   = "feeder"

            # contactors
            [[device.part]]
            name    = "X4"
            kind    = "delay"
            to      = "X4"
            in      = "Y1"
            after   = "1s"
            release = "500ms"
            enable  = "C0"
            invert  = true
            # the end
            ---
            2 tables `[[simulated-device]]` → `[[device.part]]` of `simulated`
        "#]],
    );
}

#[test]
fn upgraded_devices_get_unused_names_and_other_devices_are_kept() {
    check(
        r#"[[simulated-device]]
input = "gate[1]"
follows = "$Off"
[[device]]
name = "simulated"
driver = "gpio"
[web]
write = []
[[simulated-device]]
input = 'fault'
follows = "$Off"
[[simulated-device]]
input = "gate_1_"
follows = "T0.Done"
"#,
        &expect![[r#"
            [[device]]
            name   = "simulated2"
            driver = "simulated"
            poll   = "1ms"

            [[device.part]]
            name = "gate_1_"
            kind = "delay"
            to   = "gate[1]"
            in   = "$Off"

            [[device]]
            name   = "simulated"
            driver = "gpio"

            [web]
            write = []

            [[device]]
            name   = "simulated3"
            driver = "simulated"
            poll   = "1ms"

            [[device.part]]
            name = "fault2"
            kind = "delay"
            to   = 'fault'
            in   = "$Off"

            [[device.part]]
            name = "gate_1_2"
            kind = "delay"
            to   = "gate_1_"
            in   = "T0.Done"
            ---
            3 tables `[[simulated-device]]` → `[[device.part]]` of `simulated2`, `simulated3`
        "#]],
    );
}

#[test]
fn tables_without_a_new_form_are_kept() {
    check(
        r#"[[simulated-device]]
input = "X0"
follows = "Main.filling"

[[simulated-device]]
input = "X1"
pulse = "1s"
every = "2s"
follows = "Y0"

[[simulated-device]]
input = "X2"
pulse = "1s"
evry = "2s"

[[simulated-device]]
pulse = "1s"
"#,
        &expect![[r#"
            [[simulated-device]]
            input   = "X0"
            follows = "Main.filling"

            [[simulated-device]]
            input   = "X1"
            pulse   = "1s"
            every   = "2s"
            follows = "Y0"

            [[simulated-device]]
            input = "X2"
            pulse = "1s"
            evry  = "2s"

            [[simulated-device]]
            pulse = "1s"
            ---
            `[[simulated-device]]` of `X0` stays: `Main.filling` would name a point of the plant
            `[[simulated-device]]` of `X1` stays: it needs either `pulse` or `follows`
            `[[simulated-device]]` of `X2` stays: it cannot have the key `evry`
            `[[simulated-device]]` of `` stays: it has no `input`
        "#]],
    );
    check(
        "device = []\n[[simulated-device]]\ninput = \"X0\"\nfollows = \"Y0\"\n",
        &expect![[r#"
            device = []

            [[simulated-device]]
            input   = "X0"
            follows = "Y0"
            ---
            `[[simulated-device]]` of `X0` stays: `device` is one value, not `[[device]]`
        "#]],
    );
}

#[test]
fn a_file_without_old_forms_is_only_formatted() {
    check(
        "\u{feff}[scan]\r\nperiod=\"5ms\"\r\n",
        &expect![["\u{feff}[scan]\r\nperiod = \"5ms\"\r\n---\n\n"]],
    );
}
