//! The first pages of a reader: `README.md` is short and shows its pictures, `docs/README.md` lists
//! every page once, and each promise of `docs/guarantees.md` names tests that exist.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn text(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The targets of the links and pictures of a page that are files.
fn links(page: &str) -> Vec<&str> {
    let targets = page.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let files = targets.filter(|target| !target.contains("://") && !target.starts_with('#'));
    files.map(|target| target.split('#').next().unwrap_or(target)).collect()
}

#[test]
fn the_readme_is_short_and_shows_every_picture() {
    let page = text("README.md");
    assert!(page.lines().count() <= 125 && page.len() <= 7_750, "{} bytes", page.len());
    let links: BTreeSet<&str> = links(&page).into_iter().collect();
    assert!(links.contains("docs/README.md") && links.contains("docs/guarantees.md"));
    let shown = links.iter().filter_map(|link| link.strip_prefix("docs/pictures/"));
    let shown: BTreeSet<String> = shown.map(str::to_owned).collect();
    assert_eq!(shown, entries("docs/pictures", &["svg", "png"]));
}

/// The names of the files of a folder that have one of these endings.
fn entries(folder: &str, endings: &[&str]) -> BTreeSet<String> {
    let entries = fs::read_dir(root().join(folder)).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let has = |path: &PathBuf| {
        path.extension().is_some_and(|of| endings.iter().any(|ending| of == *ending))
    };
    let name = |path: PathBuf| path.file_name().expect("a name").to_string_lossy().into_owned();
    paths.filter(has).map(name).collect()
}

#[test]
fn links_of_the_first_pages_lead_to_existing_files() {
    for (page, folder) in [("README.md", ""), ("docs/README.md", "docs"), (GUARANTEES, "docs")] {
        for link in links(&text(page)) {
            assert!(root().join(folder).join(link).exists(), "{page}: {link}");
        }
    }
}

#[test]
fn every_page_is_listed_once_in_the_index() {
    let page = text("docs/README.md");
    for reader in ["Operator", "Engineer", "Administrator", "Developer"] {
        assert!(page.contains(&format!("\n## {reader}\n")), "{reader}");
    }
    let mut times: BTreeMap<String, usize> = BTreeMap::new();
    for row in page.lines().filter(|line| line.starts_with("| [")) {
        for link in links(row.split(" | ").next().unwrap_or(row)) {
            *times.entry(link.to_owned()).or_default() += 1;
        }
    }
    let mut pages = entries("docs", &["md"]);
    pages.remove("README.md");
    for folder in ["decisions", "findings", "instructions", "lib"] {
        pages.insert(format!("{folder}/README.md"));
    }
    let missing: Vec<_> = pages.iter().filter(|page| !times.contains_key(*page)).collect();
    assert!(missing.is_empty(), "docs/README.md does not list {missing:?}");
    times.retain(|_, times| *times > 1);
    assert!(times.is_empty(), "docs/README.md lists more than once: {times:?}");
}

const GUARANTEES: &str = "docs/guarantees.md";

/// The source of the function that a test's name ends with.
fn source_of(name: &str) -> Option<String> {
    let mut parts: Vec<&str> = name.split("::").collect();
    parts.pop();
    let place = parts.join("/");
    let crates = fs::read_dir(root().join("crates")).expect("the crates are readable");
    let crates = crates.map(|entry| entry.expect("an entry is readable").path().join("tests"));
    let folders = crates.chain([root().join("tests"), root().to_owned()]);
    let files: Vec<PathBuf> = folders
        .map(|folder| folder.join(&place))
        .flat_map(|path| [path.with_extension("rs"), path.join("mod.rs")])
        .collect();
    files.iter().find_map(|file| fs::read_to_string(file).ok())
}

fn is_test(name: &str) -> bool {
    let function = name.rsplit("::").next().unwrap_or(name);
    source_of(name).is_some_and(|source| {
        // Some tests are made by a macro, from a line `NAME = …`.
        let plain = source.contains(&format!("fn {function}("));
        plain || source.contains(&format!("\n    {function} = "))
    })
}

/// The names in backticks of a text.
fn names(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).filter(|name| name.contains("::")).collect()
}

#[test]
fn each_guarantee_names_existing_tests_and_their_limits() {
    let page = text(GUARANTEES);
    let guarantees: Vec<&str> = page.split("\n### ").skip(1).collect();
    assert!(guarantees.len() >= 15, "{} guarantees", guarantees.len());
    let mut ids = BTreeSet::new();
    let mut wrong = Vec::new();
    for guarantee in guarantees {
        let (id, body) = guarantee.split_once('\n').expect("a sentence");
        let is_id = id.chars().all(|c| c.is_ascii_lowercase() || c == '-');
        assert!(is_id && ids.insert(id), "`{id}` is no id, or is there twice");
        let parts = body.split_once("\nShown by: ").zip(body.split_once("\nNot covered: "));
        let Some(((sentence, shown), (_, left))) = parts else { panic!("{id} lacks a part") };
        assert!(sentence.trim().len() > 40 && left.trim().len() > 20, "{id}");
        let tests = names(shown.split("\nNot covered: ").next().unwrap_or_default());
        assert!(!tests.is_empty(), "{id} names no test");
        wrong.extend(tests.into_iter().filter(|test| !is_test(test)).map(|test| (id, test)));
    }
    assert!(wrong.is_empty(), "no such tests: {wrong:#?}");
}

#[test]
fn readme_contributing_and_ci_run_the_tests_by_the_same_command() {
    let page = text("README.md");
    let line = page.lines().find(|line| line.starts_with("cargo test")).expect("the command");
    let command = line.split('#').next().unwrap_or(line).trim_end();
    let locked = command.replacen("cargo test", "cargo test --locked", 1);
    assert!(text("CONTRIBUTING.md").contains(&format!("\n{command} ")), "CONTRIBUTING.md");
    assert!(text(".ci/run").contains(&format!("{locked}\n")), ".ci/run");
    assert!(text("tests/rounds.sh").contains(&locked), "tests/rounds.sh");
}

/// The commands of a text that run one test target: `cargo test -p CRATE --test TARGET`.
fn commands_with_target(text: &str) -> Vec<(Option<&str>, &str)> {
    let commands = text.split("cargo test ").skip(1);
    let commands = commands.map(|rest| rest.split(['`', '\n', ';']).next().unwrap_or(rest));
    commands.filter_map(|command| Some((word(command, "-p "), word(command, "--test ")?))).collect()
}

/// The word behind an option.
fn word<'c>(command: &'c str, option: &str) -> Option<&'c str> {
    let (_, rest) = command.split_once(option)?;
    rest.split(|c: char| !c.is_ascii_alphanumeric() && c != '-' && c != '_').next()
}

#[test]
fn each_test_target_that_a_document_names_exists() {
    let mut wrong = Vec::new();
    let listed =
        Command::new("git").current_dir(root()).args(["ls-files", "*.md", "*.sh"]).output();
    let listed = String::from_utf8(listed.expect("git").stdout).expect("paths");
    for path in listed.lines() {
        for (package, target) in commands_with_target(&text(path)) {
            let folder = match package.and_then(|package| package.strip_prefix("rungd-")) {
                Some("opcua") => "opcua/tests".to_owned(),
                Some(name) => format!("crates/{name}/tests"),
                None => "tests".to_owned(),
            };
            if !root().join(format!("{folder}/{target}.rs")).exists() {
                wrong.push(format!("{path}: {folder}/{target}.rs"));
            }
        }
    }
    assert!(listed.lines().count() > 50, "{listed}");
    assert!(wrong.is_empty(), "{wrong:#?}");
}
