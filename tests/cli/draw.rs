//! `rungd draw` as a user runs it: text, SVG and HTML, marks of coverage, refusals.
//! `crates/lab/src/draw/tests.rs` shows that a drawing is the same rung.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use expect_test::expect;

use super::fmt::rungd;

const LADDER: &str = r#"[ladder]
name = "plant"
doc = "A <b>tank</b>"

[tags]
start = { at = "X0", doc = "The \"green\" button" }
full = { at = "X1" }
valve = { at = "Y0" }
level = { at = "D0" }
parts = { at = "CT0" }

[[program]]
name = "Main"

[[program.rung]]
name = "fill"
doc = "Until it is full & no longer."
when = ["start | valve", "!(full | level >= 90)"]
do = ["OUT valve", "RUN Drain"]

[[program.rung.branch]]
when = ["rise(full)"]
do = ["SET C0"]

[[program.rung]]
leg.up = ["full"]
leg.rst = ["!start"]
do = ["CNT parts preset=3"]

[[program]]
name = "Drain"

[[program.stage]]
name = "Open"
rung = [{ when = ["full"], do = ["JMP Close"] }]

[[program.stage]]
name = "Close"
rung = [{ when = ["!full"], do = ["EXIT", "RST C0"] }]
"#;

const TEST: &str = r#"ladder = ["plant.toml"]

[[scenario]]
name = "it opens"
steps = ["set start 1", "run 2 scans", "expect: valve"]
"#;

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    fs::write(folder.join("plant.toml"), LADDER).expect("written");
    fs::write(folder.join("plant.test.toml"), TEST).expect("written");
    folder
}

/// The standard output of a command, which must succeed without text on standard error.
fn printed(args: &[&str], folder: &Path) -> String {
    let output = rungd(args, folder);
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    assert_eq!(output.status.code(), Some(0));
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn a_ladder_is_drawn_as_text() {
    let text = printed(&["draw", "plant.toml"], &folder("draw-text"));
    expect![[r#"
        Ladder plant
        ============
        A <b>tank</b>

        Main (Program, always runs)
        ---------------------------

        1. fill  plant.toml:15
        Until it is full & no longer.
        │ start   full                                                     valve     │
        ├──] [──┬─]/[────[!(level >= 90)]─┬─────────────────────────────────( )──────┤
        │  X0   │  X1                     │                                  Y0      │
        │ valve │                         │                                          │
        ├──] [──┘                         ├──────────────────────────────[RUN Drain]─┤
        │  Y0                             │                                          │
        │                                 │ full                             C0      │
        │                                 └─]P[─────────────────────────────(S)──────┤
        │                                    X1                                      │

        2.  plant.toml:25
        │ full                                            ┌────────────────────────┐ │
        ├──] [────────────────────────────────────────────┤ up  CNT parts preset=3 ├─┤
        │  X1                                             │                        │ │
        │ start                                           │                        │ │
        ├──]/[────────────────────────────────────────────┤ rst                    │ │
        │  X0                                             └────────────────────────┘ │

        Drain (Program)
        ---------------

        Stages of Drain: Open, Close
          Open -> Close: JMP, rung 1
          Close -> the end: EXIT, rung 1

        Stage Drain.Open
        ----------------

        1.  plant.toml:35
        │ full                                                                       │
        ├─] [────────────────────────────────────────────────────────────[JMP Close]─┤
        │  X1                                                                        │

        Stage Drain.Close
        -----------------

        1.  plant.toml:39
        │ full                                                                       │
        ├─]/[──┬──────────────────────────────────────────────────────────────[EXIT]─┤
        │  X1  │                                                                     │
        │      │                                                             C0      │
        │      └────────────────────────────────────────────────────────────(R)──────┤

    "#]]
    .assert_eq(&text);
}

#[test]
fn an_ascii_drawing_has_only_ascii_characters() {
    let text = printed(&["draw", "--ascii", "plant.toml"], &folder("draw-ascii"));
    assert!(text.is_ascii(), "{text}");
    assert!(text.contains("+--] [--+"), "{text}");
}

/// Every link of a page leads to a place in the page, and the page requests nothing from outside.
#[test]
fn a_page_has_no_broken_links_and_no_outside_requests() {
    let folder = folder("draw-page");
    assert_eq!(printed(&["draw", "plant.toml", "-o", "plant.html"], &folder), "");
    let page = fs::read_to_string(folder.join("plant.html")).expect("a page");
    let values = |name: &str| -> Vec<String> {
        let begin = format!(" {name}=\"");
        let parts = page.split(begin.as_str()).skip(1);
        parts.filter_map(|part| Some(part.split_once('"')?.0.to_owned())).collect()
    };
    let ids = values("id");
    let known: HashSet<&String> = ids.iter().collect();
    assert_eq!(known.len(), ids.len(), "an id is there twice: {ids:?}");
    let links = values("href");
    assert!(links.len() > 20, "{links:?}");
    for link in links {
        let id = link.strip_prefix('#').unwrap_or_else(|| panic!("{link} leads outside"));
        assert!(known.contains(&id.to_owned()), "{link} leads nowhere");
    }
    assert!(values("src").is_empty());
    for part in
        ["A &lt;b&gt;tank&lt;/b&gt;", "The &quot;green&quot; button", "full &amp; no longer"]
    {
        assert!(page.contains(part), "{part}");
    }
}

/// An instruction that turns a Stage OFF is not a transition to that Stage.
#[test]
fn turning_off_a_stage_is_described_and_not_drawn_as_an_arrow() {
    let folder = folder("draw-off");
    let text = LADDER.replace("\"JMP Close\"", "\"SGRST Close\"");
    fs::write(folder.join("plant.toml"), text).expect("written");
    let said = printed(&["draw", "plant.toml"], &folder);
    assert!(said.contains("  Open turns Close OFF: SGRST, rung 1\n"), "{said}");
    printed(&["draw", "plant.toml", "-o", "plant.html"], &folder);
    let page = fs::read_to_string(folder.join("plant.html")).expect("a page");
    assert!(page.contains("<li>Open turns Close OFF: SGRST, rung 1</li>"));
    assert!(!page.contains("class=\"way\""));
}

#[test]
fn a_picture_is_a_complete_svg_file() {
    let folder = folder("draw-picture");
    assert_eq!(printed(&["draw", "plant.toml", "-o", "plant.svg"], &folder), "");
    let picture = fs::read_to_string(folder.join("plant.svg")).expect("a picture");
    assert!(picture.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\""), "{picture}");
    assert_eq!(picture.matches("<g ").count(), picture.matches("</g>").count());
    assert!(!picture.contains("<a "), "{picture}");
}

#[test]
fn elements_that_tests_did_not_cover_are_marked() {
    let folder = folder("draw-coverage");
    let report = printed(&["test", "--coverage", "--json", "plant.test.toml"], &folder);
    fs::write(folder.join("report.json"), report).expect("written");
    let args = ["draw", "plant.toml", "--coverage", "report.json"];
    let text = printed(&args, &folder);
    for said in ["tests: start never OFF", "tests: full never ON"] {
        assert!(text.contains(said), "{said}:\n{text}");
    }
    assert!(!text.contains("tests: valve"), "{text}");
    let page = [&args[..], &["-o", "plant.html"]].concat();
    printed(&page, &folder);
    let page = fs::read_to_string(folder.join("plant.html")).expect("a page");
    assert!(page.contains("X1 never ON"), "the page says it in words");
    // The report is about the text before this change.
    fs::write(folder.join("plant.toml"), format!("\n{LADDER}")).expect("written");
    let output = rungd(&args, &folder);
    let said = String::from_utf8(output.stderr).expect("text");
    let why = "report.json: the report belongs to a different version of the ladder: Main, rung 1";
    assert!(said.contains(why), "{said}");
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn an_invalid_drawing_command_is_refused() {
    let folder = folder("draw-refused");
    fs::write(folder.join("no.json"), "{}").expect("written");
    fs::write(folder.join("bad.toml"), LADDER.replace("OUT valve", "OUT valv")).expect("written");
    let check = |args: &[&str], code: i32, why: &str| {
        let output = rungd(args, &folder);
        let said = String::from_utf8(output.stderr).expect("text");
        assert!(said.contains(why), "{said}");
        assert_eq!(output.status.code(), Some(code), "{said}");
    };
    check(&["draw", "plant.toml", "-o", "plant.pdf"], 2, "a drawing is .svg, .html or .txt");
    check(&["draw", "plant.toml", "--coverage", "no.json"], 2, "this is not a report of");
    check(&["draw", "none.toml"], 74, "none.toml: No such file");
    check(&["draw", "bad.toml"], 78, "error[unknown-name]");
    check(&["draw"], 2, "required");
}
