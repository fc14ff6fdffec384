//! Silences a warning with `allow`, in its rung or in its file.

use std::ops::Range;

use super::super::file::EditorFile;
use super::super::slots::FileKind;
use super::edit::{ProposedChanges, added, one};
use super::places::{end_of_table, object_at};

/// The actions that silence a warning, with their titles.
pub(super) fn proposed(
    file: &EditorFile,
    span: &Range<usize>,
    code: &str,
) -> Vec<(String, ProposedChanges)> {
    if file.kind != FileKind::Ladder {
        return Vec::new();
    }
    let mut all = Vec::new();
    let kinds =
        ["program.rung", "program.stage.rung", "task.rung", "subroutine.rung", "template.rung"];
    let inner = ["template.stage.rung"];
    let kinds = [kinds.as_slice(), inner.as_slice()].concat();
    if let Some(rung) = file.outline.enclosing(object_at(file, span), &kinds) {
        let place = file.outline.objects[rung].extent.clone();
        let change = extended(file, rung, &["allow"], code).unwrap_or_else(|| {
            // Neither the start of the rung's header nor its braces are in a table below the rung.
            let start = match file.text.as_bytes().get(place.start) {
                Some(b'{') => place.start..place.end,
                Some(_) | None => place.start..place.start,
            };
            vec![added_to(file, rung, start, code)]
        });
        all.push((format!("Allow `{code}` in this rung"), change));
    }
    all.push((format!("Allow `{code}` in this file"), in_file(file, code)));
    all
}

fn added_to(
    file: &EditorFile,
    rung: usize,
    place: Range<usize>,
    code: &str,
) -> super::edit::TextChange {
    let text = format!("allow = [\"{code}\"]");
    if !super::places::is_inline(file, rung) {
        let end = end_of_table(file, place.start);
        return one(end..end, format!("\n{text}"));
    }
    match super::places::end_in_braces(file, &place) {
        Some(end) => one(end..end, format!(", {text}")),
        None => added(file, &place, &text),
    }
}

/// Adds a name to an existing `allow`. `keys`: its keys in the object.
fn extended(
    file: &EditorFile,
    object: usize,
    keys: &[&str],
    code: &str,
) -> Option<ProposedChanges> {
    let pair = &file.outline.pairs[file.outline.pair(object, keys)?];
    let inner = file.slice(pair.value.clone()).strip_suffix(']')?.trim_end();
    let end = pair.value.start + inner.len();
    let comma = if inner.ends_with(['[', ',']) { "" } else { ", " };
    Some(vec![one(end..end, format!("{comma}\"{code}\""))])
}

fn in_file(file: &EditorFile, code: &str) -> ProposedChanges {
    if let Some(change) = extended(file, 0, &["ladder", "allow"], code) {
        return change;
    }
    let text = format!("allow = [\"{code}\"]");
    let headers = &file.outline.headers;
    match headers.iter().find(|header| header.path == "ladder") {
        Some(header) => {
            let end = end_of_table(file, header.span.start);
            vec![one(end..end, format!("\n{text}"))]
        }
        None => {
            let first = headers.first().map_or(file.text.len(), |header| header.span.start);
            let at = file.line(first).start;
            vec![one(at..at, format!("[ladder]\n{text}\n\n"))]
        }
    }
}
