//! Random edits of a file: no typed, deleted or pasted text causes a panic, and the diagnostics at
//! the end are those of a newly started server.

use serde_json::{Value, json};

use crate::editor::client::Editor;
use crate::editor::project::empty;

/// The numbers of a fixed sequence (SplitMix64).
struct Numbers(u64);

/// Edits, drawn.
trait DrawnEdit: Sized {
    fn below(&mut self, limit: usize) -> usize;
}

impl DrawnEdit for Numbers {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % limit.max(1) as u64) as usize
    }
}

/// Texts that people type.
const TYPED: [&str; 26] = [
    "a",
    "X",
    "0",
    "\"",
    "[",
    "]",
    "{",
    "}",
    "=",
    ".",
    ",",
    " ",
    "\n",
    "#",
    "&",
    "|",
    "!",
    "(",
    ")",
    "\u{e4}",
    "\u{1F600}",
    "\r\n",
    "when = [\"X0\"]\n",
    "[[program.rung]]\n",
    "do = [\"OUT Y",
    "'",
];

/// The requests that are sent between edits.
const ASKED: [&str; 11] = [
    "textDocument/formatting",
    "textDocument/completion",
    "textDocument/hover",
    "textDocument/definition",
    "textDocument/references",
    "textDocument/documentSymbol",
    "textDocument/foldingRange",
    "textDocument/documentHighlight",
    "textDocument/prepareRename",
    "textDocument/codeLens",
    "textDocument/semanticTokens/full",
];

/// The position of a byte, in UTF-16 units.
fn position(text: &str, offset: usize) -> Value {
    let before = &text[..offset];
    let start = before.rfind('\n').map_or(0, |at| at + 1);
    json!({
        "line": before.matches('\n').count(),
        "character": before[start..].encode_utf16().count(),
    })
}

/// The nearest place at or before a byte that an editor can name. A place between `\r` and `\n` is
/// none.
fn boundary(text: &str, mut at: usize) -> usize {
    while !text.is_char_boundary(at)
        || (at > 0 && &text.as_bytes()[at - 1..=at.min(text.len() - 1)] == b"\r\n")
    {
        at -= 1;
    }
    at
}

/// One random edit: the change for the server, and the text afterwards.
fn edit(numbers: &mut Numbers, text: &str, original: &str) -> (Value, String) {
    let start = boundary(text, numbers.below(text.len() + 1));
    let (end, new) = match numbers.below(10) {
        0..=4 => (start, TYPED[numbers.below(TYPED.len())].to_owned()),
        5..=6 => (start + numbers.below(3), String::new()),
        7 => (start + numbers.below(60), String::new()),
        // Repairs: inserts a part of the original text.
        8 => {
            let from = boundary(original, numbers.below(original.len() + 1));
            let to = boundary(original, (from + numbers.below(200)).min(original.len()));
            (start, original[from..to].to_owned())
        }
        _ => (text.len(), String::new()),
    };
    let end = boundary(text, end.min(text.len())).max(start);
    if end == text.len() && new.is_empty() && numbers.below(20) == 0 {
        let whole = json!([{ "text": original }]);
        return (whole, original.to_owned());
    }
    let end = if end == text.len() && new.is_empty() { start } else { end };
    let range = json!({ "start": position(text, start), "end": position(text, end) });
    let mut edited = text.to_owned();
    edited.replace_range(start..end, &new);
    (json!([{ "range": range, "text": new }]), edited)
}

/// Edits a file for a number of steps. Every 500 steps and at the end, compares the diagnostics
/// with those of a newly started server.
fn type_into(name: &str, original: &str, steps: usize, seed: u64) {
    let (folder, mut numbers) = (empty(), Numbers(seed));
    std::fs::write(folder.path().join(name), original).unwrap();
    let mut editor = Editor::new(folder.path());
    editor.open(name);
    let mut text = original.to_owned();
    for step in 1..=steps {
        let (change, edited) = edit(&mut numbers, &text, original);
        editor.edit(name, change);
        text = edited;
        if text.len() > 2 * original.len() + 4000 {
            editor.replace(name, original);
            original.clone_into(&mut text);
        }
        if step % 10 == 0 {
            let at = boundary(&text, numbers.below(text.len() + 1));
            let method = ASKED[numbers.below(ASKED.len())];
            let params = json!({
                "textDocument": { "uri": editor.uri(name) },
                "position": position(&text, at),
                "context": { "includeDeclaration": true, "diagnostics": [] },
                "options": { "tabSize": 4, "insertSpaces": true },
            });
            // The answer may be a refusal.
            let _ = editor.respond(method, params);
        }
        if step % 500 == 0 || step == steps {
            let shown = editor.diagnostics(name);
            let mut fresh = Editor::new(folder.path());
            fresh.open_with(name, &text);
            assert_eq!(shown, fresh.diagnostics(name), "{name}: step {step}, seed {seed}\n{text}");
        }
    }
}

/// 10,000 steps, divided among files of every kind; `RUNGD_TYPED` sets a different number.
#[test]
fn diagnostics_after_many_edits_equal_those_of_a_fresh_start() {
    let steps = std::env::var("RUNGD_TYPED").ok().and_then(|n| n.parse().ok()).unwrap_or(10_000);
    let config = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    let files = [
        "batch-mixer.toml",
        "traffic-light.toml",
        "lib/pid.toml",
        "rungd.toml",
        "tests/conveyor.test.toml",
    ];
    for (seed, name) in files.into_iter().enumerate() {
        let text = std::fs::read_to_string(config.join(name)).unwrap();
        let name = name.rsplit('/').next().unwrap();
        type_into(name, &text, steps / files.len(), seed as u64 + 1);
    }
}
