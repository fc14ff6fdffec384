//! `docs/semantics.md` and the cases refer to each other: the page names only existing tests, and
//! every test of a case.

use std::path::Path;

use rungd_engine::isa::instruction::TABLE as INSTRUCTIONS;
use rungd_language::source::finding::TABLE as FINDINGS;
use rungd_test_support::case;

/// The folder of the repository.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

fn read(path: &str) -> String {
    let path = Path::new(ROOT).join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The texts between backticks, line by line.
fn quoted(page: &str) -> Vec<&str> {
    page.lines().flat_map(|line| line.split('`').skip(1).step_by(2)).collect()
}

/// Whether a text has the form of a case's name, or of a pattern for such names.
fn is_case_name(text: &str) -> bool {
    let kebab = |c: char| c == '-' || c.is_ascii_lowercase() || c.is_ascii_digit();
    let name = text.strip_suffix('*').unwrap_or(text);
    let is_key = INSTRUCTIONS.iter().flat_map(|row| row.operands).any(|o| o.key == Some(text));
    let is_finding = FINDINGS.iter().any(|row| row.name == text);
    let begins = name.starts_with(|c: char| c.is_ascii_lowercase());
    begins && name.contains('-') && name.chars().all(kebab) && !is_key && !is_finding
}

fn fits(pattern: &str, test: &str) -> bool {
    match pattern.strip_suffix('*') {
        Some(start) => test.starts_with(start),
        None => test == pattern,
    }
}

#[test]
fn every_case_that_the_page_names_exists() {
    let page = read("docs/semantics.md");
    let tests: Vec<String> =
        case::all().expect("the cases are read").iter().flat_map(case::Case::tests).collect();
    let mut unknown: Vec<&str> = quoted(&page).into_iter().filter(|t| is_case_name(t)).collect();
    assert!(unknown.len() > 100, "the page names only {} cases", unknown.len());
    unknown.retain(|pattern| !tests.iter().any(|test| fits(pattern, test)));
    assert!(unknown.is_empty(), "docs/semantics.md names what is no test: {unknown:#?}");
}

#[test]
fn every_rust_test_that_the_page_names_exists() {
    let page = read("docs/semantics.md");
    let named: Vec<(&str, &str)> =
        quoted(&page).into_iter().filter_map(|text| text.rsplit_once("::")).collect();
    assert!(!named.is_empty());
    for (module, test) in named {
        let file = module.replace("::", "/");
        let places = ["crates/engine/tests", "crates/state/tests", "tests"];
        let files = places.map(|place| Path::new(ROOT).join(place).join(format!("{file}.rs")));
        let text = files.iter().find_map(|file| std::fs::read_to_string(file).ok());
        let has_it = text.is_some_and(|text| text.contains(&format!("fn {test}(")));
        assert!(has_it, "no {file}.rs of {places:?} has a test {test}");
    }
}

#[test]
fn the_page_names_every_case() {
    let page = read("docs/semantics.md");
    let patterns: Vec<&str> = quoted(&page).into_iter().filter(|t| is_case_name(t)).collect();
    let cases = case::all().expect("the cases are read");
    let mut unnamed: Vec<String> = cases.iter().flat_map(case::Case::tests).collect();
    unnamed.retain(|test| !patterns.iter().any(|pattern| fits(pattern, test)));
    assert!(unnamed.is_empty(), "docs/semantics.md names no row or sentence for: {unnamed:#?}");
}
