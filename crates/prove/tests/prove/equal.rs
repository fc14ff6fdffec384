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

/// The test file of a ladder; `retain`: its table.
fn suite(ladder: &str, retain: &str) -> Suite {
    let folder = TestFolder::new("prove-equal");
    let path = folder.path().join("a.test.toml");
    fs::write(folder.path().join("ladder.toml"), ladder).expect("a ladder");
    let test = format!("ladder = [\"ladder.toml\"]\nperiod = \"10ms\"\nalways = []\n{retain}");
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
