//! Field devices that are lost in a proof, with known answers.

use super::environment::{answers, answers_of};
use rungd_prove::answer::{Answer, AnswerVerdict};

/// A pump that runs while its device is there, and what remembers that it was lost.
const PUMP: &str = r#"
[ladder]
name    = "pump"
devices = ["line1"]
[tags]
start = { at = "X0" }
pump  = { at = "Y0" }
fault = { at = "C0" }
[[program]]
name = "Main"
rung = [
  { when = ["start", "line1.Ok"], do = ["OUT pump"] },
  { when = ["line1.Stale"], do = ["SET fault"] },
]
"#;

const LINES: &str = r#"
always = ["!pump | line1.Ok", "!fault", "!(fault & line1.Ok)", "line1.Ok | line1.Stale"]
"#;

fn words_of(found: &[Answer]) -> Vec<&'static str> {
    found.iter().map(Answer::word).collect()
}

fn scenario(answer: &Answer) -> &str {
    let AnswerVerdict::Violated { scenario, .. } = &answer.verdict else { panic!("{answer:#?}") };
    scenario
}

#[test]
fn a_device_without_settings_is_lost_and_comes_back_between_any_two_scans() {
    assert_eq!(words_of(&answers(PUMP, LINES)), ["proved"; 4]);
    let found = answers(PUMP, &format!("{LINES}[prove]\nevents = [\"device-loss\"]\n"));
    assert_eq!(words_of(&found), ["proved", "violated", "violated", "proved"], "{found:#?}");
    assert!(scenario(&found[1]).contains("\"lose line1\",\n    \"run 1 scans\",\n]"), "{found:?}");
    let back = "\"lose line1\",\n    \"run 1 scans\",\n    \"restore line1\",\n";
    assert!(scenario(&found[2]).contains(back), "{}", scenario(&found[2]));
    let told = "  may happen: device-loss\n";
    assert!(found[0].text().contains(told), "{}", found[0].text());
}

#[test]
fn a_device_stays_lost_over_a_new_process() {
    let line = "always = [\"!(was(line1.Stale) & line1.Stale & $FirstScan)\"]\n";
    let events = "[prove]\nevents = [\"device-loss\", \"restart\"]\n";
    assert_eq!(words_of(&answers(PUMP, &format!("{line}{events}"))), ["proved"]);
    let line = "always = [\"!(line1.Stale & $FirstScan)\"]\n";
    assert_eq!(words_of(&answers(PUMP, &format!("{line}{events}"))), ["violated"]);
}

#[test]
fn before_the_first_scan_of_a_process_no_device_was_there_as_in_a_test() {
    let lines = "always = [\"!$FirstScan | !was(line1.Ok)\", \"was(line1.Ok)\"]\n";
    for events in ["", "[prove]\nevents = [\"restart\"]\n"] {
        let found = answers(PUMP, &format!("{lines}{events}"));
        assert_eq!(words_of(&found), ["proved", "violated"], "{found:#?}");
    }
}

#[test]
fn what_holds_without_the_device_is_proved_by_its_settings() {
    let controller = r#"
ladder = ["ladder.toml"]
[[device]]
name       = "line1"
driver     = "modbus-tcp"
address    = "192.168.1.20:502"
poll       = "10ms"
loss-after = "50ms"
map = [{ from = "discrete 0", to = "X0" }]
"#;

    let files = [("ladder.toml", PUMP), ("controller.toml", controller)];
    let test = r#"
controller = "controller.toml"
always = ["!pump | line1.Ok", "!(line1.Ok & line1.Stale)", "line1.Ok", "line1.Ok | line1.Stale"]
[prove]
events = ["device-loss"]
"#;
    let found = answers_of(&files, test);
    assert_eq!(words_of(&found), ["proved", "proved", "violated", "violated"], "{found:#?}");
    assert!(scenario(&found[2]).contains("\"lose line1\""), "{found:?}");
}
