//! The layout of `rungd fmt`, for shipped files in random layouts: formatting a second time changes
//! nothing, no value changes, and no comment is lost or leaves its place. No text causes a panic.
//! The shipped files are in the layout.
//!
//! `RUNGD_FORMAT_LAYOUTS` (3) is the number of layouts of each file, `RUNGD_PROPERTY_SEED` (1) the
//! first seed.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use rungd_language::format::formatted;
use toml::de::{DeTable, DeValue};
use toml_parser::Source;
use toml_parser::lexer::TokenKind;

use rungd_test_support::mangled::mangled;
use rungd_test_support::setting::setting;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// The files `*.toml` in a folder and its subfolders.
fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder is readable") {
        let path = entry.expect("an entry is readable").path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|end| end == "toml") {
            found.push(path);
        }
    }
}

/// The shipped files: their paths and texts.
fn shipped() -> Vec<(PathBuf, String)> {
    let mut paths = Vec::new();
    files(&root().join("config"), &mut paths);
    files(&root().join("docs"), &mut paths);
    assert!(paths.len() > 100, "{paths:?}");
    let text = |path: PathBuf| {
        let text = fs::read_to_string(&path).expect("readable");
        (path, text)
    };
    paths.into_iter().map(text).collect()
}

/// The keys and values of a text, without places.
fn said(text: &str) -> String {
    fn table(table: &DeTable<'_>, out: &mut String) {
        for (key, value) in table {
            out.push_str(&format!("{:?}:", key.get_ref()));
            one(value.get_ref(), out);
        }
    }
    fn one(value: &DeValue<'_>, out: &mut String) {
        match value {
            DeValue::Table(below) => {
                out.push('{');
                table(below, out);
                out.push('}');
            }
            DeValue::Array(array) => {
                out.push('[');
                array.iter().for_each(|value| one(value.get_ref(), out));
                out.push(']');
            }
            other => out.push_str(&format!("{other:?};")),
        }
    }
    let mut out = String::new();
    let parsed = DeTable::parse(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    table(parsed.get_ref(), &mut out);
    out
}

/// The comments, each with the token before it on its line, or else the token directly below it.
/// For a comment above a blank line or above the end of an array, there is no such token.
fn remarks(text: &str) -> BTreeMap<(String, String), usize> {
    let tokens: Vec<_> = Source::new(text).lex().collect();
    let of = |at: usize| tokens[at].span().start()..tokens[at].span().end();
    let kind = |at: usize| tokens[at].kind();
    let mut found = BTreeMap::new();
    for at in (0..tokens.len()).filter(|at| kind(*at) == TokenKind::Comment) {
        let trivia = [TokenKind::Whitespace, TokenKind::Comma];
        let before = (0..at).rev().find(|at| !trivia.contains(&kind(*at)));
        let place = match before.filter(|at| kind(*at) != TokenKind::Newline) {
            Some(before) => format!("behind {}", &text[of(before)]),
            None => {
                let blank = [TokenKind::Whitespace, TokenKind::Comment];
                let mut ends = 0;
                let next = (at..tokens.len()).find(|at| {
                    ends = match kind(*at) {
                        TokenKind::Newline => ends + 1,
                        TokenKind::Comment => 0,
                        _ => ends,
                    };
                    ends > 1 || !(blank.contains(&kind(*at)) || kind(*at) == TokenKind::Newline)
                });
                let next = next.filter(|_| ends < 2).map_or("", |next| &text[of(next)]);
                format!("above {}", if next == "]" { "" } else { next })
            }
        };
        let remark = text[of(at)].trim_end().to_owned();
        *found.entry((remark, place)).or_insert(0) += 1;
    }
    found
}

fn holds(name: &str, text: &str) -> String {
    let once = formatted(text).unwrap_or_else(|found| panic!("{name}: {found:?}\n{text}"));
    let twice = formatted(&once).unwrap_or_else(|found| panic!("{name}: {found:?}\n{once}"));
    assert_eq!(once, twice, "{name}: formatted again\n{text}");
    assert_eq!(said(text), said(&once), "{name}\n{text}");
    assert_eq!(remarks(text), remarks(&once), "{name}\n{text}\n---\n{once}");
    once
}

#[test]
fn shipped_files_are_formatted() {
    // `rungd fmt` leaves the files of an edge node and of an OPC UA server alone.
    let is_other = |path: &Path| path.parent().is_some_and(|folder| folder.ends_with("edge"));
    let all = shipped().into_iter().filter(|(path, _)| !is_other(path));
    for (path, text) in all {
        let after = formatted(&text).expect("it is TOML");
        assert!(after == text, "`rungd fmt {}` changes it", path.display());
    }
}

#[test]
fn the_example_of_the_page_is_formatted() {
    let page = fs::read_to_string(root().join("docs/fmt.md")).expect("readable");
    let example = page.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next());
    let example = example.expect("an example");
    assert_eq!(formatted(example).as_deref(), Ok(example));
}

#[test]
fn formatting_a_random_layout_keeps_meaning_and_comments() {
    let first = setting("RUNGD_PROPERTY_SEED", 1);
    for (path, text) in shipped() {
        let meaning = said(&text);
        for seed in first..first + setting("RUNGD_FORMAT_LAYOUTS", 3) {
            let name = format!("{}, seed {seed}", path.display());
            let other = mangled(&text, seed);
            assert_eq!(meaning, said(&other), "{name}: the test has changed it");
            let once = holds(&name, &other);
            let windows = other.replace("\r\n", "\n").replace('\n', "\r\n");
            let windows = formatted(&windows).expect("it is TOML");
            assert_eq!(windows.replace("\r\n", "\n"), once, "{name}: with CRLF");
        }
    }
}

const PIECES: [&str; 34] = [
    "[[program]]",
    "[[program.rung]]",
    "[tags]",
    "[",
    "]",
    "{",
    "}",
    "\n",
    "\n\n",
    "\r\n",
    " ",
    "\t",
    "= ",
    "=",
    ",",
    ".",
    "#",
    "# c\n",
    "a",
    "name",
    "do",
    "\"b\"",
    "'c'",
    "\"\"\"",
    "'''",
    "1.5",
    "2026-11-22 06:00:00",
    "true",
    "\u{feff}",
    "é",
    "when = [\"X0\"]\n",
    "x = { y = [1,\n2], z = {} }\n",
    "[# c\n1 # d\n, 2]",
    "\r",
];

proptest! {
    #[test]
    fn formatting_random_text_does_not_panic(
        picks in prop::collection::vec(prop::sample::select(&PIECES[..]), 0..40)
    ) {
        let text = picks.concat();
        if formatted(&text).is_ok() {
            holds("random", &text);
        }
    }

    #[test]
    fn formatting_a_randomly_edited_file_does_not_panic(
        at in 0usize..4000,
        gone in 0usize..20,
        piece in any::<String>(),
    ) {
        let text = include_str!("../../../../config/programs/filling-line.toml");
        let floor = |at: usize| {
            (0..=at.min(text.len())).rev().find(|at| text.is_char_boundary(*at))
        };
        let (from, to) = (floor(at).unwrap_or(0), floor(at + gone).unwrap_or(0));
        let changed = format!("{}{piece}{}", &text[..from], &text[to..]);
        if let Ok(once) = formatted(&changed) {
            holds("changed", &changed);
            prop_assert!(once.ends_with('\n'));
        }
    }
}
