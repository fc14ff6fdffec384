//! A test file with an observer in every command that reads test files: `rungd test` with each of
//! its reports, `mutate`, `xref`.

use std::fs;
use std::process::Command;

use rungd_test_support::folder::TestFolder;
use serde_json::Value;

const LADDER: &str = r#"[tags]
eye  = { at = "X0" }
bin  = { at = "X1" }
lamp = { at = "Y0" }

[[program]]
name = "Main"
[[program.rung]]
name = "lamp"
when = ["eye", "!bin"]
do   = ["OUT lamp"]
"#;

const TEST: &str = r#"ladder = ["ladder.toml"]
always = ["!waits.Done"]

[observer.tags]
waits = { type = "timer" }

[[observer.rung]]
name = "wait"
when = ["eye", "!bin", "lamp"]
do   = ["TMR waits preset=200ms"]

[[scenario]]
name  = "a part waits"
steps = ["run 1 scans", "expect: !lamp", "set eye 1", "run 100ms",
         "expect: lamp & waits.Acc > 50ms", "set bin 1", "run 50ms", "expect: !lamp"]
"#;

/// Parts come and bins go at random.
const RANDOM: &str = r#"
[[random]]
name   = "parts come"
runs   = 50
scans  = 300
seed   = 1
change = { eye = "2%", bin = "2%" }
"#;

/// The folder with the ladder, the test, and the test with a random test.
fn folder() -> TestFolder {
    let folder = TestFolder::new("observers");
    let write = |name: &str, text: &str| {
        fs::write(folder.path().join(name), text).expect("writable");
    };
    write("ladder.toml", LADDER);
    write("wait.test.toml", TEST);
    write("random.test.toml", &format!("{TEST}{RANDOM}"));
    folder
}

/// The output of a command.
fn said(folder: &TestFolder, args: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let output = command.args(args).current_dir(folder.path()).output().expect("rungd runs");
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("text");
    format!("{}{}", text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_random_run_that_an_observer_ends_is_shortened_explained_and_reported() {
    let folder = folder();
    let args = ["test", "random.test.toml", "--junit", "tests.xml", "--filter", "parts come"];
    let text = said(&folder, &args);
    let pasted = "    [[scenario]]\n    name  = \"parts come\"\n    steps = [\n        \
                  \"set eye 1\",\n        \"run 21 scans\",\n    ]\n";
    assert!(text.contains(pasted), "{text}");
    for reason in [
        "TMR waits preset=200ms turned it ON in this scan: the observer, rung wait",
        "input X0 turned it ON 200 ms ago, in scan 1",
        "OUT lamp keeps it ON: Main, rung lamp, ladder.toml:11",
    ] {
        assert!(text.contains(reason), "{reason}:\n{text}");
    }
    let xml = fs::read_to_string(folder.path().join("tests.xml")).expect("written");
    assert!(xml.contains("waits.Done is ON"), "{xml}");
    let json: Value =
        serde_json::from_str(&said(&folder, &[&args[..2], &["--json"]].concat())).expect("JSON");
    let failure = &json["files"][0]["tests"][1]["failure"];
    assert_eq!(failure["operands"][0]["name"], "waits.Done", "{failure}");
    assert!(failure["why"][0].as_str().is_some_and(|why| why.contains("TMR waits")), "{failure}");
    // The shortened run fails as the random one does.
    let scenario =
        "\n[[scenario]]\nname  = \"pasted\"\nsteps = [\"set eye 1\", \"run 21 scans\"]\n";
    fs::write(folder.path().join("pasted.test.toml"), format!("{TEST}{scenario}")).unwrap();
    assert!(said(&folder, &["test", "pasted.test.toml"]).contains("1 FAILED, 1 passed"));
}

#[test]
fn a_trace_has_the_tags_of_the_observer_and_coverage_leaves_it_out() {
    let folder = folder();
    let text = said(&folder, &["test", "wait.test.toml", "--trace", "traces", "--coverage"]);
    assert!(text.contains("legs, power ON and OFF       1 of 1"), "{text}");
    let entries = fs::read_dir(folder.path().join("traces")).expect("a folder");
    let path = entries.map(|entry| entry.expect("an entry").path()).next().expect("a trace");
    let trace = fs::read_to_string(path).expect("text");
    let mut lines = trace.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let at = header.iter().position(|name| *name == "waits.Acc").expect("a column");
    let column: Vec<&str> = lines.map(|line| line.split(',').nth(at).expect("a value")).collect();
    assert_eq!(column[..4], ["0", "0", "10", "20"], "{trace}");
}

#[test]
fn mutate_judges_with_the_observer_and_changes_nothing_of_it() {
    let folder = folder();
    let text = said(&folder, &["mutate", "wait.test.toml", "--json"]);
    let json: Value = serde_json::from_str(&text).unwrap_or_else(|_| panic!("{text}"));
    let all = json.to_string();
    assert!(!all.contains("TMR waits") && all.contains("ladder.toml"), "{all}");
}

#[test]
fn xref_names_the_rungs_of_observers() {
    let folder = folder();
    let text = said(&folder, &["xref", "lamp", "--in", "ladder.toml"]);
    assert!(text.contains("observer: rung wait"), "{text}");
}
