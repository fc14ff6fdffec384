//! `rungd test` and `rungd mutate` as a user runs them: the files of `tests/ladder_tests/`.
//!
//! `NAME.test.toml` against `NAME.txt`: the exit code, and what is printed.
//! `UPDATE_LADDER_TESTS=1 cargo test --test cli ladder_tests::` writes what is printed now.

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
fn tests_say_what_is_recorded() {
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
fn the_bytes_are_the_same_with_any_number_of_threads() {
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
