//! Diagnostics are the findings of `rungd check` and `rungd test`: none is missing, none is added,
//! the words and places are the same. Tested with every shipped file and every case of `tests/ui`.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::editor::client::Editor;
use crate::editor::project::{LADDER, TEST, empty, folder};
use rungd_config::load;
use rungd_lab::testing;
use rungd_language::source::finding::Finding;
use rungd_language::source::render::{Style, render};
use rungd_language::source::span::SourceFile;

/// All TOML files below a folder, relative to it.
pub fn shipped(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "toml") {
                let name = path.strip_prefix(folder).unwrap();
                found.push(name.to_str().unwrap().to_owned());
            }
        }
    }
    found.sort();
    found
}

/// The controller file that names a ladder, among the files of its folder or one above it.
fn controller_of(ladder: &Path) -> Option<PathBuf> {
    let loads = |path: &PathBuf| {
        load::is_controller_file(path).is_ok_and(|is| is)
            && load::controller_file(path).is_ok_and(|loaded| {
                let mut names = loaded.files.iter().map(|file| Path::new(&file.name));
                names.any(|name| name.canonicalize().is_ok_and(|path| path == ladder))
            })
    };
    ladder.ancestors().skip(1).take(2).find_map(|folder| {
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let is_toml = |path: &PathBuf| {
            let name = path.to_str().unwrap();
            name.ends_with(".toml") && !name.ends_with(".test.toml")
        };
        let mut paths: Vec<PathBuf> = entries.filter(is_toml).collect();
        paths.sort();
        paths.into_iter().find(loads)
    })
}

/// The findings of `rungd check` or `rungd test` about a file on disk and the files that belong to
/// it.
fn checked(path: &Path) -> (Vec<SourceFile>, Vec<Finding>) {
    if path.to_str().unwrap().ends_with(".test.toml") {
        let read = testing::read_suite(path).unwrap();
        return (read.files, read.findings);
    }
    let root = match load::is_controller_file(path).unwrap() {
        true => Some(path.to_owned()),
        false => controller_of(path),
    };
    let loaded = match root {
        Some(root) => load::controller_file(&root).unwrap(),
        None => load::ladder_files(&[path.to_owned()]).unwrap(),
    };
    (loaded.files, loaded.findings)
}

/// A finding, as `rungd check` prints it and as an editor shows it.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Told {
    line: u64,
    column: u64,
    /// `error[unknown-name]: …`
    headline: String,
    help: Option<String>,
}

fn shown(diagnostic: &Value) -> Told {
    let start = &diagnostic["range"]["start"];
    let severity = match diagnostic["severity"].as_i64() {
        Some(1) => "error",
        Some(2) => "warning",
        other => panic!("severity {other:?}"),
    };
    let code = diagnostic["code"].as_str().unwrap_or("-");
    let message = diagnostic["message"].as_str().unwrap();
    let (message, help) = match message.split_once("\nhelp: ") {
        Some((message, help)) => (message, Some(help.to_owned())),
        None => (message, None),
    };
    Told {
        line: start["line"].as_u64().unwrap() + 1,
        column: start["character"].as_u64().unwrap() + 1,
        headline: format!("{severity}[{code}]: {message}"),
        help,
    }
}

/// The findings about a file in an output of `rungd check`.
fn printed(text: &str, file: &str) -> Vec<Told> {
    let mut all = Vec::new();
    for block in text.split("\n\n").filter(|block| block.contains("]: ")) {
        let (headline, rest) = block.split_once('\n').unwrap_or((block, ""));
        let place = rest.trim_start().strip_prefix("--> ").expect("a place");
        let place = place.split('\n').next().unwrap();
        let mut parts = place.rsplitn(3, ':');
        let column = parts.next().unwrap().parse().unwrap();
        let line = parts.next().unwrap().parse().unwrap();
        if parts.next() != Some(file) {
            continue;
        }
        let help = rest
            .split_once("= help: ")
            .map(|(_, help)| help.lines().map(str::trim).collect::<Vec<_>>().join("\n"));
        all.push(Told { line, column, headline: headline.trim().to_owned(), help });
    }
    all.sort();
    all
}

/// Opens every file below a folder and compares its diagnostics with the printed findings; returns
/// their number.
fn compare(folder: &Path) -> usize {
    let mut editor = Editor::new(folder);
    let mut found = 0;
    // The editor does not handle the files of an edge node and of an OPC UA server.
    for name in shipped(folder).into_iter().filter(|name| !name.starts_with("edge/")) {
        let path = folder.join(&name).canonicalize().unwrap();
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        let (files, findings) = checked(&path);
        let whole = render(&findings, &files, Style::default());
        // The printed findings of such a file are shortened.
        if findings.len() > 100 || text.lines().any(|line| line.len() > 1000) {
            continue;
        }
        editor.open_with(&name, &text);
        let mut told: Vec<Told> = editor.diagnostics(&name).iter().map(shown).collect();
        told.sort();
        let file = files
            .iter()
            .find(|file| Path::new(&file.name).canonicalize().is_ok_and(|found| found == path));
        let printed = printed(&whole, &file.unwrap().name);
        found += printed.len();
        assert_eq!(without_labels(told, &printed), printed, "{name}\n{whole}");
        editor.close(&name);
    }
    found
}

/// Every finding occurs in the cases of `tests/ui`.
#[test]
fn diagnostics_equal_the_findings_of_check() {
    let found = compare(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ui"));
    assert!(found > 300, "{found} findings");
}

#[test]
fn diagnostics_of_shipped_files_equal_the_findings_of_check() {
    compare(&Path::new(env!("CARGO_MANIFEST_DIR")).join("config"));
}

/// The shown findings without their labels, which `rungd check` prints under the place.
fn without_labels(mut shown: Vec<Told>, printed: &[Told]) -> Vec<Told> {
    for (shown, printed) in shown.iter_mut().zip(printed) {
        if shown
            .headline
            .strip_prefix(&printed.headline)
            .is_some_and(|label| label.starts_with(" (") && label.ends_with(')'))
        {
            shown.headline.clone_from(&printed.headline);
        }
        shown.help = shown
            .help
            .take()
            .map(|help| help.lines().map(str::trim).collect::<Vec<_>>().join("\n"));
    }
    shown
}

/// Editors send every TOML file that a person opens.
#[test]
fn files_of_other_programs_have_no_findings() {
    let folder = empty();
    let mut editor = Editor::new(folder.path());
    editor.open_with("Cargo.toml", "[package]\nname = \"x\"\n[dependencies]\n");
    assert_eq!(editor.diagnostics("Cargo.toml"), Vec::<Value>::new());
    editor.replace("Cargo.toml", "[ladder]\nname = 3\n");
    assert!(!editor.diagnostics("Cargo.toml").is_empty());
    editor.replace("Cargo.toml", "[package]\n");
    assert_eq!(editor.diagnostics("Cargo.toml"), Vec::<Value>::new());
}

/// The places and words of all diagnostics, by the name of the file.
fn shown_of(editor: &mut Editor, names: &[&str]) -> Vec<String> {
    let mut all = Vec::new();
    for name in names {
        for diagnostic in editor.diagnostics(name) {
            let told = shown(&diagnostic);
            all.push(format!("{name}:{} {}", told.line, told.headline));
        }
    }
    all
}

/// `rungd test` refuses test files that name test files as their ladder.
#[test]
fn test_files_that_name_test_files_have_findings() {
    let folder = empty();
    let rest = "[[scenario]]\nname = \"x\"\nsteps = [\"run 1s\", \"expect: !Y0\"]\n";
    let texts = [("a.test.toml", "a"), ("b.test.toml", "c"), ("c.test.toml", "b")]
        .map(|(name, other)| (name, format!("ladder = [\"{other}.test.toml\"]\n{rest}")));
    let mut editor = Editor::new(folder.path());
    for (name, text) in &texts {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    for (name, text) in &texts {
        editor.open_with(name, text);
        editor.diagnostics(name);
    }
    assert_eq!(
        shown_of(&mut editor, &["a.test.toml", "b.test.toml", "c.test.toml"]),
        [
            "a.test.toml:1 error[test-file]: the test file names itself as its ladder",
            "b.test.toml:2 error[test-file]: this is a test file, not a ladder file",
            "c.test.toml:2 error[test-file]: this is a test file, not a ladder file",
        ]
    );
}

#[test]
fn a_controller_file_that_lists_itself_as_ladder_is_reported() {
    let folder = empty();
    let mut editor = Editor::new(folder.path());
    let text = "ladder = [\"rungd.toml\"]\n";
    std::fs::write(folder.path().join("rungd.toml"), text).unwrap();
    editor.open_with("rungd.toml", text);
    assert_eq!(
        shown_of(&mut editor, &["rungd.toml"]),
        ["rungd.toml:1 error[controller]: the controller file names itself as its ladder"]
    );
}

/// A byte that is not UTF-8 gives one finding, wherever it is in the file.
#[test]
fn a_byte_that_is_not_utf_8_gives_one_finding() {
    let folder = empty();
    let main = b"[[program]]\nname = \"Main\"\nrung = [{ when = [\"X0\"], do = [\"OUT Y0\"] }]\n";
    std::fs::write(folder.path().join("a.toml"), main).unwrap();
    let cases: [&[u8]; 3] = [
        b"ladder = [\"a.toml\"]\n[scan]\nperiod = \"\xff\"\n",
        b"ladder = [\"a.toml\"]\nperiod\xff = \"10ms\"\n[outputs]\non = [\"Y\xff\"]\n",
        b"ladder = [\"\xff.toml\"]\n",
    ];
    for bytes in cases {
        let path = folder.path().join("rungd.toml");
        std::fs::write(&path, bytes).unwrap();
        let (_, findings) = checked(&path);
        let told: Vec<&str> = findings.iter().map(|of| of.message.as_str()).collect();
        assert!(matches!(told[..], [one] if one.contains("is 0xFF")), "{told:?}");
    }
}

/// If only a test file is open, the findings of the ladder that it tests are shown too.
#[test]
fn an_open_test_file_shows_the_findings_of_its_ladder() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    let ladder = editor.disk(LADDER).replace("OUT valve", "OUT valev");
    std::fs::write(folder.path().join(LADDER), ladder).expect("written");
    editor.open(TEST);
    assert_eq!(editor.diagnostics(TEST), Vec::<Value>::new());
    let of_ladder = editor.diagnostics(LADDER);
    let message = of_ladder[0]["message"].as_str().expect("a message");
    assert!(message.contains("`valev`"), "{message}");
}

#[test]
fn an_emptied_ladder_is_reported_as_without_main() {
    let folder = empty();
    let mut editor = Editor::new(folder.path());
    for text in ["", "# nothing yet\n"] {
        editor.open_with("plant.toml", text);
        assert_eq!(editor.diagnostics("plant.toml")[0]["code"], "no-main", "{text}");
    }
}
