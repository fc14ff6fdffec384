//! Reals from outside: an R word read, written, forced, watched and logged, with the real binary at
//! both ends of the socket.

use rungd_test_support::running::live::{Live, ask, said};

const LADDER: &str = r#"
[tags]
level = { at = "R1", initial = 20, min = -5.5, max = 99.5, log = "change", doc = "Tank, metres" }
[[program]]
name = "Main"
rung = [
  { when = ["$On"], do = ["ADD R0 0.5 to=R2", "OUT C7"] },
  { when = ["C0"], do = ["MOVE level to=R3"] },
]
"#;

fn live() -> Live {
    Live::scanning(LADDER)
}

#[test]
fn a_real_is_read_by_tag_or_range_and_is_a_number_in_json() {
    let live = live();
    assert_eq!(
        live.ok("read level R0..R2"),
        "level  R1  20.0\nR0     R0  0.0\nlevel  R1  20.0\nR2     R2  0.5\n"
    );
    let json = live.say("read --json R1 R2").json();
    assert_eq!(
        (&json["values"][0]["value"], &json["values"][1]["value"]),
        (&20.0.into(), &0.5.into())
    );
}

#[test]
fn a_real_is_written_in_any_number_notation() {
    let live = live();
    assert_eq!(live.ok("write level 12.5"), "level (R1): 12.5, was 20.0\n");
    let line = live.line("wrote 12.5 to level (R1)");
    assert_eq!((&line["before"], &line["after"]), (&"20.0".into(), &"12.5".into()));
    assert_eq!(live.ok("write level 7"), "level (R1): 7.0, was 12.5\n");
    assert_eq!(live.ok("write level -2.5e-1"), "level (R1): -0.25, was 7.0\n");
    assert_eq!(live.ok("write R0 1e20"), "R0: 1e20, was 0.0\n");
    assert_eq!(live.ok("write R0 0.1"), "R0: 0.1, was 1e20\n");
    live.await_values("R2", "0.6");
    for zero in ["-0.0", "-1e-60"] {
        assert_eq!(live.ok(&format!("write R0 {zero}")), "R0: 0.0, was 0.1\n", "-0 becomes 0");
        live.ok("write R0 0.1");
    }
}

#[test]
fn a_value_that_is_no_real_is_refused_with_a_reason() {
    let live = live();
    for (command, words) in [
        ("write R0 nan", "`R0` is a real: it takes a number, as 12.5, 12 or 2e-3"),
        ("write R0 inf", "`R0` is a real: it takes a number"),
        ("write R0 -inf", "`R0` is a real: it takes a number"),
        ("write R0 on", "`R0` is a real: it takes a number"),
        ("write R0 .5", "`R0` is a real: it takes a number"),
        ("write R0 5.", "`5.` is neither a number nor a duration"),
        ("write R0 1e39", "takes -3.4028235e38 to 3.4028235e38, not 1e39"),
        ("write R0 -3.5e38", "takes -3.4028235e38 to 3.4028235e38, not -3.5e38"),
        ("write level 99.6", "`level` takes -5.5 to 99.5, not 99.6"),
        ("write level -6", "`level` takes -5.5 to 99.5, not -6.0"),
        ("write D0 1.5", "`D0` is a word: it takes a whole number"),
        ("force R0 nan", "`R0` is a real: it takes a number"),
        ("force level 100", "`level` takes -5.5 to 99.5, not 100.0"),
    ] {
        let said = live.say(command);
        assert!(said.code == 2 && said.err.contains(words), "{command}: {said:?}");
    }
    let mut stream = live.connect();
    let mut tries = |value: &str| {
        ask(&mut stream, &format!(r#"{{"do":"write","operand":"R0","value":{value}}}"#))
    };
    assert_eq!(tries("2.5")["ok"]["now"]["value"], 2.5);
    assert_eq!(tries("3")["ok"]["now"]["value"], 3.0);
    assert_eq!(tries("1e39")["error"]["kind"], "bad-value");
    assert_eq!(tries("true")["error"]["kind"], "bad-value");
    for no_json in ["1e999", "NaN", "Infinity"] {
        assert_eq!(tries(no_json)["error"]["kind"], "bad-request", "{no_json}");
    }
    assert_eq!(live.ok("read R0"), "R0  R0  3.0\n");
}

#[test]
fn neither_the_ladder_nor_a_write_changes_a_forced_real() {
    let live = live();
    assert_eq!(live.served("force R2 -1.5"), "R2: -1.5, forced, was 0.5\n");
    assert_eq!(live.line("forced R2 to -1.5")["event"], "operator-force");
    live.served("write R0 4");
    assert_eq!(live.served("read R2"), "R2  R2  -1.5  forced\n");
    assert!(live.served("status").contains("R2"), "the force is in the status");
    assert_eq!(live.say("status --json").json()["forces"][0]["value"], -1.5);
    let said = live.say("write R2 9.5");
    assert!(said.code == 1 && said.err.contains("`R2` is forced to -1.5"), "{said:?}");
    assert_eq!(live.served("force R0 -0.0"), "R0: 0.0, forced, was 4.0\n");
    assert_eq!(live.served("unforce R2"), "R2: not forced, 0.5, was -1.5, forced\n");
    live.await_values("R2", "0.5");
}

#[test]
fn a_change_of_a_real_is_logged_and_shown_by_watch() {
    let live = live();
    live.ok("write level 12.25");
    let line = live.line("level is 12.25, was 20.0");
    assert_eq!(
        (&line["event"], &line["from"], &line["to"]),
        (&"tag-value".into(), &"20.0".into(), &"12.25".into())
    );
    let out = live.ok("watch level R2 --count 2 --interval 50ms");
    assert!(out.lines().all(|line| line.ends_with(" level=12.25 R2=0.5")), "{out}");
    let out = live.ok("watch --json level --count 1");
    assert!(out.contains("\"value\":12.25"), "{out}");
}

#[test]
fn the_shell_completes_tags_of_reals() {
    let live = live();
    let mut command = live.command("");
    command.env("COMPLETE", "fish").args(["--", "rungd", "write", "le"]);
    let offered = said(&mut command).out;
    assert!(offered.contains("level") && offered.contains("R1: Tank, metres"), "{offered}");
}
