//! A rename changes only names: traces stay the same, and a rename that would change a meaning is
//! refused.

use std::collections::BTreeMap;
use std::path::Path;

use rungd_config::load::{self, Loaded};
use rungd_lab::traces::stimulus::Stimulus;
use rungd_language::lower::lower;
use serde_json::{Value, json};

use crate::editor::client::{Editor, place_of};
use crate::editor::findings::shipped;
use crate::editor::project::{CONTROLLER, LADDER, TEST, empty, folder};
use rungd_test_support::bare_run::{Plan, run};
use rungd_test_support::folder::TestFolder;
use rungd_test_support::run::{Rows, target};

/// A place in a file: its line and its character, both from 0.
pub struct TextPlace<'n> {
    pub name: &'n str,
    pub line: usize,
    pub column: usize,
}

/// The answer to a rename: the edits by file, or the refusal.
pub fn rename(editor: &mut Editor, place: TextPlace, new: &str) -> Renamed {
    let TextPlace { name, line, column } = place;
    let params = json!({
        "textDocument": { "uri": editor.uri(name) },
        "position": { "line": line, "character": column },
        "newName": new,
    });
    let response = editor.respond("textDocument/rename", params);
    match response.response_result {
        Ok(result) => Ok(serde_json::from_value(result["changes"].clone()).unwrap()),
        Err(error) => Err(error.message),
    }
}

pub type Renamed = Result<BTreeMap<String, Vec<Value>>, String>;

/// A text of ASCII lines after edits that do not touch each other.
pub fn edited(text: &str, edits: &[Value]) -> String {
    let starts: Vec<usize> =
        std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
    let offset = |place: &Value| {
        let line = starts[place["line"].as_u64().unwrap() as usize];
        let rest = &text[line..];
        let units = place["character"].as_u64().unwrap() as usize;
        let mut seen = 0;
        let chars = rest.char_indices().find(|(_, c)| {
            let is_there = seen >= units;
            seen += c.len_utf16();
            is_there
        });
        line + chars.map_or(rest.len(), |(at, _)| at)
    };
    let mut edits: Vec<(usize, usize, &str)> = edits
        .iter()
        .map(|edit| {
            let range = &edit["range"];
            let new = edit["newText"].as_str().unwrap();
            (offset(&range["start"]), offset(&range["end"]), new)
        })
        .collect();
    edits.sort_unstable();
    let mut text = text.to_owned();
    for (start, end, new) in edits.into_iter().rev() {
        text.replace_range(start..end, new);
    }
    text
}

fn place(editor: &Editor, name: &str, wanted: &str, within: usize) -> (usize, usize) {
    let (line, column) = place_of(&editor.disk(name), wanted);
    (line, column + within)
}

#[test]
fn a_rename_reaches_every_file_and_every_form_of_the_name() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    editor.open(LADDER);
    let (line, column) = place(&editor, LADDER, "valve = {", 1);
    let edits = rename(&mut editor, TextPlace { name: LADDER, line, column }, "outlet").unwrap();
    let of = |name: &str| edited(&editor.disk(name), &edits[&editor.uri(name)]);
    assert!(of(CONTROLLER).contains("on = [\"outlet\"]"));
    assert!(of(TEST).contains("expect: outlet"));
    let ladder = of(LADDER);
    assert!(ladder.contains("outlet = { at") && ladder.contains("OUT outlet"));
    assert!(ladder.contains("start & outlet"));
    let (line, column) = place(&editor, LADDER, "p1.failed", 4);
    let edits = rename(&mut editor, TextPlace { name: LADDER, line, column }, "broken").unwrap();
    let ladder = edited(&editor.disk(LADDER), &edits[&editor.uri(LADDER)]);
    assert!(ladder.contains("\nbroken = { type"), "{ladder}");
    assert!(ladder.contains("\"!broken\"") && ladder.contains("RST p1.broken"), "{ladder}");
    assert!(ladder.contains("failed_lamp = {"), "{ladder}");
}

#[test]
fn a_rename_that_changes_a_meaning_is_refused() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    editor.open(LADDER);
    let mut refused = |wanted: &str, within: usize, new: &str| {
        let (line, column) = place(&editor, LADDER, wanted, within);
        rename(&mut editor, TextPlace { name: LADDER, line, column }, new).expect_err(new)
    };
    let cases = [
        ("valve = {", 1, "start", "start"),
        ("valve = {", 1, "X7", "X7"),
        ("valve = {", 1, "no name", "is no name"),
        ("valve = {", 1, "OUT", "OUT"),
        ("wanted = {", 1, "failed", "failed"),
        ("name = \"Main", 9, "Other", "Main"),
        ("name = \"Close", 9, "Open", "Open"),
        ("at = \"X0\"", 6, "eye", "is an address"),
        ("!late.Done", 7, "eye", "belongs to rungd"),
        ("JMP Close", 1, "eye", "no name here"),
    ];
    for (wanted, within, new, words) in cases {
        let why = refused(wanted, within, new);
        assert!(why.contains(words), "{new}: {why}");
    }
}

#[test]
fn a_rename_reaches_every_controller_file_with_the_ladder_and_its_tests() {
    let folder = folder();
    let second = "ladder = [\"plant.toml\"]\n\n[outputs]\nhold = [\"valve\"]\n\
                  [[watch]]\nname = \"w\"\nalways = \"!valve | was(valve)\"\n";
    std::fs::write(folder.path().join("second.toml"), second).unwrap();
    let test = "controller = \"second.toml\"\n\n[[scenario]]\nname = \"s\"\n\
                steps = [\"expect: !valve\"]\n";
    std::fs::write(folder.path().join("second.test.toml"), test).unwrap();
    let mut editor = Editor::new(folder.path());
    editor.open(LADDER);
    let (line, column) = place(&editor, LADDER, "valve = {", 1);
    let edits = rename(&mut editor, TextPlace { name: LADDER, line, column }, "outlet").unwrap();
    for name in [CONTROLLER, LADDER, TEST, "second.toml", "second.test.toml"] {
        assert!(edits.contains_key(&editor.uri(name)), "{name}: {:?}", edits.keys());
    }
    let second = edited(&editor.disk("second.toml"), &edits[&editor.uri("second.toml")]);
    assert!(second.contains("always = \"!outlet | was(outlet)\""), "{second}");
}

/// A ladder names one device; each controller file with this ladder has its own device of that
/// name.
#[test]
fn a_device_is_renamed_in_all_controller_files_with_its_ladder() {
    let folder = empty();
    let device = "ladder = [\"plant.toml\"]\n\n[[device]]\nname = \"remote\"\ndriver = \"simulated\"\n\
                  part = [{ name = \"pump\", kind = \"motor\" }]\n\
                  map = [{ from = \"Y0\", to = \"pump.run\" }, { from = \"pump.running\", to = \"X0\" }]\n";
    let ladder = "[[program]]\nname = \"Main\"\n\nrung = [{ when = [\"remote.Ok\", \"X0\"], \
                  do = [\"OUT Y0\"] }]\n";
    let test = |of: &str| {
        format!(
            "controller = \"{of}.toml\"\n\n[[scenario]]\nname = \"s\"\n\
             steps = [\"run 1s\", \"lose remote\", \"within 1s: !Y0\"]\n"
        )
    };
    let texts = [
        ("plant.toml", ladder.to_owned()),
        ("first.toml", device.to_owned()),
        ("second.toml", device.to_owned()),
        ("first.test.toml", test("first")),
        ("second.test.toml", test("second")),
    ];
    for (name, text) in &texts {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    for (from, wanted) in [("plant.toml", "remote"), ("second.toml", "remote")] {
        let mut editor = Editor::new(folder.path());
        editor.open(from);
        let (line, column) = place(&editor, from, wanted, 1);
        let edits = rename(&mut editor, TextPlace { name: from, line, column }, "far").unwrap();
        for (name, _) in &texts {
            assert!(edits.contains_key(&editor.uri(name)), "{from}: {name}: {:?}", edits.keys());
        }
    }
}

/// Controller files that have only a library file in common do not belong to the same project.
#[test]
fn a_shared_library_file_does_not_join_two_projects() {
    let folder = empty();
    for of in ["one", "two"] {
        let controller = format!(
            "ladder = [\"lib:flasher\", \"{of}-ladder.toml\"]\n\n[outputs]\non = [\"lamp\"]\n"
        );
        std::fs::write(folder.path().join(format!("{of}.toml")), controller).unwrap();
        let ladder = "[tags]\nlamp = { at = \"Y0\" }\n\n[[program]]\nname = \"Main\"\n\
                      rung = [{ when = [\"X0\"], do = [\"OUT lamp\"] }]\n";
        std::fs::write(folder.path().join(format!("{of}-ladder.toml")), ladder).unwrap();
    }
    let mut editor = Editor::new(folder.path());
    editor.open("one-ladder.toml");
    let (line, column) = place(&editor, "one-ladder.toml", "lamp", 1);
    let edits =
        rename(&mut editor, TextPlace { name: "one-ladder.toml", line, column }, "light").unwrap();
    let mut files: Vec<&str> = edits.keys().filter_map(|uri| uri.rsplit('/').next()).collect();
    files.sort_unstable();
    assert_eq!(files, ["one-ladder.toml", "one.toml"]);
}

#[test]
fn a_name_that_hides_another_is_refused() {
    let folder = empty();
    let text = "[tags]\na = { at = \"X0\" }\nb = { at = \"Y0\" }\n\n[[template]]\nname = \"T\"\n\n\
                [template.parameters]\np = { type = \"output\" }\n\n[[template.rung]]\n\
                when = [\"a\"]\ndo = [\"OUT p\"]\n\n[[program]]\nname = \"Main\"\n\n\
                [[program.rung]]\nuse = \"T\"\nname = \"t\"\nwith = { p = \"b\" }\n";
    std::fs::write(folder.path().join(LADDER), text).unwrap();
    let mut editor = Editor::new(folder.path());
    editor.open(LADDER);
    // Within the template, `a` would then mean the parameter.
    let (line, column) = place(&editor, LADDER, "p = { type", 0);
    let why = rename(&mut editor, TextPlace { name: LADDER, line, column }, "a").unwrap_err();
    assert!(why.contains("would mean something else at"), "{why}");
}

#[test]
fn a_rename_of_a_field_reaches_the_records_of_templates() {
    let folder = empty();
    let text = "[tags]\nrecipe = { type = \"Step\", count = 2, initial = [{ kind = 3 }] }\n\n\
                [[record]]\nname = \"Step\"\nfields = { kind = { type = \"int\" } }\n\n\
                [[template]]\nname = \"T\"\nparameters = { step = { type = \"Step\" } }\n\
                tags = { own = { type = \"Step\" } }\nrung = [\n\
                { when = [\"step.kind.3\"], do = [\"MOVE step.kind to=own.kind\"] } ]\n\n\
                [[program]]\nname = \"Main\"\nrung = [\n\
                { use = \"T\", name = \"t\", with = { step = \"recipe[1]\" } },\n\
                { when = [\"t.own.kind > recipe[0].kind\"], do = [\"OUT Y0\"] } ]\n";
    std::fs::write(folder.path().join(LADDER), text).unwrap();
    let mut editor = Editor::new(folder.path());
    editor.open(LADDER);
    let mut renamed = |wanted: &str, new: &str| {
        let (line, column) = place(&editor, LADDER, wanted, 0);
        let edits = rename(&mut editor, TextPlace { name: LADDER, line, column }, new).unwrap();
        edited(&editor.disk(LADDER), &edits[&editor.uri(LADDER)])
    };
    assert_eq!(renamed("kind to=", "sort"), text.replace("kind", "sort"));
    assert_eq!(renamed("Step\" } }", "Part"), text.replace("Step", "Part"));
    assert_eq!(renamed("step.kind to", "part"), text.replace("step", "part"));
    assert_eq!(renamed("recipe[1]", "list"), text.replace("recipe", "list"));
}

/// The values of all operands, scan by scan, of a program with changing inputs.
fn trace(loaded: &Loaded) -> Vec<Vec<i64>> {
    let program = loaded.program.as_ref().expect("it loads");
    let names = program.named(4);
    let (lowered, symbols) = lower(program);
    // Any fixed pattern serves if it differs for each input.
    let mut text = (0..24).fold("scan".to_owned(), |head, input| format!("{head},X{input}"));
    for scan in 0..400 {
        let level = |input: usize| ((scan / (input * 7 + 5)) % 2).to_string();
        let row: Vec<String> = (0..24).map(level).collect();
        text.push_str(&format!("\n{scan},{}", row.join(",")));
    }
    let lookup = |name: &str| target(program, &symbols, name);
    let stimulus = Stimulus::parse(&text, &lookup).expect("a stimulus");
    let cells = names.iter().map(|named| {
        let address = program.scope().address(&named.name()).expect("a name");
        symbols.layout.cell(address).expect("a cell")
    });
    let mut rows = Rows::new(cells.collect());
    let plan = Plan { period_ms: 10, scans: 400, stop: true, clock_s: 0, stimulus };
    run(lowered, &plan, &mut rows).expect("it runs");
    rows.rows.into_iter().map(|(_, values)| values).collect()
}

fn loaded(folder: &Path, name: &str) -> Option<Loaded> {
    let path = folder.join(name);
    let loaded = match load::is_controller_file(&path).ok()? {
        true => load::controller_file(&path).ok()?,
        false => load::ladder_files(&[path]).ok()?,
    };
    loaded.program.is_some().then_some(loaded)
}

fn copied() -> TestFolder {
    let (folder, config) = (empty(), Path::new(env!("CARGO_MANIFEST_DIR")).join("config"));
    for name in shipped(&config) {
        let to = folder.path().join(&name);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(config.join(&name), to).unwrap();
    }
    folder
}

/// Renames names of every shipped program, one at a time: at most `RUNGD_RENAMES` (6) of each file.
#[test]
fn a_rename_never_changes_a_trace() {
    let most = std::env::var("RUNGD_RENAMES").ok().and_then(|n| n.parse().ok()).unwrap_or(6);
    let folder = copied();
    let mut renamed = 0;
    for root in shipped(folder.path()) {
        if root.ends_with(".test.toml") || root.contains('/') {
            continue;
        }
        let Some(before) = loaded(folder.path(), &root) else { continue };
        let wanted = trace(&before);
        for file in before.files.iter().filter(|file| !file.name.starts_with("lib:")) {
            let path = Path::new(&file.name).canonicalize().unwrap();
            let name = path.strip_prefix(folder.path()).unwrap().to_str().unwrap().to_owned();
            let mut editor = Editor::new(folder.path());
            editor.open(&root);
            if name != root {
                editor.open(&name);
            }
            let places = names_in(&editor.ask_at("textDocument/documentSymbol", &name, 0, 0));
            let step = places.len().div_ceil(most).max(1);
            for (at, (old, line, column)) in places.into_iter().enumerate() {
                if at % step != 0 || old == "Main" {
                    continue;
                }
                let new = if old.contains(' ') { "another text" } else { "q9renamed" };
                let edits = match rename(&mut editor, TextPlace { name: &name, line, column }, new)
                {
                    Ok(edits) => edits,
                    // A pattern of `[retain]` refers to the name by its first letters.
                    Err(why) if why.contains("retentive memory would keep") => continue,
                    Err(why) => panic!("{name}: {old}: {why}"),
                };
                let kept: Vec<(String, String)> = edits
                    .iter()
                    .map(|(uri, edits)| {
                        let path = uri.strip_prefix("file://").unwrap().to_owned();
                        let text = std::fs::read_to_string(&path).unwrap();
                        std::fs::write(&path, edited(&text, edits)).unwrap();
                        (path, text)
                    })
                    .collect();
                let after = loaded(folder.path(), &root);
                let after = after.unwrap_or_else(|| panic!("{name}: {old}: it does not load"));
                assert!(trace(&after) == wanted, "{name}: {old}: another trace");
                kept.into_iter().for_each(|(path, text)| std::fs::write(path, text).unwrap());
                renamed += 1;
            }
        }
    }
    assert!(renamed > 60, "{renamed} names");
}

/// If only a test file joins two ladders, each ladder is a project of its own. A rename in one of
/// them would break the test without a message.
#[test]
fn a_rename_that_reaches_only_some_ladders_of_a_test_is_refused() {
    let folder = empty();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let template = "[[template]]\nname = \"Seal\"\n[template.parameters]\ngo = { type = \"contact\" }\n\
                    [[template.rung]]\nwhen = [\"go\"]\ndo = [\"SET C0\"]\n";
    write("a.toml", template);
    write(
        "b.toml",
        "[tags]\nlamp = { at = \"Y0\" }\n[[program]]\nname = \"Main\"\n[[program.rung]]\nuse = \"Seal\"\n\
         name = \"s\"\nwith = { go = \"X0\" }\n[[program.rung]]\nwhen = [\"C0\"]\ndo = [\"OUT lamp\", \"RST C0\"]\n",
    );
    write(
        "t.test.toml",
        "ladder = [\"a.toml\", \"b.toml\"]\n[[scenario]]\nname = \"x\"\nsteps = [\"run 1s\"]\n",
    );
    let mut editor = Editor::new(folder.path());
    editor.open("a.toml");
    for (name, wanted) in [("Seal", "Seal"), ("go", "go = {")] {
        let (line, column) = place(&editor, "a.toml", wanted, 0);
        let why =
            rename(&mut editor, TextPlace { name: "a.toml", line, column }, "renamed").unwrap_err();
        assert!(why.contains("t.test.toml tests this ladder together with"), "{name}: {why}");
    }
    write("rungd.toml", "ladder = [\"a.toml\", \"b.toml\"]\n");
    editor.tell("workspace/didChangeWatchedFiles", json!({ "changes": [] }));
    let (line, column) = place(&editor, "a.toml", "Seal", 0);
    let edits = rename(&mut editor, TextPlace { name: "a.toml", line, column }, "Renamed").unwrap();
    assert_eq!(edits.len(), 2, "{edits:?}");
}

/// A refusal names the new error, not an error that exists already.
#[test]
fn a_refused_rename_names_the_new_error() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    let text = editor.disk(LADDER).replace("EXIT", "EXIT now");
    editor.open_with(LADDER, &text);
    let (line, column) = place_of(&text, "start = {");
    let why = rename(&mut editor, TextPlace { name: LADDER, line, column }, "x1").unwrap_err();
    assert!(why.contains("x1"), "{why}");
}

/// The names of symbols, with their places.
fn names_in(symbols: &Value) -> Vec<(String, usize, usize)> {
    let mut found = Vec::new();
    for symbol in symbols.as_array().into_iter().flatten() {
        let range = &symbol["selectionRange"];
        let place = |end: &str, key: &str| range[end][key].as_u64().unwrap() as usize;
        // A symbol without a name has an empty range.
        if place("start", "character") < place("end", "character") {
            let name = symbol["name"].as_str().unwrap().to_owned();
            found.push((name, place("start", "line"), place("start", "character")));
        }
        found.extend(names_in(&symbol["children"]));
    }
    found
}
