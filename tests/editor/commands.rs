//! Commands, lenses and code actions: tests and simulations of the texts in the editor,
//! explanations, and the reason why an operand of a running controller has its value.

use serde_json::{Value, json};

use crate::editor::client::{Editor, place_of};
use crate::editor::project::{CONTROLLER, LADDER, TEST, folder};
#[cfg(feature = "prove")]
use rungd_test_support::folder::TestFolder;
use rungd_test_support::running::live::Live;

fn run(editor: &mut Editor, command: &str, arguments: Value) {
    let params = json!({ "command": command, "arguments": arguments });
    editor.ask("workspace/executeCommand", params);
}

/// The lenses of a file: the line, counted from 0, and the title.
fn lenses(editor: &mut Editor, name: &str) -> Vec<(u64, String)> {
    let document = json!({ "uri": editor.uri(name) });
    let lenses = editor.ask("textDocument/codeLens", json!({ "textDocument": document }));
    let told = |lens: &Value| {
        let title = lens["command"]["title"].as_str().unwrap().to_owned();
        (lens["range"]["start"]["line"].as_u64().unwrap(), title)
    };
    lenses.as_array().unwrap().iter().map(told).collect()
}

/// Waits for a message of the server with this method, and returns its parameters.
fn await_told(editor: &mut Editor, method: &str) -> Value {
    loop {
        let found = {
            let told = editor.told.borrow();
            told.iter().position(|of| of["method"] == method)
        };
        if let Some(at) = found {
            return editor.told.borrow_mut().remove(at)["params"].clone();
        }
        editor.hear();
    }
}

/// The diagnostics of failed tests of the test file, as they were last sent.
fn failed(editor: &Editor) -> Vec<Value> {
    let all = editor.all_diagnostics();
    let of = all.get(&editor.uri(TEST)).cloned().unwrap_or_default();
    of.into_iter().filter(|of| of["source"] == "rungd test").collect()
}

fn editor(folder: &std::path::Path) -> Editor {
    let workspace = json!({ "codeLens": { "refreshSupport": true } });
    let window = json!({ "showDocument": { "support": true } });
    Editor::with(folder, json!({ "workspace": workspace, "window": window }))
}

#[test]
fn the_lens_of_a_test_shows_that_the_test_passed() {
    let folder = folder();
    let mut editor = editor(folder.path());
    let text = editor.disk(TEST).replace("run 2 scans", "run 1 scans");
    editor.open_with(TEST, &text);
    let line = place_of(&text, "[[scenario]]").0 as u64;
    let run_all = (0, "run all".to_owned());
    let one = (line, "run".to_owned());
    assert_eq!(lenses(&mut editor, TEST), [run_all.clone(), one.clone()]);
    let uri = editor.uri(TEST);
    run(&mut editor, "rungd.test", json!([uri, "it opens"]));
    await_told(&mut editor, "workspace/codeLens/refresh");
    let passed = (line, "passed, 1 scan".to_owned());
    assert_eq!(lenses(&mut editor, TEST), [run_all, one, passed]);
    assert_eq!(failed(&editor), [Value::Null; 0]);
}

#[test]
fn a_failed_test_is_a_diagnostic_at_its_step_until_the_text_changes() {
    let folder = folder();
    let mut editor = editor(folder.path());
    editor.open(TEST);
    let text = editor.disk(LADDER).replace("level > 3 | !start", "level > 9");
    editor.open_with(LADDER, &text);
    let uri = editor.uri(TEST);
    run(&mut editor, "rungd.test", json!([uri]));
    await_told(&mut editor, "workspace/codeLens/refresh");
    let said = await_told(&mut editor, "window/showMessage");
    assert_eq!(said["message"], "it opens: failed at step 3");
    assert!(lenses(&mut editor, TEST).iter().any(|(_, title)| title == "failed at step 3"));
    while failed(&editor).is_empty() {
        editor.hear();
    }
    let shown = failed(&editor).remove(0);
    let (line, column) = place_of(&editor.disk(TEST), "expect: valve");
    assert_eq!(shown["range"]["start"], json!({ "line": line, "character": column }));
    let message = shown["message"].as_str().unwrap();
    assert!(message.contains("step 3 of 3: expect: valve"), "{message}");
    assert!(message.contains("valve  OFF"), "the operands: {message}");
    run(&mut editor, "rungd.test.show", json!([uri, "it opens"]));
    let shown = await_told(&mut editor, "window/showDocument");
    let path = shown["uri"].as_str().unwrap().trim_start_matches("file://").replace("%20", " ");
    assert!(std::fs::read_to_string(path).unwrap().contains("step 3 of 3"));
    editor.replace(LADDER, &text.replace("level > 9", "level > 8"));
    while !failed(&editor).is_empty() {
        editor.hear();
    }
    assert!(!lenses(&mut editor, TEST).iter().any(|(_, title)| title.starts_with("failed")));
}

#[test]
fn a_file_with_mistakes_is_not_run() {
    let folder = folder();
    let mut editor = editor(folder.path());
    let text = editor.disk(TEST).replace("expect: valve", "expect: nothing_such");
    editor.open_with(TEST, &text);
    let uri = editor.uri(TEST);
    run(&mut editor, "rungd.test", json!([uri]));
    let said = await_told(&mut editor, "window/showMessage");
    let message = said["message"].as_str().unwrap();
    assert!(message.contains("cannot be run") && message.contains("nothing_such"), "{message}");
}

#[test]
fn a_simulation_is_shown_as_a_picture_or_a_table() {
    let folder = folder();
    let mut editor = editor(folder.path());
    let text = editor.disk(LADDER);
    editor.open(LADDER);
    let line = place_of(&text, "[[program]]").0 as u64;
    let titles = [
        (line, "simulate".to_owned()),
        #[cfg(feature = "prove")]
        (line, "survey".to_owned()),
        (line, "show live values".to_owned()),
    ];
    assert_eq!(lenses(&mut editor, LADDER), titles);
    let uri = editor.uri(LADDER);
    run(&mut editor, "rungd.simulate", json!([uri]));
    let shown = await_told(&mut editor, "window/showDocument");
    let path = shown["uri"].as_str().unwrap().trim_start_matches("file://");
    assert!(path.ends_with("/rungd-simulated.svg") && shown["external"] == true, "{shown}");
    assert!(std::fs::read_to_string(path).unwrap().starts_with("<svg"));
    // The text in the editor is used, not the text on disk.
    editor.replace(LADDER, &text.replace("name = \"plant\"", "name = \"p\"\ndoc = \"d\""));
    run(&mut editor, "rungd.simulate", json!([uri, 5, "csv"]));
    let shown = await_told(&mut editor, "window/showDocument");
    let path = shown["uri"].as_str().unwrap().trim_start_matches("file://").to_owned();
    let table = std::fs::read_to_string(&path).unwrap();
    assert_eq!(table.lines().count(), 6, "{table}");
    assert!(table.starts_with("scan,time_ms,"), "{table}");
    drop(editor);
    assert!(!std::path::Path::new(&path).exists(), "the files go with the server");
}

#[test]
fn invalid_command_arguments_are_refused() {
    let folder = folder();
    let mut editor = editor(folder.path());
    editor.open(LADDER);
    editor.open(TEST);
    let (ladder, test) = (editor.uri(LADDER), editor.uri(TEST));
    let mut check = |command: &str, arguments: Value, why: &str| {
        let params = json!({ "command": command, "arguments": arguments });
        let response = editor.respond("workspace/executeCommand", params);
        let error = response.response_result.expect_err(why);
        assert!(error.message.contains(why), "{}", error.message);
    };
    let scans = "the second argument is a number of scans, 1 or more";
    check("rungd.simulate", json!([ladder, 0]), scans);
    check("rungd.simulate", json!([ladder, -3]), scans);
    check("rungd.simulate", json!([ladder, "5"]), scans);
    check("rungd.simulate", json!([ladder, 5, "svg"]), "the third argument is \"csv\": `svg`");
    check("rungd.test", json!([ladder]), "the name of a test file ends in `.test.toml`");
    check("rungd.test", json!([test, 7]), "the second argument is the name of a test: `7`");
    check("rungd.test", json!(["untitled:1"]), "the first argument is the URI of a file");
    check("rungd.tset", json!([test]), "there is no command `rungd.tset`");
}

#[test]
fn an_editor_that_cannot_open_documents_gets_a_message_with_the_path() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    editor.open(LADDER);
    let uri = editor.uri(LADDER);
    run(&mut editor, "rungd.simulate", json!([uri]));
    let said = await_told(&mut editor, "window/showMessage");
    let path = said["message"].as_str().unwrap();
    assert!(std::path::Path::new(path).is_file(), "{path}");
}

#[test]
fn the_name_at_the_cursor_is_explained() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    editor.open(LADDER);
    let text = editor.disk(LADDER);
    let uri = editor.uri(LADDER);
    for (of, words) in [
        ("OUT valve", ["OUT: ", "legs"]),
        ("level > 3", ["level: tag", "min = 0, max = 100"]),
        ("JMP Close", ["JMP: ", "form"]),
    ] {
        let (line, character) = place_of(&text, of);
        let position = json!({ "line": line, "character": character });
        let range = json!({ "start": position, "end": position });
        let document = json!({ "uri": uri });
        let context = json!({ "diagnostics": [] });
        let params = json!({ "textDocument": document, "range": range, "context": context });
        let actions = editor.ask("textDocument/codeAction", params);
        let action = &actions.as_array().unwrap()[0];
        assert_eq!(action["command"], "rungd.explain", "{actions}");
        run(&mut editor, "rungd.explain", action["arguments"].clone());
        let said = await_told(&mut editor, "window/showMessage");
        let message = said["message"].as_str().unwrap();
        assert!(words.iter().all(|word| message.contains(word)), "{of}: {message}");
    }
}

#[cfg(feature = "prove")]
#[test]
fn a_survey_shows_hints_at_rungs_until_the_text_changes() {
    let folder = TestFolder::new("editor-survey");
    let text = "[[program]]\nname = \"Main\"\nrung = [\n  { when = [\"X1\"], do = [\"OUT Y1\"] },\n  \
                { when = [\"X0\", \"!X0\"], do = [\"OUT Y0\"] },\n]\n";
    std::fs::write(folder.path().join("ladder.toml"), "").unwrap();
    let mut editor = editor(folder.path());
    editor.open_with("ladder.toml", text);
    let uri = editor.uri("ladder.toml");
    let hints = |editor: &Editor| -> Vec<Value> {
        let all = editor.all_diagnostics();
        let of_file = all.get(&uri).cloned().unwrap_or_default();
        of_file.into_iter().filter(|one| one["source"] == "rungd survey").collect()
    };
    run(&mut editor, "rungd.survey", json!([uri]));
    assert_eq!(await_told(&mut editor, "window/showMessage")["message"], "survey: 1 hint");
    while hints(&editor).is_empty() {
        editor.hear();
    }
    let shown = hints(&editor);
    assert_eq!(shown.len(), 1, "{shown:?}");
    assert_eq!(shown[0]["severity"], 4);
    assert_eq!(shown[0]["message"], "Main, rung 2: never ON");
    assert_eq!(shown[0]["range"]["start"], json!({ "line": 4, "character": 2 }));
    editor.replace("ladder.toml", &text.replace("!X0", "X2"));
    while !hints(&editor).is_empty() {
        editor.hear();
    }
    run(&mut editor, "rungd.survey", json!([uri]));
    let said = await_told(&mut editor, "window/showMessage");
    assert_eq!(said["message"], "survey: everything is as expected");
}

#[cfg(feature = "prove")]
#[test]
fn a_ladder_with_mistakes_is_not_surveyed() {
    let folder = folder();
    let mut editor = editor(folder.path());
    let text = editor.disk(LADDER).replace("level > 3", "nothing_such > 3");
    editor.open_with(LADDER, &text);
    let uri = editor.uri(LADDER);
    run(&mut editor, "rungd.survey", json!([uri]));
    let said = await_told(&mut editor, "window/showMessage");
    let message = said["message"].as_str().unwrap();
    assert!(
        message.contains("cannot be surveyed") && message.contains("nothing_such"),
        "{message}"
    );
}

#[test]
fn impossible_commands_are_refused_with_a_reason() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    editor.open(LADDER);
    let uri = editor.uri(LADDER);
    // The place is an empty line.
    let place = json!({ "line": 2, "character": 0 });
    for (command, arguments, words) in [
        ("rungd.nothing", json!([]), "no command"),
        ("rungd.test", json!([]), "the URI of a file"),
        ("rungd.explain", json!([uri]), "a position"),
        ("rungd.explain", json!([uri, place]), "nothing to explain"),
        ("rungd.why", json!([uri, place]), "no operand"),
        #[cfg(feature = "prove")]
        ("rungd.how", json!([uri, place]), "no operand"),
        ("rungd.test.show", json!([uri, "no test"]), "has not failed"),
    ] {
        let params = json!({ "command": command, "arguments": arguments });
        let refused = editor.respond("workspace/executeCommand", params);
        let error = refused.response_result.unwrap_err();
        assert!(error.message.contains(words), "{command}: {error:?}");
    }
}

#[test]
fn a_running_controller_answers_why_in_the_editor() {
    let ladder = "[tags]\neye = { at = \"X0\" }\nlamp = { at = \"Y0\" }\n[[program]]\nname = \"Main\"\n\
                  [[program.rung]]\nname = \"light\"\nwhen = [\"eye\"]\ndo = [\"OUT lamp\"]\n";
    let live = Live::start(ladder, "", &[]);
    live.ok("write eye ON");
    live.await_values("lamp", "ON");
    let mut editor = editor(&live.folder);
    editor.open("ladder.toml");
    let (line, column) = place_of(ladder, "lamp\"");
    let uri = editor.uri("ladder.toml");
    let position = json!({ "line": line, "character": column });
    loop {
        run(&mut editor, "rungd.why", json!([uri, position]));
        let shown = await_told(&mut editor, "window/showDocument");
        let path = shown["uri"].as_str().unwrap().trim_start_matches("file://");
        let text = std::fs::read_to_string(path).unwrap();
        // The scan log may be a little behind the memory.
        if text.contains("ON") {
            assert!(text.contains("light") && text.contains("eye"), "{text}");
            return;
        }
    }
}

#[cfg(feature = "prove")]
#[test]
fn a_running_controller_tells_in_the_editor_how_a_value_could_change() {
    let ladder = "[tags]\neye = { at = \"X0\" }\nlamp = { at = \"Y0\" }\n[[program]]\nname = \"Main\"\n\
                  [[program.rung]]\nwhen = [\"eye\"]\ndo = [\"OUT lamp\"]\n";
    let live = Live::start(ladder, "", &[]);
    live.await_values("lamp", "OFF");
    let mut editor = editor(&live.folder);
    editor.open("ladder.toml");
    let (line, column) = place_of(ladder, "lamp\"");
    let uri = editor.uri("ladder.toml");
    let position = json!({ "line": line, "character": column });
    let range = json!({ "start": position, "end": position });
    let params = json!({ "textDocument": { "uri": uri }, "range": range,
                         "context": { "diagnostics": [] } });
    let offered = editor.ask("textDocument/codeAction", params).to_string();
    assert!(offered.contains("How could `lamp` change?"), "{offered}");
    run(&mut editor, "rungd.how", json!([uri, position]));
    let shown = await_told(&mut editor, "window/showDocument");
    let path = shown["uri"].as_str().unwrap().trim_start_matches("file://");
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.starts_with("turn eye ON; lamp is ON in the same scan\n"), "{text}");
}

#[test]
fn a_controller_file_has_no_lenses() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    editor.open(CONTROLLER);
    assert_eq!(lenses(&mut editor, CONTROLLER), []);
}
