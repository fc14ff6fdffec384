//! `rungd mutate` as a user runs it, with ladders and test files in a folder of the test's own.

use std::fs;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rungd_test_support::folder::TestFolder;
use rungd_test_support::patience::PATIENCE;
use rungd_test_support::system::signal;
use serde_json::Value;

/// Counts starts in two ways, of which `[retain]` keeps those that a test file names.
const LADDER: &str = r#"[tags]
count = { type = "int" }
total = { type = "int" }

[[program]]
name = "Main"
[[program.rung]]
name = "count"
when = ["rise(X0)"]
do   = ["ADD count 1 to=count", "ADD total 1 to=total"]
[[program.rung]]
name = "lamp"
when = ["X1", "X2 & X1"]
do   = ["OUT Y0"]
"#;

/// A suite that notices each change of the counts, and that `count` survives a power cut.
const COUNTS: &str = r#"ladder = ["ladder.toml"]
period = "10ms"
[retain]
tags = ["total",
        "count"]
[[scenario]]
name = "the counts"
steps = [
  "expect: count == 0 & total == 0", "set X0 1", "run 50ms", "expect: count == 1", "set X0 0", "run 50ms",
  "pulse X0 50ms every 100ms times 2", "expect: count == 3 & total == 3",
  "run 2s", "power-cut", "expect: count == 3",
]
"#;

/// A suite that notices changes of the lamp, at another period.
const LAMP: &str = r#"ladder = ["ladder.toml"]
period = "20ms"
[retain]
tags = ["total"]
[[scenario]]
name = "the lamp"
steps = [
  "run 40ms", "expect: !Y0", "set X1 true", "run 40ms", "expect: !Y0", "set X2 true", "run 40ms", "expect: Y0",
  "set X1 false", "run 40ms", "expect: !Y0", "pulse X0 100ms", "run 2s", "power-cut", "expect: total == 1",
]
"#;

/// A suite that no machine ends.
const ENDLESS: &str = r#"ladder = ["ladder.toml"]
period = "10ms"
always = ["count <= 100000 | count > 100000"]
[[random]]
name = "for years"
runs = 100000
scans = 1000000000
change = { X0 = "1%" }
"#;

/// A lamp with a contact that its latches imply.
const LATCHED: &str = r#"[[program]]
name = "Main"
[[program.rung]]
when = ["X0"]
do   = ["SET C0"]
[[program.rung]]
when = ["C0", "X1"]
do   = ["SET C1"]
[[program.rung]]
when = ["X2"]
do   = ["RST C0", "RST C1"]
[[program.rung]]
when = ["C0", "C1"]
do   = ["OUT Y0"]
"#;

/// A suite that notices everything that can be noticed of the lamp's contacts.
const LATCHED_TESTS: &str = r#"ladder = ["latched.toml"]
period = "10ms"
[[scenario]]
name = "the lamp"
steps = [
  "pulse X1 50ms", "run 100ms", "pulse X0 50ms", "run 100ms", "expect: !Y0", "pulse X1 50ms", "run 100ms", "expect: Y0",
  "set X2 true", "set X0 true", "run 50ms", "expect: !Y0", "set X1 true", "set X0 false", "run 20ms", "set X2 false", "run 20ms", "expect: !Y0", "set X0 true",
  "run 20ms", "expect: Y0",
]
"#;

struct Tests(TestFolder);

impl Tests {
    fn new() -> Tests {
        let folder = TestFolder::new("mutate");
        let files = [
            ("ladder.toml", LADDER),
            ("counts.test.toml", COUNTS),
            ("lamp.test.toml", LAMP),
            ("endless.test.toml", ENDLESS),
            ("latched.toml", LATCHED),
            ("latched.test.toml", LATCHED_TESTS),
        ];
        for (name, text) in files {
            fs::write(folder.path().join(name), text).expect("a file");
        }
        Tests(folder)
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
        command.arg("mutate").args(args).current_dir(self.0.path());
        command
    }

    fn run(&self, args: &[&str]) -> Output {
        self.command(args).output().expect("rungd runs")
    }
}

/// The exit code and both outputs.
fn said(output: &Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("text");
    let code = output.status.code().map_or("none".to_owned(), |code| code.to_string());
    format!("exit code {code}\n{}{}", text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_tag_left_out_of_retain_is_a_change_that_a_power_cut_shows() {
    let tests = Tests::new();
    assert_eq!(
        said(&tests.run(&["counts.test.toml", "--only", "retain-out"])),
        "exit code 0\n\
         counts.test.toml: 1 of 2 changes are noticed (50 %)\n\
         not noticed, each a rung to look at:\n  \
           counts.test.toml:4: [retain]\n      \
               4:10 `total` is not retained\n"
    );
}

#[test]
fn test_files_of_one_ladder_are_judged_together() {
    let tests = Tests::new();
    let names = ["counts.test.toml", "lamp.test.toml"];
    let alone = names.map(|name| said(&tests.run(&[name])));
    assert!(alone[0].contains("contact `X1` is `!X1`"), "{}", alone[0]);
    assert!(alone[1].contains("`ADD count 1 to=count` left out"), "{}", alone[1]);
    let together = said(&tests.run(&[names[0], names[1], "--at-least", "100"]));
    assert!(
        together.starts_with(
            "exit code 0\ncounts.test.toml, lamp.test.toml: 20 of 20 changes are noticed by these \
             tests together (100 %); 2 more change nothing\n"
        ),
        "{together}"
    );
}

#[test]
fn changes_without_an_effect_are_counted_apart() {
    let tests = Tests::new();
    let result = said(&tests.run(&["lamp.test.toml", "--only", "contact-out"]));
    let expected = "exit code 0\nlamp.test.toml: 2 of 2 changes are noticed (100 %); 2 more change \
                    nothing\n";
    assert!(result.starts_with(expected), "{result}");
}

#[cfg(feature = "prove")]
#[test]
fn changes_that_a_proof_shows_to_change_nothing_do_not_count() {
    let tests = Tests::new();
    let args = ["latched.test.toml", "--only", "contact-out"];
    let result = said(&tests.run(&[args.as_slice(), &["--at-least", "100"]].concat()));
    assert_eq!(
        result,
        "exit code 0\nlatched.test.toml: 5 of 5 changes are noticed (100 %); 1 more changes nothing \
         (proved)\n"
    );
    let output = tests.run(&[args.as_slice(), &["--json"]].concat());
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let file = &json["files"][0];
    assert_eq!([&file["mutants"], &file["killed"], &file["unchanged"]], [5, 5, 0]);
    let proved = &file["proved_unchanged"];
    assert_eq!(proved.as_array().map(Vec::len), Some(1));
    assert_eq!(proved[0]["what"], "contact `C0` left out");
    assert_eq!(proved[0]["place"], "latched.toml:13");
}

#[test]
fn json_has_the_place_of_each_change_and_the_test_that_notices_it() {
    let tests = Tests::new();
    let output = tests.run(&["counts.test.toml", "lamp.test.toml", "--json"]);
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let file = &json["files"][0];
    assert_eq!(file["files"].as_array().map(Vec::len), Some(2));
    assert_eq!([&file["unchanged"], &file["left"]], [2, 0]);
    let all = file["all"].as_array().expect("a list");
    let lamp = all.iter().find(|mutant| mutant["what"] == "contact `X2` left out");
    let lamp = lamp.expect("a contact");
    assert_eq!([&lamp["line"], &lamp["column"]], [13, 16]);
    assert_eq!([&lamp["killed_by"], &lamp["killed_in"]], ["the lamp", "lamp.test.toml"]);
}

#[test]
fn what_was_judged_in_the_time_is_reported_and_the_rest_does_not_count_as_noticed() {
    let tests = Tests::new();
    let args = ["counts.test.toml", "endless.test.toml", "--time", "200ms"];
    let result = said(&tests.run(&args));
    let ended = "exit code 0\ncounts.test.toml, endless.test.toml: ended early, judged 0 of 22: ";
    assert!(result.starts_with(ended), "{result}");
    let result = said(&tests.run(&[args.as_slice(), &["--at-least", "1"]].concat()));
    assert!(result.starts_with("exit code 1\n"), "{result}");
    let wrong = said(&tests.run(&["counts.test.toml", "--time", "soon"]));
    assert!(wrong.starts_with("exit code 2\n") && wrong.contains("`5m`"), "{wrong}");
}

#[test]
fn an_interrupt_reports_what_was_judged_so_far() {
    let tests = Tests::new();
    let mut command = tests.command(&["endless.test.toml"]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("rungd runs");
    wait_until_listening(&child);
    signal(&child, "INT");
    let result = said(&child.wait_with_output().expect("an end"));
    assert!(
        result.starts_with("exit code 0\nendless.test.toml: ended early, judged 0 of "),
        "{result}"
    );
}

/// Waits until a process has a handler for SIGINT.
fn wait_until_listening(process: &Child) {
    let begun = Instant::now();
    loop {
        let status = fs::read_to_string(format!("/proc/{}/status", process.id())).expect("status");
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        let caught = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
        if caught.is_some_and(|mask| mask & (1 << (libc::SIGINT - 1)) != 0) {
            return;
        }
        assert!(begun.elapsed() < PATIENCE, "no handler for SIGINT");
        sleep(Duration::from_millis(5));
    }
}
