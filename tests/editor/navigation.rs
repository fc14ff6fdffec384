//! Go to definition, references and symbols, on a project of several files.

use serde_json::{Value, json};

use crate::editor::client::{Editor, place_of};
use crate::editor::project::{CONTROLLER, LADDER, TEST, empty, folder};

/// `file:line:column` of a location, lines and columns from 0.
fn at(location: &Value) -> String {
    let file = location["uri"].as_str().unwrap().rsplit('/').next().unwrap();
    let start = &location["range"]["start"];
    format!("{file}:{}:{}", start["line"], start["character"])
}

fn definition(editor: &mut Editor, name: &str, wanted: &str, within: usize) -> String {
    let (line, column) = place_of(&editor.disk(name), wanted);
    at(&editor.ask_at("textDocument/definition", name, line, column + within))
}

#[test]
fn a_name_leads_to_its_declaration_in_any_file() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    for name in [CONTROLLER, LADDER, TEST] {
        editor.open(name);
    }
    // `|` stands before the place.
    let place = |wanted: &str| {
        let text = std::fs::read_to_string(folder.path().join(LADDER)).unwrap();
        let (line, column) = place_of(&text, &wanted.replacen('|', "", 1));
        let line = line + usize::from(wanted.starts_with('\n'));
        let within = wanted.trim_start().find('|').unwrap_or(0);
        let column = if wanted.starts_with('\n') { within } else { column + within };
        format!("plant.toml:{line}:{column}")
    };
    assert_eq!(definition(&mut editor, LADDER, "level > 3", 2), place("level = {"));
    assert_eq!(definition(&mut editor, LADDER, "RUN Drain", 6), place("name = \"|Drain"));
    assert_eq!(definition(&mut editor, LADDER, "JMP Close", 6), place("name = \"|Close"));
    assert_eq!(definition(&mut editor, LADDER, "Drain.Close", 8), place("name = \"|Close"));
    assert_eq!(definition(&mut editor, LADDER, "use = \"Pump\"", 8), place("name = \"|Pump"));
    assert_eq!(definition(&mut editor, LADDER, "\"!failed", 4), place("\n|failed = {"));
    assert_eq!(definition(&mut editor, LADDER, "p1.failed", 5), place("\n|failed = {"));
    assert_eq!(definition(&mut editor, LADDER, "p1.failed", 1), place("name = \"|p1"));
    assert_eq!(definition(&mut editor, TEST, "set start", 6), place("start = {"));
    assert_eq!(definition(&mut editor, CONTROLLER, "valve", 1), place("valve = {"));
    assert_eq!(definition(&mut editor, CONTROLLER, "plant.toml", 1), "plant.toml:0:0");
}

#[test]
fn references_are_found_in_all_files() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    editor.open(LADDER);
    let (line, column) = place_of(&editor.disk(LADDER), "valve = {");
    let all = editor.ask_at("textDocument/references", LADDER, line, column);
    let mut files: Vec<String> = all.as_array().unwrap().iter().map(at).collect();
    files.sort();
    assert_eq!(files.len(), 5, "{files:?}");
    assert!(files.iter().any(|at| at.starts_with("plant.test.toml")), "{files:?}");
    assert!(files.iter().any(|at| at.starts_with("rungd.toml")), "{files:?}");
}

#[test]
fn document_symbols_form_a_tree() {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    editor.open(LADDER);
    let all = editor.ask_at("textDocument/documentSymbol", LADDER, 0, 0);
    fn told(symbols: &Value, depth: usize, lines: &mut Vec<String>) {
        for symbol in symbols.as_array().into_iter().flatten() {
            lines.push(format!("{}{}", "  ".repeat(depth), symbol["name"].as_str().unwrap()));
            told(&symbol["children"], depth + 1, lines);
        }
    }
    let mut lines = Vec::new();
    told(&all, 0, &mut lines);
    let wanted = [
        "start",
        "level",
        "valve",
        "Pump",
        "  wanted",
        "  motor",
        "  failed",
        "  OUT motor",
        "Main",
        "  fill",
        "  p1",
        "  SET failed_lamp",
        "failed_lamp",
    ];
    for name in wanted {
        assert!(lines.iter().any(|line| line == name), "{name:?} in {lines:#?}");
    }
}

/// A file of the library is written to a place where an editor can show it, and is still treated as
/// the library's.
#[test]
fn a_name_of_the_library_leads_to_the_library_file() {
    let folder = empty();
    let (rungd, plant) = ("rungd.toml", "plant.toml");
    let text = "ladder = [\"lib:pid\", \"plant.toml\"]\n";
    std::fs::write(folder.path().join(rungd), text).unwrap();
    let ladder = "[[program]]\nname = \"Main\"\n\n[[program.rung]]\nuse = \"Pid\"\nname = \"p\"\n";
    std::fs::write(folder.path().join(plant), ladder).unwrap();
    let mut editor = Editor::new(folder.path());
    editor.open(rungd);
    editor.open(plant);
    assert_eq!(definition(&mut editor, rungd, "lib:pid", 2), "lib-pid.toml:0:0");
    let (line, column) = place_of(ladder, "Pid");
    let place = editor.ask_at("textDocument/definition", plant, line, column);
    let path = place["uri"].as_str().unwrap().strip_prefix("file://").unwrap().to_owned();
    let shown = std::fs::read_to_string(&path).unwrap();
    assert!(std::fs::metadata(&path).unwrap().permissions().readonly(), "{path}");
    assert_eq!(place["range"]["start"]["line"], place_of(&shown, "\"Pid\"").0);
    // The client joins names to its folder; this name is an absolute path, which replaces the
    // folder.
    editor.open_with(&path, &shown);
    let (line, column) = place_of(&shown, "\"Pid\"");
    let hover = editor.ask_at("textDocument/hover", &path, line, column + 1);
    assert!(hover["contents"]["value"].as_str().unwrap().contains("Pid"), "{hover}");
    let position = json!({ "line": line, "character": column + 1 });
    let document = json!({ "uri": editor.uri(&path) });
    let params = json!({ "textDocument": document, "position": position, "newName": "Other" });
    let refused = editor.respond("textDocument/rename", params).response_result.unwrap_err();
    assert!(refused.message.contains("belongs to the library"), "{refused:?}");
    editor.diagnostics(plant);
    let uri = editor.uri(&path);
    assert!(editor.all_diagnostics().get(&uri).is_none_or(Vec::is_empty));
}
