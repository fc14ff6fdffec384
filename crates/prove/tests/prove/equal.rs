//! Two ladders to whose controllers something happens, with known answers.

use rungd_lab::testing::{ProofEvent, Suite, read_suite};
use rungd_prove::decide::DecideLimits;
use rungd_prove::equal::{EqualAnswer, EqualQuestion, LadderDifference, equal};
use rungd_test_support::folder::TestFolder;
use std::fs;
use std::time::Duration;

/// A machine that opens its valve in the first scan only for the button.
const OLD: &str = r#"
[tags]
button  = { at = "X0" }
running = { at = "C0" }
waste   = { at = "Y1" }
valve   = { at = "Y0" }
[[program]]
name = "Main"
rung = [
  { when = ["button"], do = ["SET running"] },
  { when = ["running", "!$FirstScan | button"], do = ["OUT valve"] },
  { when = ["running", "$DownSeconds > 600"], do = ["OUT waste"] },
]
"#;

/// The test file of a ladder; `retain`: its table, or another period than 10 ms and the table.
fn suite(ladder: &str, retain: &str) -> Suite {
    let folder = TestFolder::new("prove-equal");
    let path = folder.path().join("a.test.toml");
    fs::write(folder.path().join("ladder.toml"), ladder).expect("a ladder");
    let period = if retain.starts_with("period") { "" } else { "period = \"10ms\"\n" };
    let test = format!("ladder = [\"ladder.toml\"]\nalways = []\n{period}{retain}");
    fs::write(&path, test).expect("a test file");
    let read = read_suite(&path).expect("a file");
    let found: Vec<&String> = read.findings.iter().map(|finding| &finding.message).collect();
    read.suite.unwrap_or_else(|| panic!("{found:?}"))
}

/// The answer about two ladders with what they retain.
fn compared([old, new]: [(&str, &str); 2], events: &[ProofEvent]) -> Result<EqualAnswer, String> {
    let [old, new] = [old, new].map(|(ladder, retain)| suite(ladder, retain));
    let limits = DecideLimits {
        time: Duration::from_secs(600),
        memory: 100_000_000,
        given_up: std::sync::Arc::default(),
    };
    equal(&EqualQuestion { old: &old, new: &new, map: &[], also: &[], except: &[], events, limits })
}

fn difference(ladders: [(&str, &str); 2], events: &[ProofEvent]) -> LadderDifference {
    match compared(ladders, events) {
        Ok(EqualAnswer::Different(found)) => *found,
        other => panic!("{other:?}"),
    }
}

fn are_equal(ladders: [(&str, &str); 2], events: &[ProofEvent]) -> bool {
    matches!(compared(ladders, events), Ok(EqualAnswer::Equal(..)))
}

const ALL: [ProofEvent; 3] = [ProofEvent::PowerCut, ProofEvent::Restart, ProofEvent::Stop];

#[test]
fn ladders_that_differ_only_behind_a_start_differ_if_events_are_asked() {
    let new = OLD.replace("!$FirstScan | button", "$On");
    let retain = "[retain]\ntags = [\"running\"]\n";
    for (interval, events) in [
        ("interval = \"10ms\"\n", &ALL[..1]),
        ("", &ALL[..1]),
        ("", &ALL[1..2]),
        ("", &ALL[2..]),
        ("", &ALL),
    ] {
        let retain = format!("{retain}{interval}");
        assert!(are_equal([(OLD, &retain), (&new, &retain)], &[]));
        let found = difference([(OLD, &retain), (&new, &retain)], events);
        assert_eq!(found.outputs[0].name, "valve", "{found:?}");
        assert!(found.failure.is_some());
        assert!(are_equal([(OLD, &retain), (OLD, &retain)], events));
    }
    // A new process finds nothing.
    assert!(are_equal([(OLD, ""), (&new, "")], &ALL[..2]));
}

#[test]
fn ladders_that_retain_different_tags_differ_behind_a_new_process() {
    let [all, other] = ["running", "button2"].map(|tag| format!("[retain]\ntags = [\"{tag}\"]\n"));
    let ladder = OLD.replace("[tags]", "[tags]\nbutton2 = { at = \"C9\" }");
    let ladder = ladder.replace("$DownSeconds > 600", "$Off");
    let found = difference([(&ladder, &all), (&ladder, &other)], &ALL[1..2]);
    assert_eq!((found.scan, found.outputs[0].name.as_str()), (3, "valve"), "{found:?}");
    assert!(found.scenario.contains("\"restart\""), "{}", found.scenario);
}

#[test]
fn the_time_without_a_process_is_the_same_for_both_ladders() {
    let new = OLD.replace("> 600", "> 601");
    let retain = "[retain]\ntags = [\"running\"]\n";
    let found = difference([(OLD, retain), (&new, retain)], &ALL[1..2]);
    assert!(found.scenario.contains("\"restart for 601s\""), "{}", found.scenario);
    assert_eq!(found.outputs[0].name, "waste");
    assert!(are_equal([(OLD, retain), (OLD, retain)], &ALL));
}

#[test]
fn ladders_of_which_one_retains_nothing_are_not_compared_over_new_processes() {
    let retain = "[retain]\ntags = [\"running\"]\n";
    let refused = compared([(OLD, retain), (OLD, "")], &ALL[..1]).expect_err("it is refused");
    assert!(refused.starts_with("one ladder retains something and the other one nothing"));
    assert!(are_equal([(OLD, retain), (OLD, "")], &ALL[2..]));
}

/// A ladder with retained `n` and these rungs.
fn with_n(n: &str, rungs: &str) -> String {
    format!(
        "[tags]\nbutton = {{ at = \"X0\" }}\nlamp = {{ at = \"Y0\" }}\nn = {n}\n\
         [[program]]\nname = \"Main\"\nrung = [\n{rungs}]\n"
    )
}

const RETAIN_N: &str = "[retain]\ntags = [\"n\"]\n";

#[test]
fn a_retained_tag_of_one_name_and_two_types_is_restored_in_both_ladders() {
    let set = "  { when = [\"button\"], do = [\"MOVE 1 to=n\"] },\n  \
               { when = [\"n > 0\"], do = [\"OUT lamp\"] },\n";
    let old = with_n("{ type = \"int\" }", set);
    let latch = "  { when = [\"button\"], do = [\"SET n\"] },\n  \
                 { when = [\"n\"], do = [\"OUT lamp\"] },\n";
    let keeps = with_n("{ type = \"bit\" }", latch);
    let resets = "  { when = [\"$FirstScan\"], do = [\"RST n\"] },\n";
    let forgets = with_n("{ type = \"bit\" }", &format!("{resets}{latch}"));
    for events in [&ALL[..1], &ALL[1..2]] {
        let found = difference([(&old, RETAIN_N), (&forgets, RETAIN_N)], events);
        assert_eq!((found.outputs[0].old.as_str(), found.outputs[0].new.as_str()), ("ON", "OFF"));
        assert!(are_equal([(&old, RETAIN_N), (&keeps, RETAIN_N)], events));
    }
}

#[test]
fn the_clock_of_a_retained_shift_register_is_restored_in_both_ladders() {
    let bits = "{ type = \"bit\", count = 2 }";
    let shift = "  { leg.data = [\"$On\"], leg.clk = [\"button\"], leg.rst = [\"$Off\"], \
                 do = [\"SR n\"] },\n";
    let lamp = "  { when = [\"n[1]\"], do = [\"OUT lamp\"] },\n";
    let old = with_n(bits, &format!("{shift}{lamp}"));
    let edges = "  { when = [\"rise(button)\", \"n[0]\"], do = [\"SET n[1]\"] },\n  \
                 { when = [\"rise(button)\"], do = [\"SET n[0]\"] },\n";
    let new = with_n(bits, &format!("{edges}{lamp}"));
    // An edge has no retained history: behind a restart it comes again.
    assert!(are_equal([(&old, RETAIN_N), (&new, RETAIN_N)], &[]));
    let found = difference([(&old, RETAIN_N), (&new, RETAIN_N)], &ALL[1..2]);
    assert_eq!((found.outputs[0].old.as_str(), found.outputs[0].new.as_str()), ("OFF", "ON"));
    let main = "rung = [ { when = [\"$Off\"], do = [\"OUT C9\"] } ]\n[[program]]\n\
                name = \"Shifting\"\nautostart = true\nrung = [\n";
    let moved = old.replace("rung = [\n", main);
    assert!(are_equal([(&old, RETAIN_N), (&moved, RETAIN_N)], &ALL));
}

#[test]
fn a_time_without_a_process_that_no_step_can_say_leaves_the_question_open() {
    let old = OLD.replace("> 600", "> 5000000");
    let new = OLD.replace("$DownSeconds > 600", "$Off");
    let retain = "[retain]\ntags = [\"running\"]\n";
    let answer = compared([(&old, retain), (&new, retain)], &ALL[1..2]);
    assert!(matches!(answer, Ok(EqualAnswer::NotDecided(..))), "{answer:?}");
}

#[test]
fn ladders_with_different_periods_are_not_compared() {
    let slow = "period = \"20ms\"\n";
    let refused = compared([(OLD, ""), (OLD, slow)], &[]).expect_err("it is refused");
    let told = "the period of OLD is 10 ms and that of NEW 20 ms: ";
    assert!(refused.starts_with(told), "{refused}");
    assert!(are_equal([(OLD, slow), (OLD, slow)], &[]));
}

#[test]
fn ladders_whose_images_are_kept_at_different_times_are_not_compared_over_power_cuts() {
    let retain = "[retain]\ntags = [\"running\"]\n";
    let often = format!("{retain}interval = \"10ms\"\n");
    let refused = compared([(OLD, retain), (OLD, &often)], &ALL).expect_err("it is refused");
    let told = "the `interval` of `[retain]` is 1000 ms in OLD and 10 ms in NEW: ";
    assert!(refused.starts_with(told), "{refused}");
    assert!(are_equal([(OLD, retain), (OLD, &often)], &ALL[1..]));
}
