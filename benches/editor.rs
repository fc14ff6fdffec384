//! Measures the language server on a ladder of 10,000 rungs: the time from a keystroke to the
//! findings, the times for completion, hover and a rename, and the memory after many edits.
//!
//! ```console
//! cargo bench --bench editor
//! ```
//!
//! `RUNGD_EDITS` (2,000) is the number of keystrokes for the measurement of memory. An hour of
//! typing is about 20,000 keystrokes.

#![allow(clippy::wildcard_enum_match_arm)]

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use lsp_server::{Connection, Message, Notification, Request, RequestId};
use serde_json::{Value, json};

const RUNGS: usize = 10_000;
const TAGS: usize = 2_000;
const TIMES: usize = 25;

fn ladder() -> String {
    let mut text = "[ladder]\nname = \"large\"\n\n[tags]\n".to_owned();
    for tag in 0..TAGS {
        let _ = writeln!(text, "tag_{tag} = {{ type = \"bit\", doc = \"Number {tag}\" }}");
    }
    text.push_str("\n[[program]]\nname = \"Main\"\n");
    for rung in 0..RUNGS {
        let (a, b, c) = (rung % TAGS, (rung * 7 + 1) % TAGS, (rung * 13 + 2) % TAGS);
        let _ = writeln!(
            text,
            "\n[[program.rung]]\nwhen = [\"tag_{a}\", \"!tag_{b} | X{}\"]\ndo = [\"SET tag_{c}\", \"RST tag_{a}\"]",
            rung % 64
        );
    }
    text
}

/// A place in the text, as the protocol counts: lines and characters from 0.
#[derive(Clone, Copy)]
struct TextPlace {
    line: usize,
    character: usize,
}

struct Editor {
    connection: Connection,
    number: i32,
    version: i32,
    uri: String,
}

impl Editor {
    fn tell(&self, method: &str, params: Value) {
        let told = Notification { method: method.to_owned(), params };
        self.connection.sender.send(told.into()).expect("the server listens");
    }

    fn ask(&mut self, method: &str, params: Value) -> Value {
        self.number += 1;
        let id = RequestId::from(self.number);
        let request = Request { id: id.clone(), method: method.to_owned(), params };
        self.connection.sender.send(request.into()).expect("the server listens");
        loop {
            match self.connection.receiver.recv().expect("the server answers") {
                Message::Response(response) if response.id == id => {
                    return response.response_result.expect("an answer");
                }
                _ => {}
            }
        }
    }

    /// Types a character at a place, or deletes it.
    fn key(&mut self, TextPlace { line, character }: TextPlace, types: bool) {
        self.version += 1;
        let start = json!({ "line": line, "character": character });
        let end = json!({ "line": line, "character": character + usize::from(!types) });
        let text = if types { "x" } else { "" };
        let change = json!([{ "range": { "start": start, "end": end }, "text": text }]);
        let document = json!({ "uri": self.uri, "version": self.version });
        let params = json!({ "textDocument": document, "contentChanges": change });
        self.tell("textDocument/didChange", params);
    }

    /// Waits for the diagnostics of the present version.
    fn findings(&self) -> usize {
        loop {
            if let Message::Notification(told) = self.connection.receiver.recv().expect("findings")
                && told.method == "textDocument/publishDiagnostics"
                && told.params["version"] == json!(self.version)
            {
                return told.params["diagnostics"].as_array().map_or(0, Vec::len);
            }
        }
    }
}

fn median(mut times: Vec<Duration>) -> String {
    times.sort_unstable();
    let at = |share: usize| times[(times.len() - 1) * share / 100].as_secs_f64() * 1000.0;
    format!("median {:7.1} ms, 90 % within {:7.1} ms", at(50), at(90))
}

fn resident_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kb = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok());
    kb.unwrap_or(0) / 1024
}

fn main() {
    let folder = std::env::temp_dir().join(format!("rungd-bench-editor-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let (path, text) = (folder.join("large.toml"), ladder());
    std::fs::write(&path, &text).expect("a file");
    let (connection, server) = Connection::memory();
    std::thread::spawn(move || rungd_lsp::serve(&server));
    let uri = format!("file://{}", path.canonicalize().expect("a path").display());
    let mut editor = Editor { connection, number: 0, version: 1, uri };
    editor.ask("initialize", json!({ "capabilities": {} }));
    editor.tell("initialized", json!({}));
    let document = json!({ "uri": editor.uri, "languageId": "toml", "version": 1, "text": text });
    let began = Instant::now();
    editor.tell("textDocument/didOpen", json!({ "textDocument": document }));
    let found = editor.findings();
    println!("{RUNGS} rungs, {TAGS} tags, {} kB", text.len() / 1000);
    println!("opened: {found} findings after {:.0} ms", began.elapsed().as_secs_f64() * 1000.0);
    // The place is in the first contact of a rung in the middle of the text.
    let line = text[..text.len() / 2].matches('\n').count();
    let line = line + text.lines().skip(line).position(|line| line.starts_with("when")).unwrap();
    let place = TextPlace { line, character: 12 };
    let load = || {
        let began = Instant::now();
        let loaded =
            rungd_config::load::ladder_files(std::slice::from_ref(&path)).expect("it loads");
        drop(loaded);
        began.elapsed()
    };
    println!("`rungd check` without its process: {}", median((0..TIMES).map(|_| load()).collect()));
    measure_findings(&mut editor, place);
    for (name, method) in [
        ("completion", "textDocument/completion"),
        ("hover", "textDocument/hover"),
        ("references", "textDocument/references"),
        ("symbols", "textDocument/documentSymbol"),
        ("code actions", "textDocument/codeAction"),
        ("formatting", "textDocument/formatting"),
    ] {
        measure_request(&mut editor, name, method, place);
    }
    let edits = std::env::var("RUNGD_EDITS").ok().and_then(|n| n.parse().ok()).unwrap_or(2_000);
    let before = resident_mb();
    for edit in 0..edits {
        editor.key(place, edit % 2 == 0);
        if edit % 20 == 19 {
            editor.findings();
        }
        if edit % (edits / 10).max(1) == 0 {
            println!("memory: {} MB after {edit} more keystrokes", resident_mb());
        }
    }
    println!("memory: {before} MB, after {edits} more keystrokes {} MB", resident_mb());
    let _ = std::fs::remove_dir_all(&folder);
}

fn measure_findings(editor: &mut Editor, place: TextPlace) {
    let mut times = Vec::new();
    for time in 0..2 * TIMES {
        let began = Instant::now();
        editor.key(place, time % 2 == 0);
        editor.findings();
        times.push(began.elapsed());
    }
    println!("findings after a keystroke: {}", median(times));
}

/// Measures a request directly after a keystroke, as an editor sends it.
fn measure_request(editor: &mut Editor, name: &str, method: &str, place: TextPlace) {
    let mut times = Vec::new();
    for time in 0..2 * TIMES {
        let began = Instant::now();
        editor.key(place, time % 2 == 0);
        let position = json!({ "line": place.line, "character": place.character });
        let params = json!({
            "textDocument": { "uri": editor.uri },
            "position": position,
            "range": { "start": position, "end": position },
            "context": { "includeDeclaration": true, "diagnostics": [], "triggerKind": 1 },
            "options": { "tabSize": 4, "insertSpaces": true },
        });
        editor.number += 1;
        let id = RequestId::from(editor.number);
        let request = Request { id: id.clone(), method: method.to_owned(), params };
        editor.connection.sender.send(request.into()).expect("the server listens");
        let answered = loop {
            match editor.connection.receiver.recv().expect("an answer") {
                Message::Response(response) if response.id == id => {
                    break response.response_result.is_ok();
                }
                _ => {}
            }
        };
        times.push(began.elapsed());
        if !answered {
            println!("{name}: not answered");
            return;
        }
    }
    println!("{name}, directly behind a keystroke: {}", median(times));
}
