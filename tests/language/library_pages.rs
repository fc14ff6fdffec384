//! `docs/lib/`: one page for each file of the library. The page's parameters are those of the file.
//! Its example passes the check with the library. Its timing diagram is the one that `rungd sim`
//! draws.
//!
//! `UPDATE_PAGES=1 cargo test --test texts language::library_pages` updates titles, parameters, diagrams
//! and the index.

use std::fs;
use std::path::PathBuf;
use std::sync::Once;

use rungd_config::explain::library_facts;
use rungd_config::load;

use crate::language::library::LIBRARY;
use crate::language::page_parts::{assert_in_order, files, read, simulated, update, with_part};

const SECTIONS: [&str; 5] =
    ["## Behaviour", "## Timing diagram", "## Example", "## Limits", "## See also"];

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs/lib")
}

fn diagram(name: &str, ending: &str) -> PathBuf {
    folder().join(format!("diagrams/{name}.{ending}"))
}

/// The text of a page; with `UPDATE_PAGES=1`, after the update of all pages.
fn page(name: &str) -> String {
    static WRITTEN: Once = Once::new();
    WRITTEN.call_once(|| {
        if update() {
            write();
        }
    });
    page_now(name)
}

fn page_now(name: &str) -> String {
    read(&folder().join(format!("{name}.md")))
}

fn write() {
    for name in LIBRARY {
        fs::write(diagram(name, "svg"), drawn(name)).expect("writable");
        fs::write(folder().join(format!("{name}.md")), expected(name)).expect("writable");
    }
    fs::write(folder().join("README.md"), index()).expect("writable");
}

/// The comment at the beginning of a file of the library.
fn purpose(name: &str) -> String {
    let text = read(&folder().join(format!("../../config/lib/{name}.toml")));
    let head = text.lines().map_while(|line| line.strip_prefix("# "));
    head.collect::<Vec<_>>().join(" ")
}

/// A page with all generated parts up to date.
fn expected(name: &str) -> String {
    let page = page_now(name);
    let (_, rest) = page.split_once('\n').expect("a page has lines");
    let page = format!("# lib:{name}: {}\n{rest}", purpose(name).trim_end_matches('.'));
    let page = with_part(&page, "<!-- form -->", &format!("```text\n{}```\n", library_facts(name)));
    with_part(&page, "<!-- diagram -->", &picture(name))
}

/// The diagram as the simulator draws it.
fn drawn(name: &str) -> String {
    let library = format!("lib:{name}");
    simulated(name, Some(&library), &|ending| diagram(name, ending))
}

/// The diagram's part of the page, with the ladder and the command that draw it.
fn picture(name: &str) -> String {
    let args = read(&diagram(name, "args"));
    let ladder = read(&diagram(name, "toml"));
    let (_, ladder) = ladder.split_once("\n\n").expect("a title, and the ladder");
    format!(
        "![Timing diagram of lib:{name}](diagrams/{name}.svg)\n\nThis ladder, drawn in \
         `docs/lib/diagrams` with\n`rungd sim lib:{name} {name}.toml --stimulus {name}.csv {} \
         --trace {name}.svg`\n(numbers in parentheses below it are scans):\n\n```toml\n{ladder}```\n",
        args.trim()
    )
}

#[test]
fn every_file_has_a_page_and_every_page_a_file() {
    let _ = page(LIBRARY[0]);
    let mut pages = files(&folder(), ".md");
    pages.retain(|name| name != "README");
    assert_eq!(pages, LIBRARY);
    for ending in [".toml", ".csv", ".args", ".svg"] {
        assert_eq!(files(&folder().join("diagrams"), ending), LIBRARY, "{ending}");
    }
}

#[test]
fn every_page_has_its_sections_in_order() {
    for name in LIBRARY {
        assert_in_order(name, &page(name), &SECTIONS);
    }
}

#[test]
fn titles_parameters_and_diagrams_equal_the_output_of_the_program() {
    let mut stale = Vec::new();
    for name in LIBRARY {
        if page(name) != expected(name) {
            stale.push(format!("{name}.md"));
        }
        if read(&diagram(name, "svg")) != drawn(name) {
            stale.push(format!("{name}.svg"));
        }
    }
    if read(&folder().join("README.md")) != index() {
        stale.push("README.md".to_owned());
    }
    assert!(stale.is_empty(), "not what UPDATE_PAGES=1 writes: {stale:#?}");
}

/// Every parameter and tag has a doc.
#[test]
fn every_parameter_and_tag_is_explained() {
    for name in LIBRARY {
        for line in library_facts(name).lines().filter(|line| line.contains("  ")) {
            let doc = line.rsplit("  ").next().unwrap_or_default();
            let explained = doc.contains(' ') && !doc.trim_start().starts_with("or ");
            assert!(explained, "{name}: {line}");
        }
    }
}

#[test]
fn every_example_passes_the_check_without_a_finding() {
    let place = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("library-pages");
    fs::create_dir_all(&place).expect("a folder for the examples");
    for name in LIBRARY {
        let page = page(name);
        let examples: Vec<&str> = page.split("```toml\n").skip(1).collect();
        assert_eq!(examples.len(), 2, "{name}: the diagram's ladder and an example");
        for example in examples {
            let path = place.join(format!("{name}.toml"));
            fs::write(&path, example.split("```").next().unwrap_or(example)).expect("writable");
            let files = [PathBuf::from(format!("lib:{name}")), path];
            let loaded = load::ladder_files(&files).expect("it was written");
            assert!(loaded.findings.is_empty(), "{name}: {:#?}", loaded.findings);
        }
    }
}

/// The sections that `rungd explain` prints have no links, blocks or tables, because a terminal
/// cannot show them.
#[test]
fn explain_prints_the_pages_as_plain_text() {
    for name in LIBRARY {
        let page = page(name);
        for section in ["Behaviour", "Limits"] {
            let (_, text) = page.split_once(&format!("\n## {section}\n")).expect("a section");
            let text = text.split("\n## ").next().unwrap_or(text);
            for mark in ["](", "```", "<!--", "|--"] {
                assert!(!text.contains(mark), "{name}: {mark} in {section}");
            }
        }
    }
}

#[test]
fn every_link_of_the_library_pages_leads_to_a_file_or_section() {
    let _ = page(LIBRARY[0]);
    for name in LIBRARY.into_iter().chain(["README"]) {
        for link in page_now(name).split("](").skip(1) {
            let link = link.split(')').next().unwrap_or(link);
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = folder().join(file);
            assert!(target.is_file(), "{name}: {link}");
            let heading = |line: &str| {
                let title = line.trim_start_matches('#').trim().to_lowercase().replace(' ', "-");
                title.chars().filter(|c| c.is_alphanumeric() || *c == '-').collect::<String>()
            };
            let text = if anchor.is_empty() { String::new() } else { read(&target) };
            let mut headings = text.lines().filter(|line| line.starts_with('#'));
            assert!(anchor.is_empty() || headings.any(|line| heading(line) == anchor), "{link}");
        }
    }
}

fn index() -> String {
    let mut text = "# The library of templates\n\nThese files are part of the program. A controller \
                    file names those that it needs before the ladders\nthat use them:\n\n\
                    ```toml\nladder = [\"lib:debounce\", \"lib:pid\", \"programs/main.toml\"]\n```\n\n\
                    `rungd check` and `rungd sim` take them as files: `rungd sim lib:pid main.toml`. \
                    `rungd explain lib:pid`\nprints a file with its page as comments above it; \
                    to change a template, save that under a name of your own.\nHow \
                    templates are used is in [language.md](../language.md#templates). What goes by time \
                    measures it:\nno template needs a certain scan period.\n\n\
                    | file | |\n|---|---|\n"
        .to_owned();
    for name in LIBRARY {
        text.push_str(&format!("| [lib:{name}]({name}.md) | {} |\n", purpose(name)));
    }
    text
}
