//! `docs/instructions/`: one page for each instruction. The page shows the facts of the
//! instruction's row in the table. Its examples pass the check without a finding. Its timing
//! diagram is the one that `rungd sim` draws from the ladder, the stimulus and the arguments beside
//! it.
//!
//! `UPDATE_PAGES=1 cargo test --test texts language::instruction_pages` updates titles, facts, diagrams
//! and the index.

use std::fs;
use std::path::PathBuf;
use std::sync::Once;

use crate::language::page_parts::{assert_in_order, files, read, simulated, update, with_part};
use rungd_config::explain::facts;
use rungd_config::load;
use rungd_engine::isa::Spec;
use rungd_engine::isa::instruction::TABLE;
use rungd_language::source::finding;
use rungd_language::source::render::{Style, render};

/// The families of the index, each with its first instruction in the table.
const FAMILIES: [(&str, &str); 8] = [
    ("OUT", "Coils"),
    ("CNT", "Counters"),
    ("RSTT", "Timers"),
    ("CTU", "Sensaphone counters"),
    ("MOVE", "Words"),
    ("RUN", "Programs and Tasks"),
    ("JMP", "Stages"),
    ("STOP", "The controller"),
];

const SECTIONS: [&str; 7] = [
    "## Behaviour",
    "## Termination",
    "## Timing diagram",
    "## Example",
    "## Notes",
    "## See also",
    "## Source",
];

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs/instructions")
}

fn file_name(spec: &Spec) -> String {
    format!("{}.md", spec.name.to_ascii_lowercase())
}

/// The text of a page; with `UPDATE_PAGES=1`, after the update of all pages.
fn page(spec: &Spec) -> String {
    static WRITTEN: Once = Once::new();
    WRITTEN.call_once(|| {
        if update() {
            write();
        }
    });
    page_now(spec)
}

fn page_now(spec: &Spec) -> String {
    read(&folder().join(file_name(spec)))
}

fn write() {
    for spec in TABLE {
        fs::write(diagram(spec, "svg"), drawn(spec)).expect("writable");
        fs::write(folder().join(file_name(spec)), expected(spec)).expect("writable");
    }
    fs::write(folder().join("README.md"), index()).expect("writable");
}

#[test]
fn every_mnemonic_has_a_page_and_every_page_a_mnemonic() {
    let _ = page(&TABLE[0]);
    let mut names: Vec<String> = TABLE.iter().map(|spec| spec.name.to_ascii_lowercase()).collect();
    names.sort();
    let mut pages = files(&folder(), ".md");
    pages.retain(|name| name != "README");
    assert_eq!(pages, names);
    for ending in [".toml", ".csv", ".args", ".svg"] {
        assert_eq!(files(&folder().join("diagrams"), ending), names, "{ending}");
    }
}

#[test]
fn every_page_has_its_sections_in_order() {
    for spec in TABLE {
        assert_in_order(spec.name, &page(spec), &SECTIONS);
    }
}

#[test]
fn diagrams_and_facts_equal_the_output_of_the_program() {
    let mut stale = Vec::new();
    for spec in TABLE {
        if page(spec) != expected(spec) {
            stale.push(file_name(spec));
        }
        if read(&diagram(spec, "svg")) != drawn(spec) {
            stale.push(diagram(spec, "svg").display().to_string());
        }
    }
    assert!(stale.is_empty(), "not what UPDATE_PAGES=1 writes: {stale:#?}");
}

/// A page with all generated parts up to date.
fn expected(spec: &Spec) -> String {
    let page = page_now(spec);
    let (_, rest) = page.split_once('\n').expect("a page has lines");
    let page = format!("# {}: {}\n{rest}", spec.name, spec.title);
    let facts = format!("```text\n{}```\n", facts(spec));
    let page = with_part(&page, "<!-- form -->", &facts);
    with_part(&page, "<!-- diagram -->", &picture(spec))
}

fn diagram(spec: &Spec, ending: &str) -> PathBuf {
    folder().join(format!("diagrams/{}.{ending}", spec.name.to_ascii_lowercase()))
}

/// The diagram as the simulator draws it.
fn drawn(spec: &Spec) -> String {
    let name = spec.name.to_ascii_lowercase();
    simulated(&name, None, &|ending| diagram(spec, ending))
}

/// The diagram's part of the page, with the ladder and the command that draw it.
fn picture(spec: &Spec) -> String {
    let file = spec.name.to_ascii_lowercase();
    let args = read(&diagram(spec, "args"));
    let ladder = read(&diagram(spec, "toml"));
    let (_, ladder) = ladder.split_once("\n\n").expect("a title, and the ladder");
    format!(
        "![Timing diagram of {name}](diagrams/{file}.svg)\n\nThis ladder, drawn in \
         `docs/instructions/diagrams` with\n`rungd sim {file}.toml --stimulus {file}.csv \
         {args} --trace {file}.svg`\n(numbers in \
         parentheses below it are scans):\n\n```toml\n{ladder}```\n",
        name = spec.name,
        args = args.trim()
    )
}

#[test]
fn every_example_passes_the_check_without_a_finding() {
    let place = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("instructions");
    fs::create_dir_all(&place).expect("a folder for the examples");
    let mut failures = String::new();
    for spec in TABLE {
        let page = page(spec);
        let examples: Vec<&str> = page.split("```toml\n").skip(1).collect();
        assert_eq!(examples.len(), 2, "{}: the diagram's ladder and an example", spec.name);
        for (at, example) in examples.into_iter().enumerate() {
            let text = example.split("```").next().unwrap_or(example);
            let shown = text.contains(&format!("\"{}", spec.name));
            assert!(shown, "{}: the example shows it", spec.name);
            let path = place.join(format!("{}-{at}.toml", spec.name));
            fs::write(&path, text).expect("writable");
            let loaded = load::ladder_files(&[path]).expect("it was written");
            if !loaded.findings.is_empty() {
                failures.push_str(&render(&loaded.findings, &loaded.files, Style::default()));
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn the_index_lists_the_instructions_by_family() {
    let _ = page(&TABLE[0]);
    assert_eq!(read(&folder().join("README.md")), index());
}

fn index() -> String {
    let mut text = "# Instructions\n\nOne page an instruction: its form, what it does in every \
                    situation, a timing diagram made by the\nsimulator, an example. \
                    `rungd explain NAME` prints most of it in a terminal. What every word means,\n\
                    to the bit, is in [semantics.md](../semantics.md); how a ladder is \
                    written, in\n\
                    [language.md](../language.md).\n"
        .to_owned();
    for spec in TABLE {
        if let Some((_, family)) = FAMILIES.iter().find(|(first, _)| *first == spec.name) {
            text.push_str(&format!("\n## {family}\n\n| instruction | form | |\n|---|---|---|\n"));
        }
        let (name, file, form) = (spec.name, file_name(spec), spec.form());
        text.push_str(&format!("| [{name}]({file}) | `{form}` | {} |\n", purpose(spec)));
    }
    text
}

/// The paragraph below a page's title, as one line.
fn purpose(spec: &Spec) -> String {
    let page = page_now(spec);
    let paragraph = page.split("\n\n").nth(1).expect("a page says what its instruction is for");
    paragraph.replace('\n', " ")
}

#[test]
fn every_link_of_the_instruction_pages_leads_to_a_file_or_section() {
    let _ = page(&TABLE[0]);
    let mut pages: Vec<PathBuf> = TABLE.iter().map(|spec| folder().join(file_name(spec))).collect();
    pages.push(folder().join("README.md"));
    for path in pages {
        let page = read(&path);
        for link in page.split("](").skip(1) {
            let link = link.split(')').next().unwrap_or(link);
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = folder().join(file);
            assert!(target.is_file(), "{}: {link}", path.display());
            let there = anchor.is_empty() || anchors(&read(&target)).any(|a| a == anchor);
            assert!(there, "{}: no heading for {link}", path.display());
        }
    }
}

/// The anchors of a page's headings.
fn anchors(page: &str) -> impl Iterator<Item = String> + '_ {
    page.lines().filter(|line| line.starts_with('#')).map(|line| {
        let title = line.trim_start_matches('#').trim().to_lowercase().replace(' ', "-");
        title.chars().filter(|c| c.is_alphanumeric() || *c == '-').collect()
    })
}

#[test]
fn findings_that_a_page_names_exist() {
    for spec in TABLE {
        let page = page(spec);
        for word in page.split("(`").skip(1).filter_map(|rest| rest.split("`)").next()) {
            for name in word.split("`, `").filter(|n| n.contains('-') && !n.contains(' ')) {
                let known = finding::TABLE.iter().any(|row| row.name == name);
                assert!(known, "{}: no finding is called {name}", spec.name);
            }
        }
    }
}
