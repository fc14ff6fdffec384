//! The pages about the repository are complete: they name all modules, all dependencies and all
//! files of the tests.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::house::{ROOMS, root, source_folders};

fn text(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The part of a page below a heading, up to the next heading of the same level.
fn section<'p>(page: &'p str, heading: &str) -> &'p str {
    let below = page.split(&format!("\n{heading}\n")).nth(1).expect("the heading is there");
    let level = heading.split(' ').next().expect("a level");
    below.split(&format!("\n{level} ")).next().expect("a section")
}

/// The words in backticks in the first column of the tables of a text.
fn first_column(text: &str) -> Vec<&str> {
    let rows = text.lines().filter(|row| row.starts_with("| `"));
    let cells = rows.map(|row| row.split(" | ").next().unwrap_or(row));
    cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).collect()
}

#[test]
fn the_architecture_page_lists_the_crates_with_their_rooms() {
    let page = text("ARCHITECTURE.md");
    let house = section(&page, "## The house");
    let listed: BTreeSet<String> = first_column(house).into_iter().map(str::to_owned).collect();
    let crates = source_folders().into_iter().map(|(name, _)| match name.as_str() {
        "src" => "src/".to_owned(),
        "opcua" => "opcua".to_owned(),
        name => format!("crates/{name}"),
    });
    assert_eq!(listed, crates.collect(), "ARCHITECTURE.md, The house");
    for (name, rooms) in ROOMS.iter().filter(|(name, _)| *name != "base") {
        let is_row = |row: &&str| row.starts_with(&format!("| `crates/{name}`"));
        let row = house.lines().find(|row| is_row(row) || row.starts_with(&format!("| `{name}/`")));
        let row = row.expect("it is listed");
        let places = rooms.iter().map(|room| row.find(&format!("`{room}`")));
        assert!(places.is_sorted() && row.contains(rooms[0]), "{row}: its rooms are {rooms:?}");
    }
}

/// What only one crate needs to know is at the head of that crate.
#[test]
fn the_architecture_page_is_read_in_an_hour() {
    let lines = text("ARCHITECTURE.md").lines().count();
    assert!(lines <= 300, "{lines} lines");
}

#[test]
fn the_architecture_page_gives_a_reason_for_each_dependency() {
    let page = text("ARCHITECTURE.md");
    let manifest = text("Cargo.toml");
    let section = section(&page, "## Dependencies");
    let lines = manifest.split("\n[workspace.dependencies]\n").nth(1).expect("the table is there");
    let lines = lines.split("\n[").next().expect("a table").lines();
    let names = lines.filter_map(|line| line.split_once(" = ")).map(|(name, _)| name);
    for name in names.filter(|name| !name.starts_with("rungd-")) {
        assert!(section.contains(name), "ARCHITECTURE.md says no reason for {name}");
    }
}

/// The entries of a folder of `tests/`, folders with a `/`.
fn entries(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).expect("a folder is readable");
    let paths = entries.map(|entry| entry.expect("an entry is readable").path());
    let name = |path: PathBuf| {
        let end = if path.is_dir() { "/" } else { "" };
        format!("{}{end}", path.file_name().expect("a name").to_string_lossy())
    };
    let named = paths.filter(|path| !path.ends_with("README.md")).map(name);
    named.filter(|name| !name.starts_with('.') && name != "__pycache__/").collect()
}

/// The entries of a folder of tests, wherever its tests are: in the package of the program, or in a
/// crate.
fn entries_of_all(folder: &str) -> BTreeSet<String> {
    let crates = fs::read_dir(root().join("crates")).expect("the crates are readable");
    let crates = crates.map(|entry| entry.expect("an entry is readable").path().join("tests"));
    let places = crates.chain([root().join("tests")]).map(|tests| tests.join(folder));
    places.filter(|place| place.exists()).flat_map(|place| entries(&place)).collect()
}

/// The folders of tests in the crates.
fn folders_in_crates() -> BTreeSet<String> {
    let crates = fs::read_dir(root().join("crates")).expect("the crates are readable");
    let crates = crates.map(|entry| entry.expect("an entry is readable").path().join("tests"));
    let found = crates.filter(|tests| tests.exists()).flat_map(|tests| entries(&tests));
    found.filter(|name| name.ends_with('/')).collect()
}

/// The rows of a table below its name: `language/` in backticks, a line by itself.
fn told_below(rows: &str, name: &str) -> BTreeSet<String> {
    let part = rows.split(&format!("\n{name}\n")).nth(1);
    let part = part.unwrap_or_else(|| panic!("tests/README.md has no table of {name}"));
    let is_table = |line: &&str| line.is_empty() || line.starts_with('|');
    let table: Vec<&str> = part.lines().take_while(is_table).collect();
    first_column(&table.join("\n")).into_iter().map(str::to_owned).collect()
}

#[test]
fn the_readme_of_the_tests_lists_every_file() {
    let page = text("tests/README.md");
    let (tests, rows) = (root().join("tests"), section(&page, "## Every file"));
    let is_rust = |folder: &&String| {
        folder.as_str() == "support/" || tests.join(folder).join("mod.rs").exists()
    };
    let top = entries(&tests);
    let (folders, others): (Vec<&String>, Vec<&String>) = top.iter().partition(is_rust);
    let in_crates = folders_in_crates();
    let folders: BTreeSet<&String> = folders.into_iter().chain(&in_crates).collect();
    assert!(folders.len() > 10, "{folders:?}");
    let without_mod = |mut all: BTreeSet<String>| {
        ["Cargo.toml", "lib.rs", "mod.rs"].iter().for_each(|name| {
            all.remove(*name);
        });
        all
    };
    for folder in folders {
        let told = without_mod(told_below(rows, &format!("`{folder}`")));
        assert_eq!(told, without_mod(entries_of_all(folder)), "tests/README.md, {folder}");
    }
    let others: BTreeSet<String> = others.into_iter().cloned().collect();
    assert_eq!(told_below(rows, "Scripts and data"), others, "tests/README.md, its last table");
}
