//! Formatting in an editor: the layout of `rungd fmt`, as edits.

use serde_json::{Value, json};

use crate::editor::client::Editor;
use crate::editor::project::{LADDER, empty, folder};

fn ask(editor: &mut Editor, name: &str) -> Value {
    let options = json!({ "tabSize": 4, "insertSpaces": true });
    let params = json!({ "textDocument": { "uri": editor.uri(name) }, "options": options });
    editor.ask("textDocument/formatting", params)
}

/// The byte of a position; the tests' texts are ASCII.
fn offset(text: &str, position: &Value) -> usize {
    let line = position["line"].as_u64().unwrap() as usize;
    let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
    start + position["character"].as_u64().unwrap() as usize
}

fn applied(text: &str, edits: &Value) -> String {
    let mut text = text.to_owned();
    for edit in edits.as_array().unwrap().iter().rev() {
        let (start, end) = (&edit["range"]["start"], &edit["range"]["end"]);
        let range = offset(&text, start)..offset(&text, end);
        text.replace_range(range, edit["newText"].as_str().unwrap());
    }
    text
}

#[test]
fn formatting_equals_the_output_of_fmt() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    editor.open(LADDER);
    let before = editor.disk(LADDER);
    let after = applied(&before, &ask(&mut editor, LADDER));
    assert_eq!(after, rungd_language::format::formatted(&before).unwrap());
    assert_ne!(after, before);
    editor.replace(LADDER, &after);
    assert_eq!(ask(&mut editor, LADDER), json!([]));
}

/// So a cursor in a different rung does not move.
#[test]
fn one_unformatted_line_gives_one_edit_of_one_line() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    let right = rungd_language::format::formatted(&editor.disk(LADDER)).unwrap();
    let wrong = right.replacen("do   = [\"SET failed_lamp\",", "do=[\"SET failed_lamp\",", 1);
    assert_ne!(wrong, right);
    editor.open_with(LADDER, &wrong);
    let edits = ask(&mut editor, LADDER);
    assert_eq!(applied(&wrong, &edits), right);
    let [edit] = edits.as_array().unwrap().as_slice() else { panic!("{edits}") };
    let line = |end: &str| edit["range"][end]["line"].as_u64().unwrap();
    assert_eq!(line("end") - line("start"), 1);
}

#[test]
fn broken_and_foreign_files_are_not_formatted() {
    let folder = empty();
    let mut editor = Editor::new(folder.path());
    for text in ["[tags\na=1", "[package]\nname='x'\n"] {
        editor.open_with("a.toml", text);
        assert_eq!(ask(&mut editor, "a.toml"), Value::Null);
    }
}
