//! Field devices that are lost in a proof, with known answers.

use super::environment::{answers, answers_of, cause, scenario, words_of};
use rungd_prove::answer::Answer;

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

/// A controller file with the device.
const CONTROLLER: &str = r#"
ladder = ["ladder.toml"]
[[device]]
name       = "line1"
driver     = "modbus-tcp"
address    = "192.168.1.20:502"
poll       = "10ms"
loss-after = "50ms"
map = [{ from = "discrete 0", to = "X0" }]
"#;

/// The answers with the settings of the device, which may be lost.
fn answers_with_settings(ladder: &str, always: &str) -> Vec<Answer> {
    let files = [("ladder.toml", ladder), ("controller.toml", CONTROLLER)];
    let test = format!(
        "controller = \"controller.toml\"\nalways = {always}\n\
         [prove]\nevents = [\"device-loss\", \"restart\"]\n"
    );
    answers_of(&files, &test)
}

#[test]
fn what_holds_without_the_device_is_proved_by_its_settings() {
    let lines = r#"["!pump | line1.Ok", "!(line1.Ok & line1.Stale)", "line1.Ok", "line1.Ok | line1.Stale"]"#;
    let found = answers_with_settings(PUMP, lines);
    assert_eq!(words_of(&found), ["proved", "proved", "violated", "violated"], "{found:#?}");
    assert!(scenario(&found[2]).contains("\"lose line1\""), "{found:?}");
}

#[test]
fn a_scenario_waits_until_loss_after_has_passed() {
    let found = answers_with_settings(PUMP, r#"["!line1.Stale", "!(fault & pump)"]"#);
    assert_eq!(words_of(&found), ["violated", "violated"], "{found:#?}");
    // The sixth scan is the first one more than 50 ms behind the start.
    let waits = "\"lose line1\",\n    \"run 7 scans\",\n]";
    assert!(scenario(&found[0]).contains(waits), "{}", scenario(&found[0]));
    assert!(scenario(&found[1]).contains("\"restore line1\""), "{}", scenario(&found[1]));
}

/// What must happen in the very scan in which the device goes stale, or in the one before.
const MOMENTS: &str = r#"
[ladder]
name    = "moments"
devices = ["line1"]
[tags]
button = { at = "X5" }
now    = { at = "C1" }
[[program]]
name = "Main"
rung = [
  { when = ["rise(button)", "line1.Stale"], do = ["SET now"] },
]
"#;

#[test]
fn what_happens_in_the_scan_in_which_a_device_goes_stale_waits_with_it() {
    let lines =
        r#"["!now", "!(was(button) & button & rise(line1.Stale))", "!(line1.Stale & $FirstScan)"]"#;
    let found = answers_with_settings(MOMENTS, lines);
    assert_eq!(words_of(&found), ["violated", "violated", "not decided"], "{found:#?}");
    let text = found[2].text();
    assert!(text.contains("there `.Stale` comes when `loss-after` has passed"), "{text}");
}

/// What only a device that is lost before the first scan could do.
const EARLY: &str = r#"
[ladder]
name    = "early"
devices = ["line1"]
[tags]
early = { at = "C1" }
late  = { at = "C2" }
[[program]]
name = "Main"
rung = [
  { when = ["$FirstScan", "line1.Stale"], do = ["SET early"] },
  { when = ["line1.Stale"], do = ["SET late"] },
]
"#;

#[test]
fn a_dead_end_is_one_in_a_test_too() {
    let files = [("ladder.toml", EARLY), ("controller.toml", CONTROLLER)];
    let test = "controller = \"controller.toml\"\n\
                [prove]\nevents = [\"device-loss\"]\ncan = [\"!early\", \"!late\"]\n";
    let found = answers_of(&files, test);
    assert_eq!(words_of(&found), ["not decided", "violated"], "{found:#?}");
    let cause = cause(&found[0]);
    assert!(cause.contains("there `.Stale` comes when `loss-after` has passed"), "{cause}");
    assert!(scenario(&found[1]).contains("\"lose line1\",\n    \"run 7 scans\",\n]"), "{found:#?}");
}

#[test]
fn an_image_is_named_as_the_cause_only_if_a_run_finds_one() {
    let controller = format!("{CONTROLLER}[retain]\ntags = [\"late\"]\ninterval = \"1s\"\n");
    let files = [("ladder.toml", EARLY), ("controller.toml", controller.as_str())];
    let test = "controller = \"controller.toml\"\nalways = [\"!early\"]\n\
                [prove]\nevents = [\"device-loss\", \"power-cut\"]\n";
    let found = answers_of(&files, test);
    let cause = cause(&found[0]);
    assert!(cause.contains("there `.Stale` comes when `loss-after` has passed"), "{cause}");
}
