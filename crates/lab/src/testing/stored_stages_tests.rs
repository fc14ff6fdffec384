//! Retained Stages before the first scan of a scenario, played.
//!
//! Each test is a test file over `tests/suites/batch.toml`, and what becomes of its scenario.

use std::path::Path;

use super::reading::{ReadSuite, read_text};
use super::was_tests::failures;
use rungd_language::source::span::SourceFile;

fn reading(retained: &str, set: &str, steps: &[&str]) -> ReadSuite {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("tests/suites/x.test.toml");
    let text = format!(
        "ladder = [\"batch.toml\"]\n[retain]\nstages = [{retained}]\ninterval = \"10ms\"\n\
         [[scenario]]\nname = \"a\"\nset = {{ {set} }}\nsteps = {steps:?}\n"
    );
    read_text(&path, SourceFile { name: "x.test.toml".to_owned(), text }, None)
}

/// Checks that a scenario passes with the Stages of all Programs retained.
fn passes(set: &str, steps: &[&str]) {
    let read = reading("\"*\"", set, steps);
    let findings: Vec<_> = read.findings.iter().map(|finding| &finding.message).collect();
    let suite = read.suite.unwrap_or_else(|| panic!("{findings:?}"));
    assert_eq!(failures(&suite), Vec::<String>::new(), "{set}: {steps:?}");
}

/// The message and the help of the only finding.
fn finding(retained: &str, set: &str) -> String {
    let read = reading(retained, set, &["run 1 scans"]);
    let [finding] = &read.findings[..] else { panic!("{:?}", read.findings) };
    format!("{}: {}", finding.message, finding.help_text().unwrap_or_default())
}

#[test]
fn a_scenario_begins_in_the_stages_that_it_sets() {
    passes(
        "",
        &[
            "expect: !Batch.Running & Rinse.Running & !Rinse.Wait",
            "run 1 scans",
            "expect: Rinse.Wait",
        ],
    );
    passes(
        "\"Batch.Mix\" = 1, full = true",
        &[
            "expect: Batch.Running & Batch.Mix & !Batch.Fill",
            "run 1 scans",
            "expect: mixer & !inlet",
        ],
    );
    // Others than those that are set are OFF, the initial one too.
    passes(
        "\"Batch.Fill\" = 1, \"Batch.Empty\" = true",
        &[
            "run 1 scans",
            "expect: inlet & !mixer & outlet",
            "power-cut",
            "expect: Batch.Fill & Batch.Empty",
        ],
    );
    // What the image does not have starts as at a cold start.
    passes("\"Batch.Mix\" = 1", &["run 1 scans", "expect: Rinse.Running & Rinse.Wait"]);
}

#[test]
fn a_scenario_says_whether_a_program_runs_and_begins_at_its_initial_stage() {
    passes(
        "\"Batch.Running\" = 1",
        &["expect: Batch.Running & !Batch.Fill", "run 1 scans", "expect: Batch.Fill & inlet"],
    );
    passes(
        "\"Rinse.Running\" = 0",
        &["expect: !Rinse.Running", "run 2 scans", "expect: !Rinse.Running & !Rinse.Wait"],
    );
    // No Stage is ON: it runs so.
    passes(
        "\"Batch.Running\" = 1, \"Batch.Fill\" = 0",
        &[
            "run 2 scans",
            "expect: Batch.Running & !Batch.Fill & !Batch.Mix & !Batch.Empty & !inlet",
        ],
    );
    passes(
        "\"Batch.Running\" = 0, \"Batch.Fill\" = 1",
        &["run 2 scans", "expect: !Batch.Running & !inlet"],
    );
}

#[test]
fn stages_that_are_not_retained_are_not_set() {
    let told = finding("\"Rinse\"", "\"Batch.Mix\" = 1");
    assert!(
        told.starts_with("`Batch.Mix` is set, and no Stages of Batch are retained: "),
        "{told}"
    );
    assert!(told.contains("`stages = [\"Batch\"]`"), "{told}");
    let told = finding("\"*\"", "\"Main.Running\" = 1");
    assert!(told.starts_with("`Main.Running` is read-only: "), "{told}");
}
