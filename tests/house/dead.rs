//! Every public item is used: its name also stands somewhere else than at its definition.
//!
//! The compiler sees unused private items. A public item could be used by a test, a bench or a fuzz
//! target, so the compiler keeps silent; this test reads them all. It goes by names: an unused item
//! whose name something else also has is not found.

use std::collections::BTreeMap;
use std::path::Path;

/// The folders whose sources may use an item.
const FOLDERS: [&str; 4] = ["src", "tests", "benches", "fuzz"];

/// The words of a text that are no part of a comment.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
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

#[test]
fn every_public_item_is_used() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let texts = FOLDERS.map(|folder| {
        let mut files = Vec::new();
        super::collect(&root.join(folder), &mut files);
        let text = |path| std::fs::read_to_string(path).expect("a source is readable");
        files.into_iter().map(text).collect::<Vec<String>>()
    });
    let [own, others @ ..] = &texts;
    let own: Vec<&str> = own.iter().map(String::as_str).collect();
    let others: Vec<&str> = others.iter().flatten().map(String::as_str).collect();
    let count = own.iter().flat_map(|text| public(text)).count();
    assert!(count > 1000, "only {count} public items were found");
    let unused = unused(&own, &others);
    assert!(unused.is_empty(), "nothing uses these: remove them: {unused:?}");
}

#[test]
fn an_unused_item_is_found() {
    let source = "\
pub struct Point<T> { x: T }
impl Point {
    pub const fn origin() {}
    pub async fn moved() {} // origin
    pub(crate) fn own() {}
}
pub const FAR: Point = Point;
";
    assert_eq!(unused(&[source], &[]), ["origin", "moved", "FAR"]);
    assert_eq!(unused(&[source], &["let far = FAR.moved();"]), ["origin"]);
}
