//! Every public item is used: its name also stands somewhere else than at its definition.
//!
//! The compiler reports unused items that are private or `pub(crate)`. A `pub` item could be used
//! by a test, a bench or a fuzz target, which the compiler does not see; this test reads them all.
//! It compares names, so it does not find an unused item if something else has its name, or if the
//! item's own `impl`, its own body, a string or a `pub use` names it. Modules, fields and variants
//! are not checked.

use std::collections::BTreeMap;
use std::path::Path;

/// The folders whose sources may use an item, besides those of the items.
const OTHERS: [&str; 4] = ["tests", "benches", "fuzz/src", "fuzz/fuzz_targets"];

/// The words of a text that are no part of a comment.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    let lines = code.map(|line| line.split(" // ").next().unwrap_or_default());
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    lines.flat_map(move |line| line.split(move |c| !is_part(c))).filter(|word| !word.is_empty())
}

/// The names of the items and associated items that a text defines as `pub`.
fn public(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(|line| {
        let mut words = line.trim_start().strip_prefix("pub ")?.split_whitespace().peekable();
        while words.next_if(|word| ["async", "unsafe"].contains(word)).is_some() {}
        let mut what = words.next()?;
        if what == "const" && words.peek() == Some(&"fn") {
            what = words.next()?;
        }
        let items = ["fn", "const", "static", "struct", "enum", "union", "trait", "type"];
        items.contains(&what).then(|| self::words(words.next()?).next()).flatten()
    })
}

/// The public items of these sources whose names stand nowhere else in these sources and others.
fn unused<'t>(sources: &[&'t str], others: &[&'t str]) -> Vec<&'t str> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for word in sources.iter().chain(others).flat_map(|text| words(text)) {
        *counts.entry(word).or_default() += 1;
    }
    let public = sources.iter().flat_map(|text| public(text));
    public.filter(|name| counts.get(name) == Some(&1)).collect()
}

/// The texts of the sources in a folder.
fn texts(folder: &str) -> Vec<String> {
    let mut files = Vec::new();
    super::collect(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder), &mut files);
    let text = |path| std::fs::read_to_string(path).expect("a source is readable");
    files.into_iter().map(text).collect()
}

#[test]
fn every_public_item_is_used() {
    let own = super::sources();
    let mut others = OTHERS.map(texts).concat();
    for (package, _) in super::source_folders().into_iter().filter(|(name, _)| name != "src") {
        let tests = format!("crates/{package}/tests");
        if super::root().join(&tests).exists() {
            others.extend(texts(&tests));
        }
    }
    let own: Vec<&str> = own.iter().map(|source| source.text.as_str()).collect();
    let others: Vec<&str> = others.iter().map(String::as_str).collect();
    let count = own.iter().flat_map(|text| public(text)).count();
    assert!(count > 1000, "only {count} public items were found");
    let unused = unused(&own, &others);
    assert!(unused.is_empty(), "nothing uses these: remove them: {unused:?}");
}

/// This file is among those that may use an item, so the names here are those of no item.
#[test]
fn an_unused_item_is_found() {
    let source = "\
pub struct Quux<T> { x: T }
impl Quux {
    pub const fn quux_made() {}
    pub async fn quux_gone() {} // quux_made
    pub(crate) fn quux_own() {}
}
pub const QUUX_FAR: Quux = Quux;
";
    assert_eq!(unused(&[source], &[]), ["quux_made", "quux_gone", "QUUX_FAR"]);
    let other = "let url = \"http://quux\"; QUUX_FAR.quux_gone();";
    assert_eq!(unused(&[source], &[other]), ["quux_made"]);
}
