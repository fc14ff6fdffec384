//! The live view, with a real controller: its values appear beside the text that it runs, and
//! follow its memory. They vanish when the controller ends and beside any different text. The view
//! never writes anything.

use serde_json::{Value, json};

use crate::editor::client::{Editor, place_of};
use rungd_test_support::running::live::Live;

const LADDER: &str = "ladder.toml";

const TEXT: &str = r#"[ladder]
name = "tank"

[tags]
eye = { at = "X0" }
seen = { at = "X1" }
level = { at = "D0" }
lamp = { at = "Y0" }
late = { at = "T0" }
parts = { type = "counter" }
most = { value = 4 }

[[template]]
name = "Pump"

[template.parameters]
motor = { type = "output" }

[template.tags]
failed = { type = "bit" }

[[template.rung]]
when = ["!failed"]
do = ["OUT motor"]

[[program]]
name = "Main"

[[program.rung]]
when = ["eye | !p1.failed", "level > 3"]
do = ["OUT lamp"]

[[program.rung]]
when = ["lamp", "late.Acc >= 1s"]
do = ["SET C0", "RST C0"]

[[program.rung]]
when = ["seen", "level * 2 - most > D0 / 5 | late.Acc + 500 < 1m"]
do = ["OUT Y3"]

[[program.rung]]
when = ["$Off"]
do = ["MATH D9 = level + 1"]

[[program.rung]]
leg.en = ["$Off"]
leg.rst = ["$Off"]
do = ["TMRA late preset=3s"]

[[program.rung]]
leg.up = ["eye"]
leg.rst = ["$Off"]
do = ["CNT parts preset=level"]

[[program.rung]]
use = "Pump"
name = "p1"
with = { motor = "Y1" }
"#;

/// An editor that the server can ask to refresh its hints and tokens.
fn editor(live: &Live) -> Editor {
    let refresh = json!({ "refreshSupport": true });
    let workspace = json!({ "inlayHint": refresh, "semanticTokens": refresh });
    Editor::with(&live.folder, json!({ "workspace": workspace }))
}

fn controller() -> Live {
    Live::start(
        TEXT,
        "[[simulated-device]]
input = \"X1\"
follows = \"Y0\"
",
        &[],
    )
}

/// Turns the view on, as a person does.
fn turn(editor: &mut Editor, on: bool) {
    let command = if on { "rungd.live.on" } else { "rungd.live.off" };
    editor.ask("workspace/executeCommand", json!({ "command": command }));
}

/// The hints of the ladder, each with its line from 0.
fn hints(editor: &mut Editor) -> Vec<(u64, String)> {
    let range = json!({
        "start": { "line": 0, "character": 0 }, "end": { "line": 1000, "character": 0 }
    });
    let document = json!({ "uri": editor.uri(LADDER) });
    let params = json!({ "textDocument": document, "range": range });
    let hints = editor.ask("textDocument/inlayHint", params);
    let told = |hint: &Value| {
        let line = hint["position"]["line"].as_u64().unwrap();
        (line, hint["label"].as_str().unwrap().to_owned())
    };
    hints.as_array().into_iter().flatten().map(told).collect()
}

/// Waits until the hints are as wanted; requests them again after each message of the server.
fn await_hints(editor: &mut Editor, wanted: impl Fn(&[(u64, String)]) -> bool) {
    while !{
        let hints = hints(editor);
        wanted(&hints)
    } {
        editor.hear();
    }
}

fn has(hints: &[(u64, String)], of: &str, label: &str) -> bool {
    let line = place_of(TEXT, of).0 as u64;
    hints.contains(&(line, label.to_owned()))
}

/// The messages for the person so far, without those that a too busy machine causes.
fn messages(editor: &Editor) -> Vec<String> {
    let told = editor.told.borrow();
    let shown = told.iter().filter(|of| of["method"] == "window/showMessage");
    let mut all: Vec<&str> = Vec::new();
    let mut was_late = false;
    for message in shown.map(|of| of["params"]["message"].as_str().unwrap()) {
        let is_late = message.contains("gave no answer in");
        if !(is_late || was_late && message.contains("values are live")) {
            all.push(message);
        }
        was_late = is_late;
    }
    all.into_iter().map(str::to_owned).collect()
}

/// The tokens of the ladder: the text of each, its type and its modifiers.
fn tokens(editor: &mut Editor, text: &str) -> Vec<(String, u64, u64)> {
    let document = json!({ "uri": editor.uri(LADDER) });
    let answer =
        editor.ask("textDocument/semanticTokens/full", json!({ "textDocument": document }));
    let data: Vec<u64> =
        answer["data"].as_array().unwrap().iter().map(|of| of.as_u64().unwrap()).collect();
    let lines: Vec<&str> = text.lines().collect();
    let (mut line, mut column) = (0, 0);
    let mut all = Vec::new();
    for token in data.chunks(5) {
        column = if token[0] > 0 { token[1] } else { column + token[1] };
        line += token[0];
        let word = &lines[line as usize][column as usize..(column + token[2]) as usize];
        all.push((word.to_owned(), token[3], token[4]));
    }
    all
}

/// The types and modifiers of tokens, as in the server's legend.
const VARIABLE: u64 = 0;
const FUNCTION: u64 = 1;
const PROPERTY: u64 = 3;
const DECLARATION: u64 = 1;
const ON: u64 = 2;
const OFF: u64 = 4;

#[test]
fn live_values_appear_change_and_disappear() {
    let mut live = controller();
    let mut editor = editor(&live);
    editor.open(LADDER);
    assert_eq!(hints(&mut editor), [], "it is off at first");
    turn(&mut editor, true);
    await_hints(&mut editor, |hints| has(hints, "level > 3", "level = 0"));
    live.ok("write level 37");
    await_hints(&mut editor, |hints| {
        has(hints, "level > 3", "level = 37")
            && has(hints, "level * 2", "level = 37, D0 = 37, late.Acc = 0 s, 70 > 7, 500ms < 1m")
            && has(hints, "OUT lamp", "lamp = ON")
            && has(hints, "OUT Y3", "Y3 = ON")
            && has(hints, "late.Acc >= 1s", "late.Acc = 0 s")
            && has(hints, "CNT parts", "parts.Acc = 0, level = 37")
            && has(hints, "MATH D9", "D9 = 0, level = 37")
    });
    live.ok("write late.Acc 1200");
    await_hints(&mut editor, |hints| has(hints, "late.Acc >= 1s", "late.Acc = 1.2 s"));
    // Outside RUN the text beside an output is what is driven, whatever memory holds.
    live.ok("mode stop");
    live.ok("force lamp ON");
    await_hints(&mut editor, |hints| has(hints, "OUT lamp", "lamp = OFF, safe value"));
    assert_eq!(messages(&editor), [""; 0]);
    live.end();
    await_hints(&mut editor, <[_]>::is_empty);
    let said = messages(&editor);
    assert!(said.len() == 1 && said[0].contains("no live values"), "{said:?}");
}

#[test]
fn live_values_write_nothing_to_the_controller() {
    let mut live = controller();
    let mut editor = editor(&live);
    editor.open(LADDER);
    turn(&mut editor, true);
    await_hints(&mut editor, |hints| has(hints, "level > 3", "level = 0"));
    assert_eq!(live.say("status --json").json()["forces"], json!([]));
    live.ok("write level 5");
    await_hints(&mut editor, |hints| has(hints, "level > 3", "level = 5"));
    live.signal("TERM");
    assert!(live.child.wait().unwrap().success());
    let log: Vec<String> = live.rest().iter().map(Value::to_string).collect();
    let is_change = |line: &&String| line.contains("operator-") && !line.contains("-listens");
    let changes: Vec<&String> = log.iter().filter(is_change).collect();
    assert!(matches!(changes.as_slice(), [own] if own.contains("operator-write")), "{changes:?}");
}

#[test]
fn contacts_are_coloured_by_the_state_of_their_bits() {
    let live = controller();
    let mut editor = editor(&live);
    editor.open(LADDER);
    let is = |of: &[(String, u64, u64)], word: &str, kind, modifiers| {
        of.contains(&(word.to_owned(), kind, modifiers))
    };
    let still = tokens(&mut editor, TEXT);
    assert!(is(&still, "TMRA", FUNCTION, 0) && is(&still, "eye", VARIABLE, DECLARATION));
    assert!(is(&still, "lamp", VARIABLE, 0) && is(&still, "Acc", PROPERTY, 0), "{still:?}");
    assert!(still.iter().all(|(_, _, modifiers)| modifiers & (ON | OFF) == 0), "{still:?}");
    turn(&mut editor, true);
    let wanted = |tokens: &[(String, u64, u64)]| {
        is(tokens, "eye", VARIABLE, ON) && is(tokens, "lamp", VARIABLE, OFF)
    };
    live.ok("force eye ON");
    while !wanted(&tokens(&mut editor, TEXT)) {
        editor.hear();
    }
    let shown = tokens(&mut editor, TEXT);
    assert!(is(&shown, "p1", VARIABLE, OFF), "a tag of a use: {shown:?}");
    assert!(is(&shown, "failed", VARIABLE, 0), "one tag of each use has no value: {shown:?}");
    turn(&mut editor, false);
    let off = tokens(&mut editor, TEXT);
    assert_eq!(off, still);
}

#[test]
fn values_are_shown_only_for_the_running_text() {
    let live = controller();
    let mut editor = editor(&live);
    editor.open(LADDER);
    turn(&mut editor, true);
    await_hints(&mut editor, |hints| !hints.is_empty());
    editor.replace(LADDER, &TEXT.replace("level > 3", "level > 4"));
    assert_eq!(hints(&mut editor), [], "at once");
    while messages(&editor).is_empty() {
        editor.hear();
    }
    assert_eq!(hints(&mut editor), []);
    editor.replace(LADDER, TEXT);
    await_hints(&mut editor, |hints| has(hints, "level > 3", "level = 0"));
    let said = messages(&editor);
    assert!(said[0].contains("`tank`") && said[0].contains("different program"), "{said:?}");
    assert!(said.len() == 2 && said[1].contains("values are live"), "{said:?}");
}

#[test]
fn live_values_stay_after_a_change_of_a_comment() {
    let live = controller();
    let mut editor = editor(&live);
    editor.open(LADDER);
    turn(&mut editor, true);
    await_hints(&mut editor, |hints| !hints.is_empty());
    for text in [&TEXT.replace("[tags]", "[tags] # what there is"), TEXT, TEXT] {
        editor.replace(LADDER, text);
        await_hints(&mut editor, |hints| has(hints, "level > 3", "level = 0"));
    }
    assert_eq!(messages(&editor), [""; 0]);
}

#[test]
fn the_settings_enable_live_values_and_name_the_socket() {
    let live = controller();
    let socket = live.folder.join("moved");
    std::fs::rename(&live.socket, &socket).unwrap();
    let mut editor = editor(&live);
    editor.open(LADDER);
    let settings = json!({ "rungd": { "live": true, "socket": socket } });
    editor.tell("workspace/didChangeConfiguration", json!({ "settings": settings }));
    await_hints(&mut editor, |hints| has(hints, "level > 3", "level = 0"));
    let settings = json!({ "rungd": { "live": false } });
    editor.tell("workspace/didChangeConfiguration", json!({ "settings": settings }));
    assert_eq!(hints(&mut editor), []);
}

#[test]
fn a_missing_controller_is_reported_in_one_message() {
    let folder = crate::editor::project::folder();
    let mut editor = Editor::new(folder.path());
    editor.open(crate::editor::project::LADDER);
    let socket = folder.path().join("none");
    let settings = json!({ "live": true, "socket": socket });
    editor.tell("workspace/didChangeConfiguration", json!({ "settings": settings }));
    while messages(&editor).is_empty() {
        editor.hear();
    }
    let said = messages(&editor);
    assert!(said[0].contains("no rungd answers"), "{said:?}");
}
