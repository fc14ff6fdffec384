//! Code actions: what the helps of `tests/ui` offer, and that each of them repairs or silences its
//! finding, makes no new error and, for a warning, changes no trace.
//!
//! `fixes.txt` has the titles per finding: `UPDATE_EXPECT=1` writes it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use crate::client::Editor;
use crate::findings::shipped;

fn editor(folder: &Path) -> Editor {
    let literals = json!({ "codeActionKind": { "valueSet": ["quickfix"] } });
    let wants =
        json!({ "textDocument": { "codeAction": { "codeActionLiteralSupport": literals } } });
    Editor::with(folder, wants)
}

/// The actions for a diagnostic.
fn actions(editor: &mut Editor, name: &str, diagnostic: &Value) -> Vec<Value> {
    let params = json!({
        "textDocument": { "uri": editor.uri(name) },
        "range": diagnostic["range"],
        "context": { "diagnostics": [diagnostic] },
    });
    let all = editor.ask("textDocument/codeAction", params);
    let all = all.as_array().cloned().unwrap_or_default();
    let is_own = |action: &Value| action["diagnostics"][0] == *diagnostic;
    all.into_iter().filter(is_own).collect()
}

/// A text with the edits of an action.
fn applied(text: &str, action: &Value) -> String {
    let edits = action["edit"]["changes"].as_object().unwrap().values().next().unwrap();
    let offset = |place: &Value| {
        let line = place["line"].as_u64().unwrap() as usize;
        let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1));
        let start = starts.into_iter().nth(line).unwrap();
        let wanted = place["character"].as_u64().unwrap() as usize;
        let mut units = 0;
        let rest = text[start..].char_indices();
        let within = rest
            .take_while(|(_, char)| {
                units += char.len_utf16();
                units <= wanted
            })
            .last();
        start + within.map_or(0, |(at, char)| at + char.len_utf8())
    };
    let mut edits: Vec<(usize, usize, &str)> = edits
        .as_array()
        .unwrap()
        .iter()
        .map(|edit| {
            let range = &edit["range"];
            (offset(&range["start"]), offset(&range["end"]), edit["newText"].as_str().unwrap())
        })
        .collect();
    edits.sort_unstable();
    let mut changed = text.to_owned();
    for (start, end, new) in edits.into_iter().rev() {
        changed.replace_range(start..end, new);
    }
    changed
}

type Counted = BTreeMap<(String, String), usize>;

/// The findings by name and message, labels and helps left out; errors only, or all.
fn counted(diagnostics: &[Value], errors: bool) -> Counted {
    let mut counted = Counted::new();
    for diagnostic in diagnostics.iter().filter(|of| !errors || of["severity"] == 1) {
        *counted.entry(name(diagnostic)).or_default() += 1;
    }
    counted
}

fn name(diagnostic: &Value) -> (String, String) {
    let message = diagnostic["message"].as_str().unwrap();
    let message = message.split("\nhelp: ").next().unwrap();
    (diagnostic["code"].as_str().unwrap_or("-").to_owned(), message.to_owned())
}

/// Tries all actions of a file; tells their titles, by finding.
fn tried(editor: &mut Editor, name_of: &str, text: &str) -> String {
    editor.open_with(name_of, text);
    let mut told = String::new();
    let diagnostics = editor.diagnostics(name_of);
    let (all, errors) = (counted(&diagnostics, false), counted(&diagnostics, true));
    let mut seen = Vec::new();
    for diagnostic in &diagnostics {
        if seen.contains(&diagnostic) {
            continue;
        }
        seen.push(diagnostic);
        let own = name(diagnostic);
        let line = diagnostic["range"]["start"]["line"].as_u64().unwrap() + 1;
        let offered = actions(editor, name_of, diagnostic);
        let _ = writeln!(told, "{name_of}:{line} {}", own.0);
        for action in offered {
            let title = action["title"].as_str().unwrap();
            let mark = if action["isPreferred"] == true { "*" } else { "-" };
            let _ = writeln!(told, "  {mark} {title}");
            editor.replace(name_of, &applied(text, &action));
            let after = editor.diagnostics(name_of);
            let count = |of: &Counted| of.get(&own).copied().unwrap_or(0);
            assert!(count(&counted(&after, false)) < count(&all), "{name_of}: {title} repairs");
            for (error, count) in counted(&after, true) {
                let before = errors.get(&error).copied().unwrap_or(0);
                assert!(count <= before, "{name_of}:{line}: {title} makes {error:?}");
            }
            editor.replace(name_of, text);
            editor.diagnostics(name_of);
        }
    }
    editor.close(name_of);
    told
}

#[test]
fn helps_become_actions_that_repair() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ui");
    let mut editor = editor(&folder);
    let mut told = String::new();
    for name in shipped(&folder) {
        if let Ok(text) = std::fs::read_to_string(folder.join(&name)) {
            told.push_str(&tried(&mut editor, &name, &text));
        }
    }
    expect_test::expect_file!["fixes.txt"].assert_eq(&told);
}
