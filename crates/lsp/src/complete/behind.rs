//! The text after the cursor: what an item replaces, and what must not follow an item directly.
//!
//! `complete` uses it at keys and at values without a quote, where an item and the text after it
//! could together be invalid TOML. In a string an item is a word, and `scene` finds the end of that
//! word.

use super::scene::CompletionScene;
use crate::slots::{KeySlot, of_next_key};

/// How an item ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ItemEnd {
    /// The end of the text that it replaces.
    pub end: usize,
    /// Whether a comma must follow it.
    pub comma: bool,
}

/// The end of a header; `None` if the cursor is before the header.
pub(super) fn header(scene: &CompletionScene, start: usize) -> Option<ItemEnd> {
    let mut headers = scene.file.outline.headers.iter();
    let end =
        headers.find(|header| header.span.start == start).map_or(start, |header| header.span.end);
    (start < scene.offset).then_some(ItemEnd { end: end.max(scene.offset), comma: false })
}

/// The end of a value without a quote; `None` if no value can be written there.
pub(super) fn value(scene: &CompletionScene, start: usize) -> Option<ItemEnd> {
    let at = scene.offset;
    let word = if start < at { word(scene.file.slice(at..scene.file.line(at).end)) } else { 0 };
    match scene.site.in_array {
        true => Some(ItemEnd { end: at + word, comma: is_element(scene, at + word) }),
        false => {
            let line = scene.file.slice(at + word..scene.file.line(at).end);
            let rest = line.trim_start();
            let end = at + word + (line.len() - rest.len());
            let end = match rest.chars().next() {
                None | Some('#' | ',' | '}' | ']') => at + word,
                Some(quote @ ('"' | '\'')) => end + string(rest, quote)?,
                Some('[' | '{') => return None,
                Some(_) => end + self::word(rest),
            };
            Some(ItemEnd { end, comma: false })
        }
    }
}

/// The end of a key; `None` if no key can be written there. `typed`: the typed part of the key.
pub(super) fn key(scene: &CompletionScene, typed: &str) -> Option<ItemEnd> {
    let end = scene.offset + scene.tail("_-");
    let line = scene.file.line(scene.offset);
    let rest = scene.file.slice(end..line.end).trim_start();
    let before = scene.file.slice(line.start..scene.offset - typed.len()).trim_end();
    if rest.is_empty() || rest.starts_with(['=', '.', '#', '}', ',', ']']) {
        return Some(ItemEnd { end, comma: false });
    }
    // A pair follows. In braces a comma can separate the two pairs; on a line nothing can.
    let is_in_braces = before.ends_with(['{', ',']);
    let slot = of_next_key(scene.file.kind, &scene.site.kind, &scene.keys());
    // For an operand only the name is offered, and the name needs its value before a comma.
    (is_in_braces && slot != KeySlot::Operand).then_some(ItemEnd { end: scene.offset, comma: true })
}

/// Whether an element of the array follows a byte, with no comma between them.
fn is_element(scene: &CompletionScene, at: usize) -> bool {
    let mut is_same_line = true;
    for line in scene.file.text[at..].lines() {
        let rest = line.trim_start();
        match rest.chars().next() {
            None | Some('#') => is_same_line = false,
            Some(',' | ']' | '}' | '=') => return false,
            Some(_) if is_same_line => return true,
            Some('"' | '\'' | '{') => return !rest.contains(" = ") || rest.starts_with('{'),
            Some(first) => return first.is_ascii_digit() || first == '-',
        }
    }
    false
}

/// The length of a string, with its quotes; `None` if its line does not close it.
fn string(text: &str, quote: char) -> Option<usize> {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        if c == quote && !escaped {
            let triple: String = [quote; 3].iter().collect();
            return (!text.starts_with(&triple)).then_some(at + 1);
        }
        escaped = c == '\\' && quote == '"' && !escaped;
    }
    None
}

/// The length of a word of a value.
fn word(text: &str) -> usize {
    let ends = |c: char| c.is_whitespace() || matches!(c, ',' | ']' | '}' | '#' | '"' | '\'');
    text.find(ends).unwrap_or(text.len())
}
