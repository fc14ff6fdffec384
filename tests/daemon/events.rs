//! Compares the catalogue of events with the sources: every event has a log line, and an event's
//! code never changes. (The compiler checks that every line names an event: `say!` takes a constant
//! of the catalogue.)
//!
//! Also compares the catalogue with the files that are made from it. After a change, write them
//! again: `UPDATE_EVENTS=1 cargo test --test controller daemon::events::`. This adds codes to
//! `tests/events.txt`, and never changes one.

use rungd_test_support::journal;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use rungd_runtime::events::{self, Event, GROUPS, LineLimit, Silence};

/// Events that have no log line yet.
const WITHOUT_LINE: &[&str] = &[];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a source folder is readable") {
        let path = entry.expect("an entry is readable").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() && name != "tests" && name != "events" {
            collect(&path, files);
        } else if name.ends_with(".rs") {
            files.push(path);
        }
    }
}

/// All sources except the catalogue's, without their tests and comments.
fn sources() -> Vec<(String, String)> {
    let mut files = Vec::new();
    ["crates", "src"].iter().for_each(|folder| collect(&root().join(folder), &mut files));
    let text = |path: PathBuf| {
        let whole = fs::read_to_string(&path).expect("a source is readable");
        let code = whole.split("\n#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        let lines = code.lines().map(|line| match line.trim_start().starts_with("//") {
            true => "",
            false => line,
        });
        (path.display().to_string(), lines.collect::<Vec<_>>().join("\n"))
    };
    files.into_iter().map(text).collect()
}

#[test]
fn every_event_of_the_catalogue_is_logged_somewhere() {
    let code: String = sources().into_iter().map(|(_, text)| text).collect();
    let mut used = BTreeSet::new();
    for before in ["say!(", "tell!(", "&events::"] {
        for (at, _) in code.match_indices(before) {
            let rest = code[at + before.len()..].trim_start();
            let end = rest.find(|c: char| !c.is_ascii_uppercase() && c != '_');
            used.insert(&rest[..end.unwrap_or(rest.len())]);
        }
    }
    for event in events::all() {
        let constant = event.name.to_ascii_uppercase().replace('-', "_");
        let (name, is_used) = (event.name, used.contains(constant.as_str()));
        let is_exempt = WITHOUT_LINE.contains(&name);
        assert!(is_used || is_exempt, "nothing says `{constant}`: take its row out");
        assert!(!(is_used && is_exempt), "`{constant}` is said: no exemption needed");
    }
}

/// The recipe names every file that mentions events by their IDs, and every file that the recipe
/// names exists.
#[test]
fn the_recipe_names_every_file_that_mentions_events() {
    let page = fs::read_to_string(root().join("CONTRIBUTING.md")).expect("a page");
    let recipe = page.split("## Adding an event\n").nth(1).expect("the recipe");
    let recipe = recipe.split("\n## ").next().unwrap_or_default();
    let named: Vec<&str> = recipe.split('`').filter(|word| word.contains('/')).collect();
    for place in &named {
        assert!(root().join(place).exists(), "the recipe names {place}, which is not there");
    }
    let mut files = Vec::new();
    for folder in ["crates", "src", "docs", "config", "packaging", "tests"] {
        all_files(&root().join(folder), &mut files);
    }
    // An ID has 32 letters and digits.
    let has_id = |word: &str| events::all().any(|event| word.contains(event.id));
    let has_ids = |text: &str| {
        text.split(|c: char| !c.is_ascii_alphanumeric())
            .any(|word| word.len() >= 32 && has_id(word))
    };
    assert!(events::all().all(|event| has_ids(&format!("({})", event.id))));
    for path in files {
        let Ok(text) = fs::read_to_string(&path) else { continue };
        if has_ids(&text) {
            let place = path.strip_prefix(root()).expect("it was found there").to_string_lossy();
            let is_named = named.iter().any(|named| place.starts_with(named));
            assert!(is_named, "{place} has IDs of events, and the recipe does not name it");
        }
    }
}

fn all_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder is readable") {
        let path = entry.expect("an entry is readable").path();
        if path.is_dir() {
            all_files(&path, files);
        } else {
            files.push(path);
        }
    }
}

#[test]
fn an_event_code_never_changes() {
    let path = root().join("tests/events.txt");
    let mut kept = fs::read_to_string(&path).unwrap_or_default();
    let row = |event: &Event| format!("{} {} {}", event.code(), event.id, event.name);
    let rows: Vec<String> = events::all().map(row).collect();
    for line in kept.lines() {
        assert!(rows.iter().any(|row| row == line), "given once, it stays: {line}");
    }
    let new: Vec<&String> =
        rows.iter().filter(|row| !kept.lines().any(|line| line == *row)).collect();
    if std::env::var_os("UPDATE_EVENTS").is_some() {
        new.iter().for_each(|row| _ = writeln!(kept, "{row}"));
        let mut lines: Vec<&str> = kept.lines().collect();
        lines.sort_unstable();
        fs::write(&path, lines.join("\n") + "\n").expect("tests/events.txt");
    } else {
        assert!(new.is_empty(), "not in tests/events.txt (UPDATE_EVENTS=1 adds them): {new:#?}");
    }
}

/// Checks that a file made from the catalogue is up to date, or writes it.
fn keep(path: &str, text: &str) {
    let path = root().join(path);
    if std::env::var_os("UPDATE_EVENTS").is_some() {
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(&path, text).expect("the file");
    }
    let there = fs::read_to_string(&path).unwrap_or_default();
    let hint = "make it anew: UPDATE_EVENTS=1 cargo test --test controller daemon::events::";
    assert!(there == text, "{} is not what the catalogue says; {hint}", path.display());
}

#[test]
fn the_catalogue_file_matches_the_program() {
    let output = Command::new(env!("CARGO_BIN_EXE_rungd"))
        .args(["events", "--catalog"])
        .output()
        .expect("rungd runs");
    assert!(output.status.success());
    keep("config/systemd/rungd.catalog", &String::from_utf8(output.stdout).expect("text"));
}

/// systemd's tools can read the catalogue file.
#[test]
fn journalctl_accepts_the_catalogue() {
    if !journal::installed("journalctl", "systemd") {
        return;
    }
    let tree = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("cat-{}", std::process::id()));
    for folder in ["usr/lib/systemd/catalog", "var/lib/systemd/catalog"] {
        fs::create_dir_all(tree.join(folder)).expect("a folder");
    }
    let file = tree.join("usr/lib/systemd/catalog/rungd.catalog");
    fs::write(file, events::catalog()).expect("a file");
    let journalctl = |arguments: &[&str]| {
        let output = Command::new("journalctl").arg("--root").arg(&tree).args(arguments).output();
        let output = output.expect("journalctl runs");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{arguments:?}: {output:?}");
        text
    };
    journalctl(&["--update-catalog"]);
    let listed = journalctl(&["--list-catalog"]);
    for event in events::all() {
        let row = format!("{} rungd: {} ({})", event.id, event.name, event.code());
        assert!(listed.contains(&row), "{row} is not in\n{listed}");
    }
    let event = events::named("overrun").expect("a row");
    let shown = journalctl(&["--dump-catalog", event.id]);
    assert!(shown.contains("What to do: If late:"), "{shown}");
    let _ = fs::remove_dir_all(&tree);
}

#[test]
fn the_page_lists_every_event() {
    let mut page = String::from(HEAD);
    for (hundred, title) in GROUPS {
        let _ = write!(page, "\n## {title}\n\n| code | event | level | at most | ");
        page.push_str("off | meaning | what to do |\n|---|---|---|---|---|---|---|\n");
        for event in events::all().filter(|event| event.number / 100 == hundred) {
            let Event { name, meaning, remedy, .. } = event;
            let limit = match event.limit {
                LineLimit::NONE => "".to_owned(),
                limit => format!("{}, then {}/s", limit.burst, limit.per_second()),
            };
            let off = match event.silence {
                Silence::Never => "never",
                Silence::ByName => "",
                Silence::ByBlocks => "`none`",
                Silence::ByStages => "`programs`, `none`",
            };
            let cell = |text: &str| text.replace('|', "\\|");
            let (code, level) = (event.code(), event.level.name());
            let (meaning, remedy) = (cell(meaning), cell(remedy));
            let _ = writeln!(
                page,
                "| `{code}` | `{name}` | {level} | {limit} | {off} | {meaning} | {remedy} |"
            );
        }
    }
    keep("docs/events.md", &page);
}

const HEAD: &str = "# The events of the log

Every line of the log is one event: a code and a name, which never change, then a sentence, then
key=value. `rungd explain alarm-on` or `rungd explain RUNGD-0301` explains one on the spot,
`journalctl -u rungd -x` each line beneath it, and [thirty questions](questions.md) shows what to ask
a log. How a line is built is in [running](running.md).

*At most* is how many lines of the event are written at once, and then in a second; what is left
out is counted, and told as `lines-withheld` with the event's name. At level debug all of them are
written. Alarms are limited each by itself ([running](running.md)).

*Off* says whether a controller file may silence the event. By default it may: `[log.events]` gives it a level, or `\"off\"`.
`never`: the event must stay in the log, at level error, warn or info. These tell of starts and ends, modes, faults, alarms,
overruns, lost devices, changes by people and by reloads, and of what the log, retentive memory or the scan log has lost.
`none` and `programs`: this value of `[log] blocks` leaves it out too ([the settings of the log](running.md#the-settings-of-the-log)).

This page is made of the table in `crates/runtime/src/events`, by `UPDATE_EVENTS=1 cargo test --test controller daemon::events::`.
";
