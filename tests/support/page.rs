//! A page of `docs/`, for the tests that execute what it shows; each uses a part of this.
#![allow(dead_code)]

use std::path::Path;

/// A page's text.
pub fn text(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The page's blocks of a language, in order.
pub fn blocks(page: &str, language: &str) -> Vec<String> {
    let fence = format!("```{language}\n");
    let bodies = page.split(&fence).skip(1);
    bodies.map(|body| body.split("```").next().unwrap_or_default().to_owned()).collect()
}

/// The file that a block of the page shows: its first line is a comment with the file's name.
pub fn file(page: &str, name: &str) -> String {
    let first = format!("# {name}\n");
    let block = blocks(page, "toml").into_iter().find(|block| block.starts_with(&first));
    block.unwrap_or_else(|| panic!("no block begins with {first:?}"))
}
