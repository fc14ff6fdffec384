//! The output of `rungd check`: `tests/ui/NAME.stderr` has the expected findings of
//! `tests/ui/NAME.toml`.
//!
//! A folder is a case too. If it has a `case.test.toml`, this file is read as by `rungd test`. If
//! it has a `controller.toml`, this file is checked. Otherwise all its ladder files are checked
//! together, in the order of their names. `UPDATE_UI=1 cargo test -p rungd-language language::ui::` updates the
//! expected findings.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use rungd_config::load::{self, Loaded};
use rungd_lab::testing::read_suite;
use rungd_language::source::finding::{Severity, TABLE};
use rungd_language::source::render::{Style, render};

/// Findings of the rules about the whole program, which are tested elsewhere.
const RULES: [&str; 12] = [
    "owned-twice",
    "reset-without-owner",
    "sensaphone-preset",
    "jump-outside-stage",
    "entask-conflict",
    "duplicate-out",
    "limited-word-bit",
    "built-in-task",
    "block-rule",
    "subroutine-rule",
    "subroutine-nesting",
    "subroutine-rungs",
];

fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e == ending)
}

fn load(case: &Path) -> Loaded {
    if !case.is_dir() && load::is_controller_file(case).unwrap() {
        return load::controller_file(case).unwrap();
    }
    if !case.is_dir() {
        return load::ladder_files(&[case.to_owned()]).unwrap();
    }
    let controller = case.join("controller.toml");
    if controller.exists() {
        return load::controller_file(&controller).unwrap();
    }
    let files: Vec<PathBuf> = entries(case).into_iter().filter(|p| has_ending(p, "toml")).collect();
    load::ladder_files(&files).unwrap()
}

/// Every case, with its printed findings. They are loaded only once, because both tests use them.
fn cases() -> &'static [(PathBuf, String)] {
    static CASES: OnceLock<Vec<(PathBuf, String)>> = OnceLock::new();
    CASES.get_or_init(load_cases)
}

fn load_cases() -> Vec<(PathBuf, String)> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).canonicalize().unwrap();
    // Findings name files as they were given: here from the folder of the repository.
    let from_root = format!("{}/", root.display());
    let cases = entries(&root.join("tests/ui")).into_iter();
    let cases = cases.filter(|path| path.is_dir() || has_ending(path, "toml"));
    let said = |path: &PathBuf| {
        let test = path.join("case.test.toml");
        if test.exists() {
            let read = read_suite(&test).unwrap();
            return render(&read.findings, &read.files, Style::default());
        }
        let loaded = load(path);
        render(&loaded.findings, &loaded.files, Style::default())
    };
    cases.map(|path| (path.clone(), said(&path).replace(&from_root, ""))).collect()
}

#[test]
fn printed_findings_equal_the_recorded_texts() {
    let update = std::env::var_os("UPDATE_UI").is_some();
    let mut wrong = Vec::new();
    for (path, said) in cases() {
        let record = path.with_extension("stderr");
        if update {
            std::fs::write(&record, said).unwrap();
        } else if std::fs::read_to_string(&record).unwrap_or_default() != *said {
            wrong.push(format!("{}:\n{said}", path.display()));
        }
    }
    assert!(wrong.is_empty(), "UPDATE_UI=1 records what is said now:\n{}", wrong.join("\n"));
}

#[test]
fn every_error_of_reading_and_resolving_has_a_case() {
    let said: String = cases().iter().map(|(_, said)| said.as_str()).collect();
    let errors = TABLE.iter().filter(|row| row.severity == Severity::Error);
    // Those of other files than ladders have their cases where the files are read (`crates/fleet`).
    for row in errors.filter(|row| !["edge-file", "opcua-file"].contains(&row.name)) {
        let shown = said.contains(&format!("error[{}]", row.name));
        assert!(shown || RULES.contains(&row.name), "no case shows {}", row.name);
    }
}
