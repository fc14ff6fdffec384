//! `textDocument/formatting`: the layout of `rungd fmt`, as edits of the lines that differ.
//!
//! Called by `requests`; `format` makes the layout. An editor keeps its cursor in a line that no
//! edit touches, so the edits are kept small. Every pairing of old and new lines gives the correct
//! text; a bad pairing only gives larger edits. A text that is not TOML is not changed; its
//! findings give the reason.

use std::ops::Range;

use anyhow::Result;
use lsp_types::{DocumentFormattingParams, TextEdit};

use super::slots::FileKind;
use super::workspace::Workspace;
use rungd_language::format::formatted;

/// The maximum number of lines that are searched for the next line that both texts have. Because of
/// this limit, the time is linear in the length of the text.
const AHEAD_MAX: usize = 16;

/// The edits that bring a file into the layout; `None` for a file that does not belong to rungd.
pub(super) fn formatting(
    workspace: &mut Workspace,
    params: DocumentFormattingParams,
) -> Result<Option<Vec<TextEdit>>> {
    let Some(file) = workspace.file(&params.text_document.uri) else { return Ok(None) };
    if FileKind::is_of_others(&file.outline) {
        return Ok(None);
    }
    let Ok(after) = formatted(&file.text) else { return Ok(None) };
    let edits = line_edits(&file.text, &after).into_iter();
    let edit = |(place, text): (Range<usize>, &str)| TextEdit::new(file.place(place), text.into());
    Ok(Some(edits.map(edit).collect()))
}

/// The edits that turn `before` into `after`: bytes of `before`, and the lines that replace them.
fn line_edits<'t>(before: &str, after: &'t str) -> Vec<(Range<usize>, &'t str)> {
    let old: Vec<&str> = before.split_inclusive('\n').collect();
    let new: Vec<&str> = after.split_inclusive('\n').collect();
    let mut edits: Vec<(Range<usize>, Range<usize>)> = Vec::new();
    // The number of lines that were passed in each text, and the number of their bytes.
    let (mut at, mut bytes) = ((0, 0), (0, 0));
    while at.0 < old.len() || at.1 < new.len() {
        let (removed, added) = step(&old[at.0..], &new[at.1..]);
        let is_alike = removed == 1 && added == 1 && old[at.0] == new[at.1];
        let length = |lines: &[&str]| lines.iter().map(|line| line.len()).sum::<usize>();
        let from = bytes;
        bytes.0 += length(&old[at.0..at.0 + removed]);
        bytes.1 += length(&new[at.1..at.1 + added]);
        at = (at.0 + removed, at.1 + added);
        if is_alike {
            continue;
        }
        match edits.last_mut() {
            Some((old, new)) if old.end == from.0 && new.end == from.1 => {
                (old.end, new.end) = bytes;
            }
            Some(_) | None => edits.push((from.0..bytes.0, from.1..bytes.1)),
        }
    }
    edits.into_iter().map(|(old, new)| (old, &after[new])).collect()
}

/// How many lines of each text to pass: one of each if they are equal, else the lines before the
/// nearest equal lines, else one of each.
fn step(old: &[&str], new: &[&str]) -> (usize, usize) {
    if old.is_empty() || new.is_empty() {
        return (old.len(), new.len());
    }
    if old[0] == new[0] {
        return (1, 1);
    }
    for distance in 1..=AHEAD_MAX {
        for removed in 0..=distance {
            let added = distance - removed;
            let pair = old.get(removed).zip(new.get(added));
            // Equal blank lines do not show that the lines around them are equal, too.
            if pair.is_some_and(|(old, new)| old == new && !old.trim().is_empty()) {
                return without_end(&old[..removed], &new[..added]);
            }
        }
    }
    (1, 1)
}

/// How many lines of each text remain without the equal lines at the end.
fn without_end(old: &[&str], new: &[&str]) -> (usize, usize) {
    let alike = old.iter().rev().zip(new.iter().rev()).take_while(|(old, new)| old == new).count();
    (old.len() - alike, new.len() - alike)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied(before: &str, edits: &[(Range<usize>, &str)]) -> String {
        let mut text = before.to_owned();
        for (place, new) in edits.iter().rev() {
            text.replace_range(place.clone(), new);
        }
        text
    }

    #[test]
    fn edits_transform_one_text_into_the_other_and_keep_common_lines() {
        let cases = [
            ("a\nb\nc\n", "a\nb\nc\n", 0),
            ("a\nb\nc\n", "a\nB\nc\n", 1),
            ("a\nx\nb\n\n\nc\nd\n", "a\nb\n\nc\nD\n", 3),
            ("a\nb", "a\nb\n", 1),
            ("", "a\n", 1),
            ("a\n", "", 1),
            ("a\nb\nc\nd\n", "d\na\nb\nc\n", 2),
            ("\u{e4}\u{1F600}\r\nb\r\n", "\u{e4}\r\nb\r\n", 1),
        ];
        for (before, after, count) in cases {
            let edits = line_edits(before, after);
            assert_eq!(applied(before, &edits), after);
            assert_eq!(edits.len(), count, "{before:?} {after:?} {edits:?}");
        }
    }
}
