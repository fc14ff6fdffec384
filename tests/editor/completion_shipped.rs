//! Completion in the shipped files: every place has an answer. If a name is cut to its first
//! letter, the name is among the items offered there.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::editor::client::Editor;

/// One word in this many is cut, over all files. It is a prime, so that all kinds of words take
/// part.
const WORD_STEP: usize = 31;
/// Completion is requested at one byte in this many, in each file.
const BYTE_STEP: usize = 997;

/// The shipped files, in order.
fn shipped() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    let mut files = Vec::new();
    let mut folders = vec![root];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|of| of == "toml") {
                files.push(path);
            }
        }
    }
    files.sort();
    assert!(files.len() > 50);
    files
}

fn ask(editor: &mut Editor, name: &str, before: &str) -> Value {
    let line = before.matches('\n').count();
    let column = before.rsplit('\n').next().unwrap_or_default().encode_utf16().count();
    let document = json!({ "uri": editor.uri(name) });
    let position = json!({ "line": line, "character": column });
    let params = json!({ "textDocument": document, "position": position });
    editor.ask("textDocument/completion", params)
}

/// A string of a text whose words are names.
struct NamesString {
    key: String,
    /// The bytes between its quotes.
    inner: Range<usize>,
}

/// The strings of a text whose words are names.
fn strings(text: &str) -> Vec<NamesString> {
    let mut found = Vec::new();
    let (mut key, mut at) = (String::new(), 0);
    for line in text.split_inclusive('\n') {
        let code = line.split(" #").next().unwrap_or_default();
        let name = code.split('=').next().unwrap_or_default().trim();
        let is_key = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
        if code.contains('=') && !name.is_empty() && name.chars().all(is_key) {
            key = name.to_owned();
        }
        if !code.starts_with('#') {
            let mut quotes = code.match_indices('"').map(|(quote, _)| at + quote);
            while let (Some(open), Some(close)) = (quotes.next(), quotes.next()) {
                found.push(NamesString { key: key.clone(), inner: open + 1..close });
            }
        }
        at += line.len();
    }
    found
}

/// The words in a string that are names: (first byte, byte after the last).
fn words(text: &str, NamesString { key, inner }: &NamesString) -> Vec<(usize, usize)> {
    let whole = &text[inner.clone()];
    let is_names = matches!(key.as_str(), "when" | "do" | "always" | "use")
        || key.starts_with("leg.")
        || (key == "with" && !whole.contains(' '));
    let is_step = key == "steps" && whole.starts_with("expect:");
    if !(is_names || is_step) {
        return Vec::new();
    }
    let (mut found, mut at, end) = (Vec::new(), inner.start, inner.end);
    while at < end {
        let is_part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '$');
        let length = text[at..end].find(|c| !is_part(c)).unwrap_or(end - at);
        let word = &text[at..at + length];
        let begins = word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '$');
        let bytes = (text.as_bytes()[at - 1], text.as_bytes()[at + length]);
        // A part of a block name with hyphens is not a word here.
        let is_whole = bytes.0 != b'-' && bytes.1 != b'-';
        if length > 1 && begins && is_whole && !is_address(word) {
            found.push((at, at + length));
        }
        at += length.max(1);
    }
    found
}

/// Whether a word is an address. Addresses are not cut: the cut place may be the only one with that
/// address, and then it is not offered.
fn is_address(word: &str) -> bool {
    let digits = word.trim_start_matches(|c: char| c.is_ascii_uppercase());
    digits.len() < word.len() && !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
}

/// Whether a word is a member, as `now` of `t.now`, whose whole name stands in the file once: of a
/// template of the library, whose file the ladder does not name by itself. Each ladder is opened
/// alone here.
fn is_of_library(text: &str, start: usize, end: usize) -> bool {
    let is_of_name = |c: char| c == '.' || c == '_' || c.is_ascii_alphanumeric();
    let before = text[..start].trim_end_matches(is_of_name).len();
    text[..start].ends_with('.') && text.matches(&text[before..end]).count() == 1
}

#[test]
fn existing_names_are_offered_after_their_first_letter() {
    let (mut number, mut tried, mut absent) = (0, 0, Vec::new());
    let mut editor = Editor::new(&Path::new(env!("CARGO_MANIFEST_DIR")).join("config"));
    for path in shipped() {
        let name = path.to_string_lossy().into_owned();
        let text = fs::read_to_string(&path).expect("a file");
        let words: Vec<_> = strings(&text).iter().flat_map(|of| words(&text, of)).collect();
        editor.open_with(&name, &text);
        for (start, end) in words {
            number += 1;
            if number % WORD_STEP != 0 {
                continue;
            }
            if is_of_library(&text, start, end) {
                continue;
            }
            tried += 1;
            editor.replace(&name, &format!("{}{}", &text[..start + 1], &text[end..]));
            let answer = ask(&mut editor, &name, &text[..start + 1]);
            let word = &text[start..end];
            let items = answer["items"].as_array().cloned().unwrap_or_default();
            let keyed = format!("{word}=");
            if !items.iter().any(|item| item["label"] == word || item["label"] == keyed) {
                let line = text[..start].matches('\n').count() + 1;
                absent.push(format!("{name}:{line}: {word}"));
            }
        }
        editor.close(&name);
    }
    assert!(tried > 50, "{tried} words");
    assert!(absent.is_empty(), "{} of {tried}:\n{}", absent.len(), absent.join("\n"));
}

#[test]
fn completion_answers_at_every_place_of_the_shipped_files() {
    let mut editor = Editor::new(&Path::new(env!("CARGO_MANIFEST_DIR")).join("config"));
    for path in shipped() {
        let name = path.to_string_lossy().into_owned();
        let text = fs::read_to_string(&path).expect("a file");
        editor.open_with(&name, &text);
        for at in (0..text.len()).step_by(BYTE_STEP).filter(|at| text.is_char_boundary(*at)) {
            ask(&mut editor, &name, &text[..at]);
            // The same place as the end of the text.
            editor.replace(&name, &text[..at]);
            ask(&mut editor, &name, &text[..at]);
            editor.replace(&name, &text);
        }
        editor.close(&name);
    }
}
