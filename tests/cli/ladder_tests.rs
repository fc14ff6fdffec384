//! `rungd test` and `rungd mutate` as a user runs them: the files of `tests/ladder_tests/`.
//!
//! `NAME.txt` has the expected exit code and output of `NAME.test.toml`. `UPDATE_LADDER_TESTS=1
//! cargo test --test commands cli::ladder_tests::` updates it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ladder_tests")
}

fn rungd(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.args(args).current_dir(folder()).output().expect("rungd runs")
}

/// The exit code and both outputs.
fn said(output: &Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("text");
    let code = output.status.code().map_or("none".to_owned(), |code| code.to_string());
    format!("exit code {code}\n{}{}", text(&output.stdout), text(&output.stderr))
}

/// The names of the test files, without `.test.toml`.
fn cases() -> Vec<String> {
    let entries = std::fs::read_dir(folder()).expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    let mut cases: Vec<String> = names
        .filter_map(|name| Some(name.to_str()?.strip_suffix(".test.toml")?.to_owned()))
        .collect();
    cases.sort();
    cases
}

#[test]
fn test_reports_equal_the_recorded_texts() {
    let update = std::env::var_os("UPDATE_LADDER_TESTS").is_some();
    let cases = cases();
    assert!(cases.len() >= 4, "{cases:?}");
    let mut wrong = Vec::new();
    for case in cases {
        let now = said(&rungd(&["test", "--verbose", &format!("{case}.test.toml")]));
        let record = folder().join(format!("{case}.txt"));
        if update {
            std::fs::write(&record, &now).expect("writable");
        } else if std::fs::read_to_string(&record).unwrap_or_default() != now {
            wrong.push(format!("{case}:\n{now}"));
        }
    }
    let how = "UPDATE_LADDER_TESTS=1 records what is said now";
    assert!(wrong.is_empty(), "{how}:\n{}", wrong.join("\n"));
}

#[test]
fn reports_are_identical_with_any_number_of_threads() {
    let of = |jobs: &str| {
        let args = ["test", "failures.test.toml", "steps.test.toml", "--json", "--jobs", jobs];
        said(&rungd(&args))
    };
    let one = of("1");
    assert!(one.len() > 10_000, "{one}");
    for jobs in ["2", "3", "7"] {
        assert_eq!(of(jobs), one, "{jobs} threads");
    }
}

/// A file in the temporary folder of these tests.
fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ladder_tests");
    std::fs::create_dir_all(&folder).expect("a folder");
    folder.join(name)
}

#[test]
fn exit_codes_distinguish_passed_failed_and_findings() {
    let code = |file: &str| rungd(&["test", file]).status.code();
    assert_eq!(code("steps.test.toml"), Some(0));
    assert_eq!(code("failures.test.toml"), Some(1));
    let wrong = scratch("wrong.test.toml");
    std::fs::write(&wrong, "ladder = [\"filler.toml\"]\nfoo = 1\n").expect("writable");
    assert_eq!(code(wrong.to_str().expect("text")), Some(78));
    assert_eq!(code("no-such.test.toml"), Some(74));
    let empty = scratch("empty");
    std::fs::create_dir_all(&empty).expect("a folder");
    assert_eq!(code(empty.to_str().expect("text")), Some(2), "a folder without a test file");
}

#[test]
fn tests_are_found_in_a_folder_and_selected_by_a_filter() {
    let output = rungd(&["test", ".", "--verbose", "--filter", "within begins"]);
    let text = said(&output);
    assert!(text.contains("ok      within begins with the next scan"), "{text}");
    assert!(text.contains("steps.test.toml: 1 passed\n"), "{text}");
    assert!(text.contains("failures.test.toml: 0 passed\n"), "{text}");
    let none = said(&rungd(&["test", "steps.test.toml", "--filter", "no such name"]));
    assert!(none.contains("no test's name contains"), "{none}");
}

#[test]
fn results_are_written_as_json_and_junit() {
    let junit = scratch("result.xml");
    let args = ["test", "failures.test.toml", "--json", "--junit", junit.to_str().expect("text")];
    let output = rungd(&args);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let tests = json["files"][0]["tests"].as_array().expect("tests");
    assert_eq!(json["failed"], tests.len());
    let first = &tests[0]["failure"];
    assert_eq!(first["text"], "expect: pusher & bottles.Acc == 4");
    assert_eq!(first["operands"][1]["name"], "bottles.Acc");
    assert_eq!(first["operands"][1]["value"], "3");
    assert!(first["why"][0].as_str().is_some_and(|why| why.contains("CNT bottles")), "{first}");
    let xml = std::fs::read_to_string(&junit).expect("a file");
    let failures = xml.matches("<failure message=").count();
    assert_eq!((xml.matches("<testcase ").count(), failures), (tests.len(), tests.len()));
    assert!(xml.contains("expect: pusher &amp; bottles.Acc == 4"), "{xml}");
    let parsed = Command::new("python3")
        .args(["-c", "import sys, xml.dom.minidom; xml.dom.minidom.parse(sys.argv[1])"])
        .arg(&junit)
        .status()
        .expect("python3 runs");
    assert!(parsed.success(), "{xml}");
}

#[test]
fn a_trace_has_a_row_for_each_scan() {
    let folder = scratch("traces");
    let folder = folder.to_str().expect("text");
    let name = "an edge is seen by expect, within and hold";
    rungd(&["test", "steps.test.toml", "--filter", name, "--trace", folder]);
    let path = Path::new(folder).join("steps-an-edge-is-seen-by-expect-within-and-hold.csv");
    let trace = std::fs::read_to_string(&path).expect("a trace");
    assert_eq!(trace.lines().count(), 9, "a header and eight scans: {trace}");
    assert!(trace.starts_with("scan,time_ms,bottle,"), "{trace}");
    assert!(trace.contains("\n8,70,"), "{trace}");
}

#[test]
fn a_trace_keeps_the_rows_of_a_reloaded_program() {
    let folder = scratch("reloads");
    let folder = folder.to_str().expect("text");
    rungd(&["test", "reloaded.test.toml", "--trace", folder]);
    let path = Path::new(folder).join("reloaded-the-reloaded-program-doubles.csv");
    let trace = std::fs::read_to_string(&path).expect("a trace");
    let mut rows = trace.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let head = rows.next().expect("a header");
    let column = |name: &str| head.iter().position(|of| *of == name).expect(name);
    let (counted, doubled) = (column("bottles.Acc"), column("doubled"));
    let rows: Vec<_> = rows.map(|row| (row[0].to_owned(), row[counted], row[doubled])).collect();
    let expected = [("1", "1", "0"), ("2", "1", "0"), ("3", "1", "2"), ("4", "1", "2")];
    let expected = expected.map(|(scan, counted, doubled)| (scan.to_owned(), counted, doubled));
    assert_eq!(rows, expected, "{trace}");
}

#[test]
fn coverage_sees_a_stage_and_an_alarm_within_a_scan() {
    let text = said(&rungd(&["test", "passing.test.toml", "--coverage"]));
    for line in
        ["  Stages, entered and left     3 of 4\n", "  alarms, raised and gone      1 of 1\n"]
    {
        assert!(text.contains(line), "{line}{text}");
    }
    assert!(!text.contains("Stage Steps.Pass"), "{text}");
    assert!(text.contains("  Stage Steps.Never: never entered\n"), "{text}");
}

#[test]
fn random_tests_count_in_coverage_if_requested() {
    let legs = |more: &[&str]| {
        let args = [&["test", "random.test.toml", "--coverage"], more].concat();
        let text = said(&rungd(&args));
        let line = text.lines().find(|line| line.contains("legs, power")).map(str::to_owned);
        line.expect("a count")
    };
    assert!(legs(&[]).ends_with(" 0 of 6"), "{}", legs(&[]));
    assert!(legs(&["--random"]).ends_with(" 5 of 6"), "{}", legs(&["--random"]));
    let alone = rungd(&["test", "random.test.toml", "--random"]);
    assert_eq!(alone.status.code(), Some(2), "{}", said(&alone));
}

/// The scenarios of shortened runs in an output: by scenario its `set` steps, each with its scan.
fn shortened(text: &str) -> Vec<Vec<(u64, String, f64)>> {
    let of_scenario = |steps: &str| {
        let mut scan = 0;
        let mut sets = Vec::new();
        let steps = steps.split("    ]").next().unwrap_or_default().lines();
        for step in steps.map(|line| line.trim().trim_matches(['"', ','])) {
            match step.split(' ').collect::<Vec<_>>()[..] {
                ["set", name, value] => {
                    sets.push((scan, name.to_owned(), value.parse().expect("a number")));
                }
                ["run", scans, "scans"] => scan += scans.parse::<u64>().expect("a number"),
                _ => panic!("{step}"),
            }
        }
        sets
    };
    text.split("steps = [\n").skip(1).map(of_scenario).collect()
}

#[test]
fn the_random_source_can_produce_every_shortened_run() {
    let text = said(&rungd(&["test", "walk.test.toml"]));
    let runs = shortened(&text);
    assert_eq!(runs.len(), 2, "{text}");
    for (run, start) in runs.iter().zip([1.0, 9.0]) {
        let (mut level, mut shift, mut last) = (1.5, start, std::collections::HashMap::new());
        for (scan, name, value) in run {
            let before = last.insert(name.clone(), *scan);
            assert!(before.is_none_or(|before| before < *scan), "{name} twice in a scan: {text}");
            match name.as_str() {
                "level" => {
                    // A step beyond a limit ends there.
                    let up = f64::min(level + 0.25, 4.0);
                    let down = f64::max(level - 0.25, 0.0);
                    assert!(*value == up || *value == down, "{level} to {value}: {text}");
                    level = *value;
                }
                "shift" => {
                    assert_eq!(f64::abs(value - shift), 1.0, "{text}");
                    shift = *value;
                }
                _ => assert!(*value == 0.0 || *value == 1.0, "{text}"),
            }
        }
        assert!(level >= 3.0 && shift >= 4.0, "{text}");
    }
    // A level that moves in every scan does so from the first one on.
    let scans: Vec<u64> =
        runs[1].iter().filter(|(_, name, _)| name == "level").map(|(scan, ..)| *scan).collect();
    assert_eq!(scans, (0..scans.len() as u64).collect::<Vec<_>>(), "{text}");
}

#[test]
fn coverage_names_elements_not_seen_in_both_states() {
    let name = "an edge is seen by expect, within and hold";
    let text = said(&rungd(&["test", "steps.test.toml", "--filter", name, "--coverage"]));
    for line in [
        "  legs, power ON and OFF       1 of 6\n",
        "  contacts, ON and OFF         1 of 11\n",
        "Main, rung count: leg rst never ON, `reset` never ON, `late` never ON, `rise(late)` never ON\n",
        "  alarm full: never gone\n",
    ] {
        assert!(text.contains(line), "{line}{text}");
    }
    let json = rungd(&["test", "steps.test.toml", "--coverage", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).expect("JSON");
    let rungs = json["coverage"][0]["rungs"].as_array().expect("rungs");
    assert_eq!(rungs.len(), 5);
    assert_eq!(rungs[0]["contacts"][0]["seen"], serde_json::json!({ "on": true, "off": true }));
}

#[test]
fn mutants_that_survive_are_named() {
    let text = said(&rungd(&["mutate", "steps.test.toml"]));
    assert!(text.starts_with("exit code 0\nsteps.test.toml: "), "{text}");
    assert!(text.contains("filler.toml:44: Main, rung stop\n"), "{text}");
    assert!(text.contains("      44:17 contact `estop` left out\n"), "{text}");
    assert_eq!(text, said(&rungd(&["mutate", "steps.test.toml", "--jobs", "3"])));
    let few = said(&rungd(&["mutate", "steps.test.toml", "--at-least", "100"]));
    assert!(few.starts_with("exit code 1\n"), "{few}");
    let some = said(&rungd(&["mutate", "steps.test.toml", "--only", "rung-out"]));
    assert!(some.starts_with("exit code 0\nsteps.test.toml: "), "{some}");
    assert!(some.contains(" of 5 changes are noticed"), "{some}");
    let failing = said(&rungd(&["mutate", "failures.test.toml"]));
    assert!(failing.contains("the test `expect` fails with the ladder as it is"), "{failing}");
}

/// A fault in a copy of an example, and the random test that finds it.
struct SeededFault {
    ladder: &'static str,
    /// The text in the example, and the faulty text that replaces it.
    change: (&'static str, &'static str),
    always: &'static str,
    set: &'static str,
    inputs: &'static str,
}

const SEEDED: [SeededFault; 3] = [
    SeededFault {
        ladder: "batch-mixer",
        change: (
            "name = \"Prepare\"\n",
            "name = \"Prepare\"\n[[program.stage.rung]]\nwhen = [\"$On\"]\ndo = [\"OUT C99\"]\n",
        ),
        always: "!(C99 & (water_valve | syrup_valve))",
        set: "abort_ok = true, lid_closed = true, room_left = true",
        inputs: "start_button = \"1%\", again_button = \"0.1%\", tank_wet = \"1%\", \
                 water_pulse = \"20%\", syrup_pulse = \"20%\", room_left = \"0.2%\"",
    },
    SeededFault {
        ladder: "parts-bin",
        change: ("\"!bin_full\", \"!eye_blocked\"", "\"!eye_blocked\""),
        always: "!(feeder & bin_full)",
        set: "bin_present = true",
        inputs: "part_eye = \"10%\", bin_present = \"0.1%\"",
    },
    SeededFault {
        ladder: "bin-emptying",
        change: ("leg.rst = [\"rise(refill_button)\"]", "leg.rst = [\"refill_button\"]"),
        always: "!(rise(part_taken) & robot_enable & left.Acc == bin_size) | rise(refill_button)",
        set: "refill_button = false",
        inputs: "part_taken = \"5%\", refill_button = \"1%\"",
    },
];

#[test]
fn a_failing_run_of_thousands_of_scans_is_shortened_to_a_few_steps() {
    let programs = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/programs");
    for SeededFault { ladder, change: (from, to), always, set, inputs } in SEEDED {
        let text = std::fs::read_to_string(programs.join(format!("{ladder}.toml"))).expect("text");
        assert!(text.contains(from), "{ladder} has no {from}");
        std::fs::write(scratch("seeded.toml"), text.replacen(from, to, 1)).expect("writable");
        let test = format!(
            "ladder = [\"seeded.toml\"]\nalways = [\"{always}\"]\n[[random]]\nname = \"{ladder}\"\n\
             runs = 20\nscans = 5000\nseed = 1\nset = {{ {set} }}\nchange = {{ {inputs} }}\n"
        );
        let path = scratch("seeded.test.toml");
        std::fs::write(&path, test).expect("writable");
        let text = said(&rungd(&["test", path.to_str().expect("text")]));
        assert!(text.starts_with("exit code 1\n"), "{ladder}: {text}");
        let (_, steps) = text.split_once("steps = [\n").expect("a scenario");
        let (steps, _) = steps.split_once("    ]").expect("its end");
        assert!((1..=10).contains(&steps.lines().count()), "{ladder}: {text}");
    }
}

#[test]
fn a_pasted_run_fails_as_the_random_test_did() {
    for case in ["random", "events"] {
        let file = folder().join(format!("{case}.test.toml"));
        let written = std::fs::read_to_string(&file).expect("text");
        let head = written.split("[[random]]").next().unwrap_or_default();
        let ladders = format!("\"{}/", folder().display());
        let head = head.replace("ladder = [\"", &format!("ladder = [{ladders}"));
        let found = said(&rungd(&["test", file.to_str().expect("text")]));
        let failures = found.split("\nFAILED").skip(1);
        let mut count = 0;
        for failure in failures {
            let line = failure.lines().find(|line| line.contains("always: ")).expect("a line");
            let scenario = failure.split("    [[scenario]]").nth(1).expect("a scenario");
            let (scenario, _) = scenario.split_once("\n    ]").expect("its end");
            let path = scratch("pasted.test.toml");
            std::fs::write(&path, format!("{head}[[scenario]]{scenario}\n]\n")).expect("writable");
            let again = said(&rungd(&["test", path.to_str().expect("text")]));
            assert!(again.contains(line.trim()), "{scenario}\n{again}");
            let (_, steps) = scenario.split_once("steps = [\n").expect("steps");
            assert!(case != "events" || steps.lines().count() <= 10, "{scenario}");
            count += 1;
        }
        assert!(count >= 1, "{found}");
    }
}

#[test]
fn a_watched_file_runs_again_when_it_changes() {
    use std::io::{BufRead, BufReader};
    let ladder = scratch("watched.toml");
    let rung = |output: &str| {
        let text = format!(
            "[[program]]\nname = \"Main\"\n[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"OUT {output}\"]\n"
        );
        std::fs::write(&ladder, text).expect("writable");
    };
    rung("Y0");
    let test = scratch("watched.test.toml");
    let text = "ladder = [\"watched.toml\"]\n[[scenario]]\nname = \"follows\"\n\
                steps = [\"set X0 1\", \"run 1 scans\", \"expect: Y0\"]\n";
    std::fs::write(&test, text).expect("writable");
    let mut child = Command::new(env!("CARGO_BIN_EXE_rungd"))
        .args(["test", "--watch"])
        .arg(&test)
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("rungd runs");
    let mut lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
    let mut next = || lines.next().expect("a line").expect("text");
    assert!(next().ends_with("watched.test.toml: 1 passed"));
    rung("Y1");
    // A file written right before the start may count as changed, so the first result can come
    // twice.
    while !next().ends_with("watched.test.toml: 1 FAILED, 0 passed") {}
    child.kill().expect("it runs");
    child.wait().expect("it ends");
}

#[test]
fn the_random_tests_of_shipped_plants_move_every_output_and_input() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/tests");
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let has_random = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).expect("text");
        path.to_string_lossy().ends_with(".test.toml") && text.contains("[[random]]")
    };
    let files: Vec<PathBuf> = paths.filter(has_random).collect();
    assert!(files.len() > 3, "{files:?}");
    let names: Vec<&str> = files.iter().filter_map(|path| path.to_str()).collect();
    let output = rungd(&[&["test", "--json"], &names[..]].concat());
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let files = json["files"].as_array().expect("files").iter();
    for test in files.flat_map(|file| file["tests"].as_array().expect("tests")) {
        let unmoved = test["unmoved"].as_object().expect("lists").values();
        let names: Vec<_> = unmoved.filter_map(|names| names.as_array()).flatten().collect();
        assert!(names.is_empty(), "{}: {names:?}", test["name"]);
    }
}
