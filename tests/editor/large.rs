//! Large and hostile texts: a text of eight times the size costs the server about eight times the
//! work. The measure is the processor time of the server's thread, in one run; the margin is wide.

use std::time::Duration;

use serde_json::{Value, json};

use crate::editor::client::Editor;
use crate::editor::large_texts::{FILES, HOSTILE, LINES, LargeText};
use crate::editor::project::folder;

/// The smaller size, and the factor from the smaller to the larger size.
const SIZE: usize = 400;
const TIMES: usize = 8;
/// The maximum ratio of the cost of the larger text to that of the smaller text. For work that
/// grows with the square of the size, the ratio is 64.
const RATIO_MAX: u32 = 28;

const REQUESTS: [&str; 12] = [
    "semanticTokens/full",
    "hover",
    "references",
    "documentHighlight",
    "documentSymbol",
    "foldingRange",
    "inlayHint",
    "codeLens",
    "completion",
    "formatting",
    "prepareRename",
    "codeAction",
];

/// The processor time for a change and for each request, at the cursor of a text.
fn costs(of: &LargeText, size: usize) -> Vec<(&'static str, Duration)> {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    let (text, cursor) = of.of_size(size);
    let name = of.file();
    editor.open_with(name, &text);
    editor.diagnostics(name);
    let line = text[..cursor].rfind('\n').map_or(0, |end| end + 1);
    let column = text[line..cursor].encode_utf16().count();
    let position = json!({ "line": text[..line].matches('\n').count(), "character": column });
    let range = json!({ "start": position, "end": position });
    let began = editor.server_time();
    editor.edit(name, json!([{ "range": range, "text": "" }]));
    editor.diagnostics(name);
    let mut all = vec![("a change", editor.server_time() - began)];
    for request in REQUESTS {
        let params = json!({
            "textDocument": { "uri": editor.uri(name) },
            "position": position,
            "range": range,
            "context": { "includeDeclaration": true, "diagnostics": [], "triggerKind": 1 },
            "options": { "tabSize": 4, "insertSpaces": true },
        });
        let began = editor.server_time();
        // A refusal is accepted: not every name can be renamed.
        let _ = editor.respond(&format!("textDocument/{request}"), params);
        all.push((request, editor.server_time() - began));
    }
    all
}

/// A cost so small that ratios of such costs mean nothing: the cost of a change in a small file.
fn little() -> Duration {
    costs(&FILES[0], SIZE)[0].1
}

fn assert_in_proportion(texts: &[LargeText]) {
    let little = little();
    let mut wrong = Vec::new();
    for text in texts {
        // A real excess occurs in each of three tries. A busy machine, whose caches other programs
        // empty, may cause it in one of them.
        let tries: Vec<_> = (0..3).map_while(|_| out_of_proportion(text, little)).collect();
        wrong.extend((tries.len() == 3).then(|| tries.join("\n")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The requests that cost too much, each with its cost for the smaller and for the larger text.
fn out_of_proportion(text: &LargeText, little: Duration) -> Option<String> {
    let pairs = costs(text, SIZE).into_iter().zip(costs(text, TIMES * SIZE));
    let wrong = pairs.filter(|((_, small), (_, large))| *large > *small * RATIO_MAX + little);
    let told = wrong.map(|((what, small), (_, large))| {
        format!("{}, {what}: {small:?}, {large:?}; little is {little:?}", text.name)
    });
    let told: Vec<String> = told.collect();
    (!told.is_empty()).then(|| told.join("\n"))
}

#[test]
fn the_cost_of_large_files_is_proportional_to_their_size() {
    assert_in_proportion(FILES);
}

#[test]
fn the_cost_of_long_lines_is_proportional_to_their_length() {
    assert_in_proportion(LINES);
}

#[test]
fn the_cost_of_hostile_texts_is_proportional_to_their_size() {
    assert_in_proportion(HOSTILE);
}

/// The cost of applying the edits of a formatting, all in one message, in reverse order.
fn cost_of_taking_edits(size: usize) -> Duration {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    let name = "large.toml";
    let rungs = "[[program.rung]]\nwhen = [ \"X0\" ]\ndo = [\"SET C0\"]\n".repeat(size);
    editor.open_with(name, &format!("[[program]]\nname = \"Main\"\n{rungs}"));
    let params = json!({
        "textDocument": { "uri": editor.uri(name) },
        "options": { "tabSize": 4, "insertSpaces": true },
    });
    let edits = editor.ask("textDocument/formatting", params.clone());
    let edits = edits.as_array().expect("edits");
    assert!(edits.len() >= size, "{} edits", edits.len());
    let change = |edit: &Value| json!({ "range": edit["range"], "text": edit["newText"] });
    let began = editor.server_time();
    editor.edit(name, edits.iter().rev().map(change).collect());
    assert_eq!(editor.ask("textDocument/formatting", params), json!([]));
    editor.server_time() - began
}

#[test]
fn the_cost_of_many_changes_in_a_message_is_proportional_to_their_number() {
    let (small, large) = (cost_of_taking_edits(SIZE), cost_of_taking_edits(TIMES * SIZE));
    assert!(large < small * RATIO_MAX + little(), "{small:?}, {large:?}");
}

/// The cost of a change in one of this number of open ladders of a controller file.
fn cost_among_open_files(ladders: usize) -> Duration {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    let names: Vec<String> = (0..ladders).map(|at| format!("l{at}.toml")).collect();
    let all: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
    let controller = format!("ladder = [{}]\n", all.join(", "));
    std::fs::write(folder.path().join("all.toml"), controller).expect("a file");
    for (at, name) in names.iter().enumerate() {
        let tags: String =
            (0..20).map(|tag| format!("t{at}_{tag} = {{ type = \"bit\" }}\n")).collect();
        editor.open_with(name, &format!("[tags]\n{tags}"));
    }
    // The diagnostics of the last file come when all files are open.
    editor.diagnostics(&names[ladders - 1]);
    let began = editor.server_time();
    let start = json!({ "line": 0, "character": 0 });
    editor.edit(&names[0], json!([{ "range": { "start": start, "end": start }, "text": "" }]));
    editor.diagnostics(&names[0]);
    editor.server_time() - began
}

#[test]
fn the_cost_of_many_open_files_is_proportional_to_their_number() {
    let (small, large) = (cost_among_open_files(10), cost_among_open_files(10 * TIMES));
    assert!(large < small * RATIO_MAX + little(), "{small:?}, {large:?}");
}
