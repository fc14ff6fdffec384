//! A page of `docs/`, for tests that execute its examples. Each test uses a part of this module.

use std::path::Path;

/// A page's text.
pub fn text(name: &str) -> String {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("docs").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The code blocks of a page in one language, in order.
pub fn blocks(page: &str, language: &str) -> Vec<String> {
    let fence = format!("```{language}\n");
    let bodies = page.split(&fence).skip(1);
    bodies.map(|body| body.split("```").next().unwrap_or_default().to_owned()).collect()
}

/// The code block of a page that shows this file: its first line is a comment with the name.
pub fn file(page: &str, name: &str) -> String {
    let first = format!("# {name}\n");
    let block = blocks(page, "toml").into_iter().find(|block| block.starts_with(&first));
    block.unwrap_or_else(|| panic!("no block begins with {first:?}"))
}
