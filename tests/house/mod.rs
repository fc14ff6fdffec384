//! The rules of the house: the modules that a module may use, the first line of every file, the
//! limits of length.
//!
//! They are those invariants of `ARCHITECTURE.md` that a reader of a change could easily overlook.

mod cycles;
mod dead;
mod documents;
mod names;
mod pages;
mod parameters;
mod recipe_places;
mod recipes;

use std::fs;
use std::path::{Path, PathBuf};

/// The rooms of each crate that has several, from the top down: a room uses only rooms after it.
/// Cargo keeps the order of the crates; a crate that is not listed is one room.
const ROOMS: [(&str, &[&str]); 10] = [
    ("src", &["main", "cli", "daemon"]),
    ("client", &["live", "operator"]),
    ("config", &["explain", "load", "controller"]),
    ("fleet", &["edge", "fleet", "metrics", "opcua", "journal", "settings_file"]),
    ("history", &["playback", "record", "observe"]),
    ("lab", &["export", "draw", "testing", "rig", "traces", "svg"]),
    ("language", &["lower", "check", "resolve", "format", "source"]),
    ("net", &["http", "mqtt", "sparkplug"]),
    ("state", &["retain", "reload"]),
    (
        "base",
        &[
            "byte_source",
            "calendar",
            "directories",
            "duration_text",
            "random",
            "regular_file",
            "scan_period",
            "wall_clock",
            "whole_file",
            "progress",
            "locked",
            "variants",
            "faults",
        ],
    ),
];

/// Files of the binary's package that may name tracing: those that format log lines.
const TRACING: [&str; 2] = ["daemon/log.rs", "daemon/log_form.rs"];

const FILE_LINES_MAX: usize = 500;
const FUNCTION_LINES_MAX: usize = 70;
const LINE_CHARS_MAX: usize = 100;

struct SourceText {
    path: PathBuf,
    /// Its crate's folder below `crates/`; `src` is the package of the binary.
    package: String,
    /// Its top-level module in the crate.
    module: String,
    text: String,
}

/// The folder of the repository.
pub(super) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The folders of the sources, each with the name of its package.
fn source_folders() -> Vec<(String, PathBuf)> {
    let crates = fs::read_dir(root().join("crates")).expect("the crates are readable");
    let mut folders: Vec<_> = crates
        .map(|entry| {
            let path = entry.expect("an entry is readable").path();
            let name = path.file_name().expect("it has a name").to_string_lossy().into_owned();
            (name, path.join("src"))
        })
        .collect();
    folders.push(("src".to_owned(), root().join("src")));
    folders.push(("opcua".to_owned(), root().join("opcua/src")));
    folders
}

fn sources() -> Vec<SourceText> {
    let mut sources = Vec::new();
    for (package, folder) in source_folders() {
        let mut files = Vec::new();
        collect(&folder, &mut files);
        sources.extend(files.into_iter().map(|path| {
            let inside = path.strip_prefix(&folder).expect("it was found there");
            let first = inside.components().next().expect("a file has a name");
            let module = first.as_os_str().to_string_lossy().trim_end_matches(".rs").to_owned();
            let text = fs::read_to_string(&path).expect("a source is readable");
            SourceText { path, package: package.clone(), module, text }
        }));
    }
    assert!(sources.len() > 800, "the walk over the sources found {} files", sources.len());
    sources
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a source folder is readable") {
        let path = entry.expect("an entry is readable").path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}

/// The top-level modules that a text names after `crate::`.
fn used_modules(text: &str) -> Vec<String> {
    let code: Vec<&str> = text.lines().filter(|l| !l.trim_start().starts_with("//")).collect();
    let text = code.join("\n");
    let mut used = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        let rest = &text[at + "crate::".len()..];
        if let Some(group) = rest.strip_prefix('{') {
            let group = group.split('}').next().unwrap_or("");
            used.extend(group.split(',').map(|item| first_word(item.trim())));
        } else {
            used.push(first_word(rest));
        }
    }
    used.retain(|word| !word.is_empty());
    used
}

fn first_word(text: &str) -> String {
    text.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect()
}

#[test]
fn rooms_use_only_rooms_listed_after_them() {
    let mut wrong = Vec::new();
    for source in sources() {
        let Some((_, rooms)) = ROOMS.iter().find(|(package, _)| *package == source.package) else {
            continue;
        };
        let rank = |module: &str| rooms.iter().position(|room| *room == module);
        let Some(own) = rank(&source.module) else {
            assert_eq!(source.module, "lib", "{}: it is not in ROOMS", source.path.display());
            continue;
        };
        let used = used_modules(&source.text).into_iter();
        for used in used.filter(|used| rank(used).is_some_and(|rank| rank < own)) {
            wrong.push(format!("{} uses {used}", source.path.display()));
        }
    }
    assert!(wrong.is_empty(), "a room uses one above it:\n{}", wrong.join("\n"));
}

/// Packages with a journal of their own, by lines on the standard output.
const PRINTS: [&str; 3] = ["fleet", "src", "web"];

/// Cargo keeps tokio and tracing out of the crates that do not name them.
#[test]
fn only_programs_print() {
    let mut wrong = Vec::new();
    for source in sources().iter().filter(|source| !PRINTS.contains(&source.package.as_str())) {
        for word in ["println!", "eprintln!"] {
            if source.text.contains(word) {
                wrong.push(format!("{} has {word}", source.path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "these belong to programs:\n{}", wrong.join("\n"));
}

/// A constant is copied into every unit of code that uses it, with its texts.
#[test]
fn included_texts_are_in_statics() {
    let mut wrong = Vec::new();
    for source in sources() {
        let mut item = "";
        for line in source.text.lines() {
            let words =
                line.trim_start().trim_start_matches("pub ").trim_start_matches("pub(super) ");
            if ["const ", "static ", "fn ", "let "].iter().any(|word| words.starts_with(word)) {
                item = words;
            }
            let includes = line.contains("include_str!(") || line.contains("include_bytes!(");
            if includes && item.starts_with("const ") && !item.starts_with("const fn") {
                wrong.push(format!("{}: {item}", source.path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "make a `static` of each:\n{}", wrong.join("\n"));
}

/// Everything is logged by `say!`, which takes a constant of the catalogue.
#[test]
fn only_events_of_the_catalogue_are_logged() {
    for source in sources().iter().filter(|source| source.package == "src") {
        let code = source.text.split("#[cfg(test)]").next().unwrap_or_default();
        let path = source.path.display().to_string();
        let may = TRACING.iter().any(|end| path.ends_with(end)) || path.contains("/tests/");
        assert!(may || !code.contains("tracing::"), "{path} names tracing: say it by `say!`");
    }
}

#[test]
fn the_engine_uses_no_clock_file_or_lock() {
    let forbidden =
        ["Instant", "SystemTime", "std::fs", "std::io", "Mutex", "std::thread", "unsafe {"];
    for source in
        sources().iter().filter(|source| source.package == "engine" && source.module != "isa")
    {
        for word in forbidden {
            assert!(!source.text.contains(word), "{} has {word}", source.path.display());
        }
    }
}

/// A merge may leave its marks in documents too, which no compiler reads.
#[test]
fn no_document_contains_conflict_markers() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.to_owned()];
    folders.extend(["docs", "tests", "config", ".ci"].map(|name| root.join(name)));
    let mut documents = 0;
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten() {
            let path = entry.expect("an entry is readable").path();
            if path.is_dir() && folder != root {
                folders.push(path);
            } else if let Ok(text) = fs::read_to_string(&path) {
                let marks =
                    |line: &&str| ["<<<<<<< ", ">>>>>>> "].iter().any(|m| line.starts_with(m));
                assert_eq!(text.lines().find(marks), None, "{}", path.display());
                documents += 1;
            }
        }
    }
    assert!(documents > 300, "the walk found {documents} files");
}

#[test]
fn every_file_opens_with_a_description() {
    for source in sources() {
        let path = source.path.display();
        assert!(source.text.starts_with("//!"), "{path} does not open with `//!`");
    }
}

#[test]
fn files_functions_and_lines_are_within_their_limits() {
    let mut wrong = Vec::new();
    for source in sources() {
        let path = source.path.display();
        let lines: Vec<&str> = source.text.lines().collect();
        if lines.len() > FILE_LINES_MAX {
            wrong.push(format!("{path} has {} lines: is it one room or three?", lines.len()));
        }
        for (at, line) in lines.iter().enumerate() {
            if line.chars().count() > LINE_CHARS_MAX {
                wrong.push(format!("{path}:{} is longer than a line", at + 1));
            }
        }
        for (name, length) in functions(&lines) {
            if length > FUNCTION_LINES_MAX {
                wrong.push(format!("{path}: {name} has {length} lines"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The opening lines of functions, with their lengths. A function ends at the closing brace with
/// the same indent, where rustfmt puts it.
fn functions(lines: &[&str]) -> Vec<(String, usize)> {
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let indent = line.len() - line.trim_start().len();
        let words: Vec<&str> = line.split_whitespace().take(5).collect();
        // A trait's method without a body and a function with an empty body have no closing line.
        let has_body = !line.ends_with(';') && !line.ends_with("{}");
        if !words.contains(&"fn") || line.trim_start().starts_with("//") || !has_body {
            continue;
        }
        let closing = format!("{}}}", " ".repeat(indent));
        let end = lines[at..].iter().position(|l| *l == closing);
        found.push((line.trim().to_owned(), end.map_or(1, |end| end + 1)));
    }
    found
}

/// In tests a line may be longer: many hold a whole command or a row of expected text.
#[test]
fn files_and_functions_of_the_tests_are_within_their_limits() {
    let mut files = Vec::new();
    for (_, sources) in source_folders() {
        let tests = sources.with_file_name("tests");
        if tests.exists() {
            collect(&tests, &mut files);
        }
    }
    assert!(files.len() > 80, "the walk over tests found {} files", files.len());
    let mut wrong = Vec::new();
    for path in files {
        let text = fs::read_to_string(&path).expect("a test is readable");
        let lines: Vec<&str> = text.lines().collect();
        let (path, count) = (path.display(), lines.len());
        wrong.extend((count > FILE_LINES_MAX).then(|| format!("{path} has {count} lines")));
        let functions = functions(&lines).into_iter();
        let long = functions.filter(|(_, length)| *length > FUNCTION_LINES_MAX);
        wrong.extend(long.map(|(name, length)| format!("{path}: {name} has {length} lines")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Cargo keeps the crates free of circles; this test does the same for the files of each crate.
#[test]
fn files_do_not_use_each_other_in_cycles() {
    let folders = source_folders();
    let files = sources().into_iter().map(|source| {
        let folder = folders.iter().find(|(package, _)| *package == source.package);
        let inside = source.path.strip_prefix(&folder.expect("it is there").1).expect("below it");
        (format!("{}/{}", source.package, inside.display()), source.text)
    });
    let found = cycles::Sources::new(files).in_circles();
    assert!(found.is_empty(), "these use each other in a circle: {found:#?}");
}

#[test]
fn nothing_is_left_unfinished() {
    for source in sources() {
        for word in ["todo!(", "unimplemented!(", "TODO", "FIXME", "dbg!("] {
            assert!(!source.text.contains(word), "{} has {word}", source.path.display());
        }
    }
}
