//! Files that another program changes, removes or makes while the editor has the project open.
//!
//! A rename from the open ladder must change every name in the closed one as it is on disk then, and
//! nothing else. Every variant changes the closed file without telling the server.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::SystemTime;

use serde_json::{Value, json};

use crate::editor::client::{Editor, place_of};
use crate::editor::project::empty;

const OPEN: &str = "[tags]\nstart = { at = \"X0\" }\nvalve = { at = \"Y0\" }\n\n[[program]]\n\
                    name = \"Main\"\nrung = [{ when = [\"start\"], do = [\"OUT valve\"] }]\n";
const CLOSED: &str = "[[task]]\nname = \"One\"\ndoc = \"1s\"\n\
                      rung = [{ when = [\"start\"], do = [\"OUT Y1\"] }]\n";

/// Another program's change of the closed file `b.toml` in a folder.
type Change = fn(&Path);

fn write(folder: &Path, text: &str) {
    fs::write(folder.join("b.toml"), text).unwrap();
}

fn longer() -> String {
    format!("# A comment of another program.\n{CLOSED}")
}

/// A text of the same length, with the name at a different place.
fn moved() -> String {
    CLOSED
        .replace("name = \"One\"\ndoc = \"1s\"", "doc = \"1s\"\nname = \"One\"")
        .replace("when = [\"start\"], do = [\"OUT Y1\"]", "do = [\"OUT Y1\"], when = [\"start\"]")
}

const VARIANTS: [(&str, Change); 10] = [
    ("nothing", |_| ()),
    ("touched", |folder| {
        fs::File::open(folder.join("b.toml")).unwrap().set_modified(SystemTime::now()).unwrap();
    }),
    ("longer", |folder| write(folder, &longer())),
    ("shorter", |folder| {
        write(
            folder,
            &CLOSED
                .replace("doc = \"1s\"", "doc = \"9s\"")
                .replace("name = \"One\"\n", "name = \"B\"\n"),
        )
    }),
    ("same length", |folder| write(folder, &moved())),
    ("same length and time", |folder| {
        let path = folder.join("b.toml");
        let time = fs::metadata(&path).unwrap().modified().unwrap();
        write(folder, &moved());
        fs::File::options().write(true).open(&path).unwrap().set_modified(time).unwrap();
    }),
    ("replaced by a new file", |folder| {
        fs::write(folder.join("new"), longer()).unwrap();
        fs::rename(folder.join("new"), folder.join("b.toml")).unwrap();
    }),
    ("removed", |folder| fs::remove_file(folder.join("b.toml")).unwrap()),
    ("renamed", |folder| fs::rename(folder.join("b.toml"), folder.join("other.toml")).unwrap()),
    ("a test is made", |folder| {
        let text = "ladder = [\"a.toml\", \"b.toml\"]\n\n[[scenario]]\nname = \"one\"\nsteps = \
                    [\"set start = 1\", \"run 1 scan\", \"expect: start\"]\n";
        fs::write(folder.join("a.test.toml"), text).unwrap();
    }),
];

fn rename(editor: &mut Editor, new: &str) -> Result<Value, String> {
    let (line, column) = place_of(OPEN, "start");
    let params = json!({
        "textDocument": { "uri": editor.uri("a.toml") },
        "position": { "line": line, "character": column },
        "newName": new,
    });
    let response = editor.respond("textDocument/rename", params);
    response.response_result.map_err(|error| error.message)
}

/// A text of ASCII after edits in lines.
fn edited(text: &str, edits: &[Value]) -> String {
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    let offset = |place: &Value| {
        let line = place["line"].as_u64().unwrap() as usize;
        let before: usize = lines[..line].iter().map(|line| line.len()).sum();
        before + place["character"].as_u64().unwrap() as usize
    };
    let mut parts: Vec<(usize, usize, &str)> = edits
        .iter()
        .map(|edit| {
            let range = &edit["range"];
            (offset(&range["start"]), offset(&range["end"]), edit["newText"].as_str().unwrap())
        })
        .collect();
    parts.sort_unstable();
    let mut changed = text.to_owned();
    for (start, end, new) in parts.into_iter().rev() {
        changed.replace_range(start..end, new);
    }
    changed
}

#[test]
fn a_rename_edits_the_files_as_they_are_on_disk() {
    for (name, change) in VARIANTS {
        let folder = empty();
        let folder = folder.path();
        fs::write(folder.join("c.toml"), "ladder = [\"a.toml\", \"b.toml\"]\n").unwrap();
        fs::write(folder.join("a.toml"), OPEN).unwrap();
        write(folder, CLOSED);
        let mut editor = Editor::new(folder);
        editor.open("a.toml");
        rename(&mut editor, "begin").unwrap_or_else(|why| panic!("{name}: {why}"));
        change(folder);
        let all: Vec<_> = fs::read_dir(folder).unwrap().map(|of| of.unwrap().path()).collect();
        match rename(&mut editor, "begin") {
            Ok(answer) => {
                let changes = answer["changes"].as_object().unwrap();
                for path in &all {
                    let file = path.file_name().unwrap().to_str().unwrap();
                    let text = fs::read_to_string(path).unwrap();
                    let edits = changes.get(&editor.uri(file)).and_then(Value::as_array);
                    let after = edits.map_or(text.clone(), |edits| edited(&text, edits));
                    let is_of_project = file != "other.toml";
                    let wanted = match is_of_project {
                        true => text.replace("start", "begin"),
                        false => text,
                    };
                    assert_eq!(after, wanted, "{name}: {file}");
                }
                let gone = changes.keys().filter(|uri| {
                    all.iter().all(|path| {
                        editor.uri(path.file_name().unwrap().to_str().unwrap()) != **uri
                    })
                });
                assert_eq!(gone.count(), 0, "{name}: an edit of a file that is gone");
            }
            Err(why) => {
                // Without the file that the controller file names, the project cannot be judged.
                assert!(["removed", "renamed"].contains(&name), "{name}: {why}");
                assert!(!why.is_empty(), "{name}");
            }
        }
    }
}

/// Even a change within a tick of the clock, which leaves the stamp as it was.
#[test]
fn a_change_on_disk_is_detected_even_with_an_equal_timestamp() {
    let folder = empty();
    let folder = folder.path();
    fs::write(folder.join("c.toml"), "ladder = [\"a.toml\", \"b.toml\"]\n").unwrap();
    fs::write(folder.join("a.toml"), OPEN).unwrap();
    let mut editor = Editor::new(folder);
    editor.open("a.toml");
    let mut same = 0;
    for round in 0..40 {
        let (before, after) = match round % 2 {
            0 => (CLOSED.to_owned(), moved()),
            _ => (moved(), CLOSED.to_owned()),
        };
        write(folder, &before);
        let stamp = || fs::metadata(folder.join("b.toml")).map(|of| of.ctime_nsec()).unwrap();
        let first = stamp();
        rename(&mut editor, "begin").unwrap();
        write(folder, &after);
        same += u32::from(stamp() == first);
        let answer = rename(&mut editor, "begin").unwrap();
        let edits = answer["changes"][editor.uri("b.toml")].as_array().unwrap();
        assert_eq!(edited(&after, edits), after.replace("start", "begin"), "round {round}");
    }
    println!("{same} of 40 changes had the same stamp");
}

#[test]
fn an_editor_that_can_watch_files_is_asked_to_watch_them() {
    let folder = empty();
    let watches =
        json!({ "workspace": { "didChangeWatchedFiles": { "dynamicRegistration": true } } });
    for (capabilities, count) in [(watches, 1), (json!({}), 0)] {
        let mut editor = Editor::with(folder.path(), capabilities);
        fs::write(folder.path().join("a.toml"), OPEN).unwrap();
        editor.open("a.toml");
        editor.diagnostics("a.toml");
        let told = editor.told.borrow();
        let asked: Vec<&Value> =
            told.iter().filter(|of| of["method"] == "client/registerCapability").collect();
        assert_eq!(asked.len(), count, "{told:?}");
        if let [asked] = asked.as_slice() {
            let registration = &asked["params"]["registrations"][0];
            assert_eq!(registration["method"], "workspace/didChangeWatchedFiles");
            assert_eq!(registration["registerOptions"]["watchers"][0]["globPattern"], "**/*.toml");
        }
    }
}

/// The server learns of a change of a closed file by the editor's notification.
#[test]
fn a_reported_change_of_a_file_updates_the_diagnostics_at_once() {
    let folder = empty();
    let folder = folder.path();
    fs::write(folder.join("c.toml"), "ladder = [\"a.toml\", \"b.toml\"]\n").unwrap();
    fs::write(folder.join("a.toml"), OPEN).unwrap();
    write(folder, CLOSED);
    let mut editor = Editor::new(folder);
    editor.open("a.toml");
    let b = editor.uri("b.toml");
    while !editor.diagnostics("a.toml").is_empty() {}
    write(folder, &CLOSED.replace("start", "stuck"));
    let changes = json!([{ "uri": b, "type": 2 }]);
    editor.tell("workspace/didChangeWatchedFiles", json!({ "changes": changes }));
    let is_meant = |of: &Value| of["message"].as_str().unwrap().contains("`stuck`");
    while !editor.all_diagnostics().get(&b).is_some_and(|all| all.iter().any(is_meant)) {
        editor.hear();
    }
}
