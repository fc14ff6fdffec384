//! The common parts of the pages about instructions and about the library: sections in order, parts
//! that the program writes, and a timing diagram that `rungd sim` draws.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Whether the pages are to be updated.
pub fn update() -> bool {
    std::env::var_os("UPDATE_PAGES").is_some()
}

pub fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The names of the files in a folder that have this ending, without the ending.
pub fn files(folder: &Path, ending: &str) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("the folder is there");
    let names = entries.map(|e| e.expect("readable").file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> =
        names.filter_map(|name| name.strip_suffix(ending).map(str::to_owned)).collect();
    names.sort();
    names
}

/// A page with the part between a mark and `<!-- end -->` replaced.
pub fn with_part(page: &str, mark: &str, part: &str) -> String {
    let (before, behind) = page.split_once(mark).unwrap_or_else(|| panic!("no {mark} in\n{page}"));
    let (_, after) = behind.split_once("<!-- end -->").expect("a part ends");
    format!("{before}{mark}\n\n{part}\n<!-- end -->{after}")
}

/// Fails if a page does not have these sections in this order.
pub fn assert_in_order(name: &str, page: &str, sections: &[&str]) {
    let mut from = 0;
    for section in sections {
        let at = page[from..].find(&format!("\n{section}\n\n"));
        from += at.unwrap_or_else(|| panic!("{name}: no {section} in its place"));
    }
}

/// The diagram that the simulator draws from the files `toml`, `csv` and `args`. If `library` is
/// given, this file comes before the ladder.
pub fn simulated(name: &str, library: Option<&str>, file: &dyn Fn(&str) -> PathBuf) -> String {
    let folder = if library.is_some() { "library-diagrams" } else { "diagrams" };
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(folder);
    fs::create_dir_all(&folder).expect("a folder for the diagrams");
    let svg = folder.join(format!("{name}.svg"));
    let output = Command::new(env!("CARGO_BIN_EXE_rungd"))
        .arg("sim")
        .args(library)
        .arg(file("toml"))
        .arg("--stimulus")
        .arg(file("csv"))
        .args(read(&file("args")).split_whitespace())
        .arg("--trace")
        .arg(&svg)
        .output()
        .expect("rungd starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && errors.is_empty(), "{name}: {errors}");
    read(&svg)
}
