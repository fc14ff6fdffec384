//! `docs/findings/`: one page for each finding. The examples are executed: the wrong example gives
//! the finding as printed on the page; the right example gives none.
//!
//! `UPDATE_EXPECT=1 cargo test -p rungd-language language::findings_pages` updates the index and the printed
//! findings on the pages.

use std::fs;
use std::path::{Path, PathBuf};

use rungd_config::load;
use rungd_lab::testing::read_suite;
use rungd_language::source::finding::{Finding, FindingRow, Severity, TABLE};
use rungd_language::source::render::{Style, render};
use rungd_language::source::span::SourceFile;

const PRINTS: &str = "<!-- prints -->\n\n```text\n";

fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("docs/findings")
}

fn update() -> bool {
    std::env::var_os("UPDATE_EXPECT").is_some()
}

fn page(row: &FindingRow) -> String {
    let path = folder().join(format!("{}.md", row.name));
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The TOML blocks after a mark, up to the next mark. Each block is a file. If there are several, a
/// comment in the first line of each has its name.
fn example(page: &str, mark: &str) -> Vec<SourceFile> {
    let (_, behind) = page.split_once(mark).unwrap_or_else(|| panic!("no {mark}"));
    let part = behind.split("<!--").next().unwrap_or(behind);
    let blocks = part.split("```toml\n").skip(1);
    let texts = blocks.map(|block| block.split("```").next().unwrap_or(block));
    let files: Vec<SourceFile> = texts
        .map(|text| {
            let title = text.lines().next().and_then(|line| line.strip_prefix("# "));
            let title = title.filter(|title| title.ends_with(".toml"));
            let name = title.unwrap_or("ladder.toml").to_owned();
            SourceFile { name, text: text.to_owned() }
        })
        .collect();
    assert!(!files.is_empty(), "{mark} has no example");
    files
}

/// The files and findings of an example.
struct Loaded {
    files: Vec<SourceFile>,
    findings: Vec<Finding>,
}

/// Loads an example as `rungd check` or `rungd test` does; the example's first file is the
/// argument.
fn load(row: &FindingRow, files: &[SourceFile]) -> Loaded {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("findings").join(row.name);
    fs::create_dir_all(&folder).expect("a folder for the example");
    for file in files {
        fs::write(folder.join(&file.name), &file.text).expect("writable");
    }
    let path = folder.join(&files[0].name);
    let mut loaded = if files[0].name.ends_with(".test.toml") {
        let read = read_suite(&path).expect("it was written");
        Loaded { files: read.files, findings: read.findings }
    } else if files[0].name.ends_with(".edge.toml") {
        let read = rungd_fleet::edge::read_edge(&path, files[0].text.as_bytes());
        Loaded { files: vec![read.file], findings: read.findings }
    } else if files[0].name.ends_with("opcua.toml") {
        let read = rungd_fleet::opcua::read_opcua(&path, files[0].text.as_bytes());
        Loaded { files: vec![read.file], findings: read.findings }
    } else {
        let loaded = if load::is_controller_file(&path).expect("it was written") {
            load::controller_file(&path).expect("it was written")
        } else {
            load::ladder_files(&[path]).expect("it was written")
        };
        Loaded { files: loaded.files, findings: loaded.findings }
    };
    for file in &mut loaded.files {
        let name = Path::new(&file.name).file_name().expect("a file has a name");
        file.name = name.to_string_lossy().into_owned();
    }
    loaded
}

fn printed(loaded: &Loaded) -> String {
    render(&loaded.findings, &loaded.files, Style::default())
}

#[test]
fn every_page_belongs_to_a_finding_and_contains_its_summary() {
    let mut pages: Vec<String> = fs::read_dir(folder())
        .expect("docs/findings is there")
        .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
        .filter(|name| name != "README.md")
        .collect();
    pages.sort();
    let mut names: Vec<String> = TABLE.iter().map(|row| format!("{}.md", row.name)).collect();
    names.sort();
    assert_eq!(pages, names);
    for row in TABLE {
        let head = format!("# {}\n\n{}\n\n## ", row.name, summary(row));
        assert!(page(row).starts_with(&head), "{} begins with\n{head}", row.name);
    }
}

fn summary(row: &FindingRow) -> String {
    format!("{:?}: {}", row.severity, row.summary)
}

#[test]
fn wrong_examples_give_their_finding_and_right_examples_give_none() {
    let mut failures = String::new();
    for row in TABLE {
        let page = page(row);
        let wrong = example(&page, "<!-- wrong -->");
        let loaded = load(row, &wrong);
        let found = &loaded.findings;
        let other = |f: &Finding| f.code != row.code && f.severity() == Severity::Error;
        if !found.iter().any(|f| f.code == row.code) || found.iter().any(other) {
            let said = printed(&loaded);
            failures.push_str(&format!("{}: the wrong example gives\n{said}\n", row.name));
        } else {
            failures.push_str(&compare(row, &page, &printed(&loaded)));
        }
        let loaded = load(row, &example(&page, "<!-- right -->"));
        if !loaded.findings.is_empty() {
            let said = printed(&loaded);
            failures.push_str(&format!("{}: the right example gives\n{said}\n", row.name));
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// Compares the finding on the page with that printed by the program. Returns a text with the
/// difference.
fn compare(row: &FindingRow, page: &str, printed: &str) -> String {
    let (before, behind) = page.split_once(PRINTS).expect("a page shows what is printed");
    let (shown, after) = behind.split_once("```").expect("the block ends");
    if shown == printed {
        return String::new();
    }
    if update() {
        let path = folder().join(format!("{}.md", row.name));
        fs::write(path, format!("{before}{PRINTS}{printed}```{after}")).expect("writable");
        return String::new();
    }
    format!("{}: the page shows\n{shown}\nthe program prints\n{printed}\n", row.name)
}

#[test]
fn the_index_lists_every_finding() {
    let path = folder().join("README.md");
    let expected = index();
    if update() {
        fs::write(&path, &expected).expect("writable");
    }
    assert_eq!(fs::read_to_string(&path).unwrap_or_default(), expected);
}

fn index() -> String {
    let mut text = "# Findings\n\nWhat `rungd check` finds, and `rungd explain NAME` explains. \
        Errors refuse the load; warnings do\nnot, and are silenced with `allow = [\"NAME\"]` on a \
        rung or in `[ladder]`.\n"
        .to_owned();
    for (severity, title) in [(Severity::Error, "Errors"), (Severity::Warning, "Warnings")] {
        text.push_str(&format!("\n## {title}\n\n| finding | meaning |\n|---|---|\n"));
        for row in TABLE.iter().filter(|row| row.severity == severity) {
            let meaning = row.summary.replace('|', "\\|");
            text.push_str(&format!("| [`{0}`]({0}.md) | {meaning} |\n", row.name));
        }
    }
    text
}
