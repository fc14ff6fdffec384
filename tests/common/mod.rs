//! What a page of `docs/` shows, for the tests that execute it.

use std::path::Path;

use rungd::resolve::controller::{Controller, resolve_controller};
use rungd::resolve::program::Program;
use rungd::resolve::{LoadOptions, load_ladders};
use rungd::source::span::{FileId, SourceFile};

/// A page's text.
pub fn page(name: &str) -> String {
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

/// A ladder and a controller file of a page, loaded without a finding.
pub fn load(page: &str, ladder: &str, controller: &str) -> (Program, Controller) {
    let source = SourceFile { name: ladder.into(), text: file(page, ladder) };
    let (program, findings) = load_ladders(&[source], &LoadOptions::default());
    let program = program.unwrap_or_else(|| panic!("{findings:#?}"));
    let (written, findings) = rungd::source::controller::read(&file(page, controller), FileId(1));
    assert!(findings.is_empty(), "{findings:#?}");
    let (controller, findings) = resolve_controller(&written.expect("TOML"), &program);
    assert!(findings.is_empty(), "{findings:#?}");
    (program, controller)
}
