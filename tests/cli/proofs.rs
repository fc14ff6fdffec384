//! The suites of `tests/proofs/` are proved as a user proves them: each line has the answer that
//! stands beside it.
//!
//! `RUNGD_PROOFS=all` also asks the lines that are marked as slow.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use rungd_test_support::abc::{self, AbcAnswer};
use rungd_test_support::folder::TestFolder;
use serde_json::Value;

/// A line of `always` or `can`, and the answer that the comment behind it names.
#[derive(Debug, PartialEq)]
struct Expected {
    line: String,
    answer: String,
}

/// Reads `"LINE",  # ANSWER: why`.
fn expected(line: &str) -> Option<Expected> {
    let (condition, comment) = line.trim().strip_prefix('"')?.split_once("\",")?;
    let comment = comment.trim().strip_prefix("# ")?;
    let answer = comment.split(':').next().unwrap_or(comment);
    Some(Expected { line: condition.to_owned(), answer: answer.trim().to_owned() })
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Copies the files of a folder and of those below it.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let copied = to.join(path.file_name().expect("a name"));
        match path.is_dir() {
            true => copy(&path, &copied),
            false => drop(fs::copy(&path, copied).expect("a copy")),
        }
    }
}

/// The suites of a folder, in order.
fn suites(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let is_suite = |path: &PathBuf| path.to_string_lossy().ends_with(".test.toml");
    let mut suites: Vec<PathBuf> = paths.filter(is_suite).collect();
    suites.sort();
    assert!(!suites.is_empty(), "{}", folder.display());
    suites
}

/// The answers of `rungd prove` in the form of what is expected.
fn answers(suite: &Path) -> Vec<Expected> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let output = command.args(["prove", "--json", "--time", "10m"]).arg(suite).output();
    let output = output.expect("rungd runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.is_empty(), "{}: {said}", suite.display());
    let text = String::from_utf8(output.stdout).expect("text");
    let answer = |line: &str| {
        let value: Value = serde_json::from_str(line).expect("JSON");
        let word = value["answer"].as_str().expect("an answer");
        let vacuous = if value["vacuous"].is_null() { "" } else { ", vacuous" };
        let line = value["line"].as_str().expect("a line").to_owned();
        Expected { line, answer: format!("{word}{vacuous}") }
    };
    text.lines().map(answer).collect()
}

/// Proves the suites of a folder of `tests/proofs`, on copies: answers are kept beside them.
fn prove_all(folder: &str) {
    let copied = TestFolder::new(&format!("proofs-{folder}"));
    copy(&root().join("config"), &copied.path().join("config"));
    let here = copied.path().join("tests/proofs").join(folder);
    copy(&root().join("tests/proofs").join(folder), &here);
    let all = std::env::var("RUNGD_PROOFS").is_ok_and(|value| value == "all");
    for suite in suites(&here) {
        let text = fs::read_to_string(&suite).expect("a suite");
        let is_asked = |line: &&str| all || expected(line).is_none() || !line.ends_with("(slow)");
        let lines: Vec<&str> = text.lines().filter(is_asked).collect();
        fs::write(&suite, lines.join("\n")).expect("a suite");
        let expected: Vec<Expected> = lines.iter().filter_map(|line| expected(line)).collect();
        assert_eq!(answers(&suite), expected, "{}", suite.display());
    }
}

#[test]
fn the_benchmarks_of_esbmc_have_the_answers_that_stand_beside_them() {
    prove_all("esbmc");
}

#[test]
fn the_tasks_of_agents4plc_have_the_answers_that_stand_beside_them() {
    prove_all("agents4plc");
}

#[test]
fn what_an_engineer_asks_of_three_plants_is_decided() {
    prove_all("plants");
}

/// What ABC says of a suite, beside the answers of its lines.
fn judge_by_abc(suite: &Path) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let folder = suite.parent().expect("a folder");
    command.args(["prove", "--json", "--certificate", "out"]).arg(suite).current_dir(folder);
    let output = command.output().expect("rungd runs");
    let text = String::from_utf8(output.stdout).expect("text");
    let is_violated: Vec<bool> =
        text.lines().map(|line| line.contains("\"answer\":\"violated\"")).collect();
    let name = suite.file_name().expect("a name").to_string_lossy().into_owned();
    let question = folder.join("out").join(name.trim_end_matches(".test.toml"));
    let place = || format!("{name}: {is_violated:?}");
    match abc::judge(&question.join("question.aig"), 60).expect("it ends") {
        AbcAnswer::Proved => assert!(!is_violated.contains(&true), "{}", place()),
        AbcAnswer::Asserted(at) => assert!(is_violated[at], "{at} of {}", place()),
    }
}

#[test]
fn abc_agrees_about_the_questions_of_suites() {
    if !abc::is_installed() {
        return;
    }
    let copied = TestFolder::new("proofs-abc");
    for folder in ["config", "tests/proofs/esbmc"] {
        copy(&root().join(folder), &copied.path().join(folder));
    }
    suites(&copied.path().join("tests/proofs/esbmc")).iter().for_each(|suite| judge_by_abc(suite));
    for name in ["bin-emptying", "car-park", "parts-bin"] {
        judge_by_abc(&copied.path().join(format!("config/tests/{name}.test.toml")));
    }
}

#[test]
fn abc_reads_a_question_whose_lines_and_inputs_are_the_names_of_bits() {
    if !abc::is_installed() {
        return;
    }
    let folder = TestFolder::new("proofs-abc-names");
    let ladder = "[tags]\nheld = { at = \"C0\" }\nlamp = { at = \"Y0\" }\n\
                  [[program]]\nname = \"Main\"\n\
                  rung = [{ when = [\"X0 | held\"], do = [\"SET lamp\"] }]\n";
    let suite = "ladder = [\"lamp.toml\"]\nalways = [\"lamp\", \"held\", \"lamp | !X0\"]\n\
                 [prove]\nevents = [\"writes\"]\nwritable = [\"held\", \"lamp\"]\n";
    fs::write(folder.path().join("lamp.toml"), ladder).expect("a ladder");
    fs::write(folder.path().join("lamp.test.toml"), suite).expect("a suite");
    judge_by_abc(&folder.path().join("lamp.test.toml"));
}
