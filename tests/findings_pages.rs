//! `docs/findings/`: one page a finding. What they show is executed: the wrong example gives that
//! finding, as printed there; the right one gives none.
//!
//! `UPDATE_EXPECT=1 cargo test --test findings_pages` writes what the program prints into the
//! pages, and the index.

use std::fs;
use std::path::PathBuf;

use rungd::check;
use rungd::resolve::controller::resolve_controller;
use rungd::resolve::{LoadOptions, load_ladders};
use rungd::source::controller;
use rungd::source::finding::{Finding, Row, Severity, TABLE};
use rungd::source::render::{Style, render};
use rungd::source::span::{FileId, SourceFile};

const PRINTS: &str = "<!-- prints -->\n\n```text\n";

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs/findings")
}

fn update() -> bool {
    std::env::var_os("UPDATE_EXPECT").is_some()
}

fn page(row: &Row) -> String {
    let path = folder().join(format!("{}.md", row.name));
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The TOML blocks behind a mark, up to the next one: a file each, named by a comment in its first
/// line where there are several.
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

/// All findings of a ladder file, or of a controller file and its ladder files behind it.
fn findings(files: &[SourceFile]) -> Vec<Finding> {
    if !controller::is_controller(&files[0].text) {
        let (program, mut findings) = load_ladders(files, &LoadOptions::default());
        let Some(program) = program else { return findings };
        findings.extend(check::check(&program, &[]));
        return check::silence(&program, findings);
    }
    let (written, mut findings) = controller::read(&files[0].text, FileId(0));
    let Some(written) = written else { return findings };
    let options = LoadOptions {
        sizes: written.memory.clone(),
        order: written.order.clone(),
        first_file: FileId(1),
    };
    let (program, found) = load_ladders(&files[1..], &options);
    findings.extend(found);
    let Some(program) = program else { return findings };
    let (resolved, found) = resolve_controller(&written, &program);
    findings.extend(found);
    findings.extend(check::check(&program, &resolved.retain));
    check::silence(&program, findings)
}

#[test]
fn every_page_belongs_to_a_finding_and_says_its_summary() {
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

fn summary(row: &Row) -> String {
    format!("{:?}: {}", row.severity, row.summary)
}

#[test]
fn the_wrong_examples_give_their_finding_and_the_right_ones_none() {
    let mut failures = String::new();
    for row in TABLE {
        let page = page(row);
        let wrong = example(&page, "<!-- wrong -->");
        let found = findings(&wrong);
        let printed = render(&found, &wrong, Style::default());
        let other = |f: &Finding| f.code != row.code && f.severity() == Severity::Error;
        if !found.iter().any(|f| f.code == row.code) || found.iter().any(other) {
            failures.push_str(&format!("{}: the wrong example gives\n{printed}\n", row.name));
        } else {
            failures.push_str(&compare(row, &page, &printed));
        }
        let right = example(&page, "<!-- right -->");
        let found = findings(&right);
        if !found.is_empty() {
            let printed = render(&found, &right, Style::default());
            failures.push_str(&format!("{}: the right example gives\n{printed}\n", row.name));
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// The printed finding in the page against what the program prints.
fn compare(row: &Row, page: &str, printed: &str) -> String {
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
