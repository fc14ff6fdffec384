//! `docs/language.md`: its examples pass `rungd check`, and its instruction table is the engine's.
//!
//! A block after `<!-- check: ladder -->` is a whole ladder file. A block after `<!-- check: rungs
//! -->` has the rungs of a `Main`, and a block after `<!-- check: controller -->` is a controller
//! file for the page's ladder. `UPDATE_EXPECT=1 cargo test -p rungd-language language::docs_language` updates
//! the table.

use std::fs;
use std::path::{Path, PathBuf};

use rungd_config::load::{self, Loaded};
use rungd_engine::isa::instruction::{Spec, TABLE, Termination};
use rungd_engine::isa::status;
use rungd_language::source::finding::Severity;

const BEGIN: &str = "<!-- generated: instructions -->\n";
const END: &str = "<!-- end -->";

fn path() -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("docs/language.md")
}

fn page() -> String {
    fs::read_to_string(path()).expect("docs/language.md")
}

/// The TOML blocks after a mark.
fn marked<'a>(page: &'a str, mark: &str) -> Vec<&'a str> {
    let mark = format!("<!-- check: {mark} -->\n```toml\n");
    let bodies = page.split(&mark).skip(1);
    let blocks: Vec<&str> = bodies.map(|b| b.split("```").next().unwrap_or(b)).collect();
    assert!(!blocks.is_empty(), "{mark}");
    blocks
}

/// Makes a folder for a test.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("rungd-{name}-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn errors(loaded: &Loaded) -> Vec<&str> {
    let errors = loaded.findings.iter().filter(|f| f.severity() == Severity::Error);
    errors.map(|f| f.message.as_str()).collect()
}

#[test]
fn the_files_of_the_page_load_without_a_warning() {
    let (page, folder) = (page(), folder("language-files"));
    // The controller files are for the page's first ladder.
    for (at, text) in marked(&page, "ladder").into_iter().enumerate().rev() {
        let ladder = folder.join("bottling.toml");
        fs::write(&ladder, text).expect("a file");
        let loaded = load::ladder_files(&[ladder]).expect("readable");
        assert!(errors(&loaded).is_empty(), "{:#?}", loaded.findings);
        assert!(at > 0 || loaded.findings.is_empty(), "{:#?}", loaded.findings);
    }
    for controller in marked(&page, "controller") {
        let path = folder.join("controller.toml");
        fs::write(&path, controller).expect("a file");
        let loaded = load::controller_file(&path).expect("readable");
        assert!(loaded.findings.is_empty(), "{:#?}", loaded.findings);
    }
    let _ = fs::remove_dir_all(folder);
}

#[test]
fn the_rungs_of_the_page_load() {
    let (page, folder) = (page(), folder("language-rungs"));
    for rungs in marked(&page, "rungs") {
        let path = folder.join("rungs.toml");
        fs::write(&path, format!("[[program]]\nname = \"Main\"\n{rungs}")).expect("a file");
        let loaded = load::ladder_files(&[path]).expect("readable");
        assert_eq!(errors(&loaded), [""; 0], "{rungs}");
    }
    let _ = fs::remove_dir_all(folder);
}

fn row(spec: &Spec) -> String {
    let legs: Vec<&str> = spec.legs.iter().map(|leg| leg.key()).collect();
    let termination = match spec.termination {
        Termination::Off => "OFF",
        Termination::Reset => "reset",
        Termination::RungOff => "as with its rung OFF",
        Termination::Untouched | Termination::Held | Termination::EnableOff => "untouched",
        Termination::Kept => "",
    };
    let (form, legs) = (spec.form(), legs.join(", "));
    format!("| `{form}` | {legs} | {} | {termination} |\n", spec.summary)
}

#[test]
fn the_instruction_table_of_the_page_equals_the_table_of_the_engine() {
    let page = page();
    let (head, rest) = page.split_once(BEGIN).expect("the table's begin");
    let (shown, tail) = rest.split_once(END).expect("the table's end");
    let head_rows = "| form | legs | what it does | at termination |\n|---|---|---|---|\n";
    let table = format!("{head_rows}{}", TABLE.iter().map(row).collect::<String>());
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(path(), format!("{head}{BEGIN}{table}{END}{tail}")).expect("docs/language.md");
    } else {
        assert_eq!(shown, table, "UPDATE_EXPECT=1 writes it");
    }
}

#[test]
fn the_page_names_every_nickname() {
    let page = page();
    let missing: Vec<_> =
        status::nicknames().filter(|name| !page.contains(&format!("`{name}`"))).collect();
    assert!(missing.is_empty(), "{missing:?}");
}
