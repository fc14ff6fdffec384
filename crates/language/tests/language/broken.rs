//! Files that are not valid TOML while a person types: a broken line must not cause findings about
//! the rest of the file. The test breaks the shipped files; `crates/config/src/load/broken.rs` tests the findings
//! in detail.

use std::fs;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use rungd_config::load::{Loaded, controller_file, is_controller_file, ladder_files};
use rungd_lab::testing::read_suite;
use rungd_language::source::finding::Finding;
use rungd_language::source::render::{Style, render};
use rungd_language::source::span::SourceFile;

use rungd_test_support::folder::TestFolder;
use rungd_test_support::shares::{Share, in_shares};

/// Makes a folder with a copy of the shipped files; also returns their paths.
fn shipped() -> (TestFolder, Vec<PathBuf>) {
    let (folder, root) =
        (TestFolder::new("broken"), Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")));
    let mut files = Vec::new();
    // Some tests of the library refer to the ladders of its diagrams.
    copy(&root.join("docs/lib"), &folder.path().join("docs/lib"), &mut Vec::new());
    copy(&root.join("config"), &folder.path().join("config"), &mut files);
    files.sort();
    assert!(files.len() > 70, "{}", files.len());
    (folder, files)
}

fn copy(from: &Path, to: &Path, files: &mut Vec<PathBuf>) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let copied = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &copied, files);
        } else if path.extension().is_some_and(|end| end == "toml") {
            fs::copy(&path, &copied).unwrap();
            files.push(copied);
        }
    }
}

/// The files and findings of a load, and whether there is a program.
type Told = (Vec<SourceFile>, Vec<Finding>, bool);

fn told(path: &Path) -> Told {
    let of = |loaded: Loaded| (loaded.files, loaded.findings, loaded.program.is_some());
    if path.to_str().unwrap().ends_with(".test.toml") {
        let read = read_suite(path).unwrap();
        (read.files, read.findings, read.suite.is_some())
    } else if is_controller_file(path).unwrap() {
        of(controller_file(path).unwrap())
    } else {
        of(ladder_files(&[path.to_owned()]).unwrap())
    }
}

fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut mixed = *state;
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

fn below(state: &mut u64, limit: usize) -> usize {
    (next(state) % limit.max(1) as u64) as usize
}

/// A text with one change within a line.
fn broken(text: &str, random: &mut u64) -> String {
    let at = |random: &mut u64| {
        let at = below(random, text.len());
        (0..=at).rev().find(|at| text.is_char_boundary(*at)).unwrap_or(0)
    };
    let place = at(random);
    let rest = &text[place..];
    let line = rest.find('\n').unwrap_or(rest.len());
    let inserted =
        ["\"", "[", "]", "{", "}", "=", ",", ".", "#", "'", "a", " ", "\n", "\\", "ä", "\"\"\""];
    let (cut, new) = match below(random, 5) {
        0 => (rest.chars().next().map_or(0, char::len_utf8), ""),
        1 => (0, inserted[below(random, inserted.len())]),
        2 => (line, ""),
        3 => (
            (0..=below(random, line + 1)).rev().find(|at| rest.is_char_boundary(*at)).unwrap_or(0),
            "",
        ),
        _ => {
            (rest.chars().next().map_or(0, char::len_utf8), inserted[below(random, inserted.len())])
        }
    };
    format!("{}{new}{}", &text[..place], &rest[cut..])
}

fn steps() -> usize {
    std::env::var("RUNGD_BROKEN_STEPS").ok().and_then(|steps| steps.parse().ok()).unwrap_or(20)
}

/// The numbers of the changed lines: one line, or two if the change split it.
fn changed_lines(text: &str, changed: &str) -> RangeInclusive<usize> {
    let same = text.bytes().zip(changed.bytes()).take_while(|(a, b)| a == b).count();
    let line = text.as_bytes()[..same].iter().filter(|byte| **byte == b'\n').count() + 1;
    line..=line + usize::from(changed.lines().count() > text.lines().count())
}

/// The new findings that are not about syntax and not in the changed lines.
fn follow(before: &Told, now: &Told, lines: RangeInclusive<usize>) -> Vec<String> {
    let is_known = |of: &Finding| {
        let mut known = before.1.iter();
        known.any(|known| known.code == of.code && known.message == of.message)
    };
    let syntax = ["toml-syntax", "out-of-place"];
    let found = now.1.iter().filter(|of| !is_known(of) && !syntax.contains(&of.code.name()));
    let shown = found.map(|of| render(std::slice::from_ref(of), &now.0, Style::default()));
    let is_there = |shown: &String| lines.clone().any(|n| shown.contains(&format!(".toml:{n}:")));
    shown.filter(|shown| !is_there(shown)).collect()
}

#[test]
fn a_broken_line_of_a_shipped_file_causes_no_other_finding() {
    let judged: Vec<_> = in_shares(judge);
    let (wrong, judged): (Vec<_>, Vec<usize>) = judged.into_iter().unzip();
    let (wrong, judged) = (wrong.concat(), judged.iter().sum::<usize>());
    assert!(wrong.is_empty(), "{} of {judged}:\n{}", wrong.len(), wrong.join("\n"));
    assert!(judged > steps() * 10, "{judged}");
}

/// Breaks the files of a share; returns what was found besides, and the number of broken texts.
fn judge(share: Share) -> (Vec<String>, usize) {
    let (_folder, paths) = shipped();
    let (mut wrong, mut judged) = (Vec::new(), 0);
    for (_, path) in paths.iter().enumerate().filter(|(at, _)| share.has(*at)) {
        let text = fs::read_to_string(path).unwrap();
        let before = told(path);
        let mut random = text.len() as u64;
        for step in 0..steps() {
            let changed = broken(&text, &mut random);
            fs::write(path, &changed).unwrap();
            let now = told(path);
            render(&now.1, &now.0, Style::default());
            let is_syntax = |of: &Finding| of.code.name() == "toml-syntax";
            if !now.1.iter().any(is_syntax) {
                continue;
            }
            assert!(!now.2, "{} has a program", path.display());
            judged += 1;
            let found = follow(&before, &now, changed_lines(&text, &changed));
            if !found.is_empty() {
                let shown = render(&now.1, &now.0, Style::default());
                wrong.push(format!("{} step {step}:\n{shown}", path.display()));
            }
        }
        fs::write(path, &text).unwrap();
    }
    (wrong, judged)
}
