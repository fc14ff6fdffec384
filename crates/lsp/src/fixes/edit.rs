//! Changes of a text, and the functions from which all proposals are built: find the pair with a
//! key, add a pair to a table, add a declaration, find an element with its comma.
//!
//! `change`, `tables` and `silence` use them; `verify` tries the proposals. Nothing here depends on
//! a fix.

use std::ops::Range;

use super::super::file::EditorFile;
use super::super::outline::KeyPair;
use super::super::outline_reader::read;
use super::places::{end_in_braces, end_of_table, is_inline, lines, object_at};

/// A part of a text, and its replacement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct TextChange {
    pub range: Range<usize>,
    pub text: String,
}

/// The changes of one proposal; they do not overlap.
pub(super) type ProposedChanges = Vec<TextChange>;

pub(super) fn one(range: Range<usize>, text: impl Into<String>) -> TextChange {
    TextChange { range, text: text.into() }
}

/// The keys of a text that consists of one pair.
pub(super) fn as_pair(text: &str) -> Option<Vec<String>> {
    let outline = read(text);
    let pair = outline.pairs.first().filter(|pair| {
        pair.object == 0 && !pair.value.is_empty() && text[pair.value.end..].trim().is_empty()
    })?;
    let is_spaced = text.contains(" = ") || text.contains(" =") || text.contains("= ");
    is_spaced.then(|| pair.keys.iter().map(|key| key.text.clone()).collect())
}

/// The pair of an object with these keys, after the outer keys of the pair `beside`.
pub(super) fn same_key<'f>(
    file: &'f EditorFile,
    object: usize,
    beside: Option<&KeyPair>,
    keys: &[String],
) -> Option<&'f KeyPair> {
    let pair_keys = |pair: &KeyPair, count: usize| -> Vec<String> {
        pair.keys[..count].iter().map(|key| key.text.clone()).collect()
    };
    let outer = beside.map_or(Vec::new(), |pair| pair_keys(pair, pair.outer));
    let pairs = file.outline.pairs_of[object].iter().map(|pair| &file.outline.pairs[*pair]);
    let mut same = pairs.filter(|pair| {
        let all = pair_keys(pair, pair.keys.len());
        all == [outer.as_slice(), keys].concat()
    });
    same.next()
}

/// Adds a pair to the table that contains a place.
pub(super) fn added(file: &EditorFile, span: &Range<usize>, text: &str) -> TextChange {
    let object = object_at(file, span);
    let braces = file.outline.objects[object].extent.clone();
    if is_inline(file, object)
        && let Some(end) = end_in_braces(file, &braces)
    {
        let comma = if end > braces.start + 1 { ", " } else { " " };
        return one(end..end, format!("{comma}{text}"));
    }
    let end = end_of_table(file, span.start);
    match end {
        0 => one(0..0, format!("{text}\n")),
        end => one(end..end, format!("\n{text}")),
    }
}

/// Adds a declaration at the end of `[tags]`.
pub(super) fn declared(file: &EditorFile, text: &str) -> ProposedChanges {
    let headers = &file.outline.headers;
    if let Some(tags) = headers.iter().find(|header| header.path == "tags") {
        let end = end_of_table(file, tags.span.start);
        return vec![one(end..end, format!("\n{text}"))];
    }
    let first = headers.iter().find(|header| header.is_array);
    let at = first.map_or(file.text.len(), |header| file.line(header.span.start).start);
    vec![one(at..at, format!("[tags]\n{text}\n\n"))]
}

/// An element with the comma after it, else with the comma before it.
pub(super) fn with_comma(file: &EditorFile, span: &Range<usize>) -> Range<usize> {
    let behind = &file.text[span.end..];
    let spaces = behind.len() - behind.trim_start_matches([' ', '\t']).len();
    if behind[spaces..].starts_with(',') {
        let rest = &behind[spaces + 1..];
        let more = rest.len() - rest.trim_start_matches([' ', '\t']).len();
        return span.start..span.end + spaces + 1 + more;
    }
    let before = file.text[..span.start].trim_end();
    match before.strip_suffix(',') {
        Some(before) => before.len()..span.end,
        None => span.clone(),
    }
}

/// Deletes a pair; deletes its whole line, if nothing is before the pair on that line.
pub(super) fn without_pair(file: &EditorFile, pair: &KeyPair) -> TextChange {
    let extent = pair.extent();
    let line = file.line(extent.start);
    let is_own = file.slice(line.start..extent.start).trim().is_empty();
    match is_own {
        true => one(lines(file, &extent), ""),
        false => one(with_comma(file, &extent), ""),
    }
}
