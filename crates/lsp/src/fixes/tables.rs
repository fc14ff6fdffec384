//! Changes outside of the finding's table: a row of a map, a pair under a header, a new table, a
//! declaration, a rung before the rung of the finding.
//!
//! Called by `change`.

use std::ops::Range;

use super::super::file::EditorFile;
use super::super::outline::KeyPair;
use super::edit::{ProposedChanges, TextChange, as_pair, one, same_key, without_pair};
use super::places::{end_of_table, is_inline, lines, object_at, pair_at};
use rungd_language::source::name_reader::{ExpressionUse, TextWordKind, words_in};

/// The kinds of tables that are rungs.
const RUNGS: [&str; 6] = [
    "program.rung",
    "program.stage.rung",
    "task.rung",
    "subroutine.rung",
    "template.rung",
    "template.stage.rung",
];

/// The proposals that add a row to a map. The map of the device at the place comes first.
pub(super) fn row(file: &EditorFile, span: &Range<usize>, row: &str) -> Vec<ProposedChanges> {
    let is_map = |pair: &&KeyPair| pair.keys.len() == 1 && pair.key().text == "map";
    let mut maps: Vec<&KeyPair> = file.outline.pairs.iter().filter(is_map).collect();
    let extent = |pair: &KeyPair| &file.outline.objects[pair.object].extent;
    maps.sort_by_key(|pair| !extent(pair).contains(&span.start));
    maps.into_iter().filter_map(|pair| Some(vec![element(file, pair, row)?])).collect()
}

/// Adds an element to the array of a pair.
fn element(file: &EditorFile, pair: &KeyPair, text: &str) -> Option<TextChange> {
    let inner = file.slice(pair.value.clone()).strip_suffix(']')?.trim_end();
    let end = pair.value.start + inner.len();
    let comma = if inner.ends_with(['[', ',']) { "" } else { "," };
    if !inner.contains('\n') {
        let space = if inner.ends_with('[') { "" } else { " " };
        return Some(one(end..end, format!("{comma}{space}{text}")));
    }
    let line = file.slice(file.line(end));
    let indent = &line[..line.len() - line.trim_start().len()];
    Some(one(end..end, format!("{comma}\n{indent}{text},")))
}

/// The proposals that add a pair under a header: first only that, then also with the pair at the
/// place deleted.
pub(super) fn under(
    file: &EditorFile,
    span: &Range<usize>,
    table: &str,
    text: &str,
) -> Vec<ProposedChanges> {
    let Some(new) = new_pair(file, table, text) else { return Vec::new() };
    let moved = pair_at(file, span).map(|pair| vec![new.clone(), without_pair(file, pair)]);
    std::iter::once(vec![new]).chain(moved).collect()
}

fn new_pair(file: &EditorFile, table: &str, text: &str) -> Option<TextChange> {
    let headers = &file.outline.headers;
    let Some(header) = headers.iter().find(|header| header.path == table) else {
        let end = file.text.trim_end().len();
        return Some(one(end..end, format!("\n\n[{table}]\n{text}")));
    };
    let names: Vec<String> = table.split('.').map(str::to_owned).collect();
    let keys = [names, as_pair(text)?].concat();
    match same_key(file, 0, None, &keys) {
        Some(same) => {
            let (_, value) = text.split_once('=')?;
            let added = value.trim().strip_prefix('[')?.strip_suffix(']')?;
            element(file, same, added)
        }
        None => {
            let end = end_of_table(file, header.span.start);
            Some(one(end..end, format!("\n{text}")))
        }
    }
}

/// Adds a table at the end of the table that it belongs to, or at the end of the file.
pub(super) fn table(
    file: &EditorFile,
    span: &Range<usize>,
    header: &str,
    line: &str,
) -> Vec<ProposedChanges> {
    let path = header.trim_matches(['[', ']']);
    let outer = path.rsplit_once('.').map(|(outer, _)| outer);
    let around = outer.and_then(|outer| file.outline.enclosing(object_at(file, span), &[outer]));
    let end = around.map_or(file.text.len(), |object| file.outline.objects[object].extent.end);
    let end = file.line(file.text[..end].trim_end().len()).end;
    vec![vec![one(end..end, format!("\n\n{header}\n{line}"))]]
}

/// Deletes a key in the table of a place, or a table with this header.
pub(super) fn removed(file: &EditorFile, span: &Range<usize>, key: &str) -> Vec<ProposedChanges> {
    if key.starts_with('[') {
        let path = key.trim_matches(['[', ']']);
        let headers = file.outline.headers.iter().filter(|header| header.path == path);
        let table = |at: usize| lines(file, &(at..end_of_table(file, at)));
        return headers.map(|header| vec![one(table(header.span.start), "")]).collect();
    }
    let keys = [key.to_owned()];
    let object = object_at(file, span);
    let same = same_key(file, object, pair_at(file, span), &keys);
    let same = same.or_else(|| same_key(file, object, None, &keys));
    same.map(|pair| vec![without_pair(file, pair)]).into_iter().collect()
}

/// Adds an element to the array of a key of the table at a place.
pub(super) fn in_list(
    file: &EditorFile,
    span: &Range<usize>,
    key: &str,
    text: &str,
) -> Option<TextChange> {
    let object = object_at(file, span);
    element(file, same_key(file, object, None, &[key.to_owned()])?, text)
}

/// Replaces a word in the string at a place.
pub(super) fn word(
    file: &EditorFile,
    span: &Range<usize>,
    old: &str,
    new: &str,
) -> Option<TextChange> {
    let string = &file.outline.value_at(span).filter(|value| value.is_string)?.inner;
    let words = words_in(file.slice(string.clone()), ExpressionUse::Contact).into_iter();
    let words = words.filter(|word| word.kind != TextWordKind::Number).map(|word| word.place);
    let place = |word: Range<usize>| string.start + word.start..string.start + word.end;
    words.map(place).find(|at| file.slice(at.clone()) == old).map(|at| one(at, new))
}

/// Adds an instruction in a rung before the rung of a place.
pub(super) fn rung_before(
    file: &EditorFile,
    span: &Range<usize>,
    instruction: &str,
) -> Option<TextChange> {
    let rung = file.outline.enclosing(object_at(file, span), &RUNGS)?;
    let object = &file.outline.objects[rung];
    let start = object.extent.start;
    if instruction.contains(['"', '\\']) {
        return None;
    }
    if is_inline(file, rung) {
        let text = format!("{{ when = [\"$On\"], do = [\"{instruction}\"] }}, ");
        return Some(one(start..start, text));
    }
    let start = file.line(start).start;
    let text = format!("[[{}]]\nwhen = [\"$On\"]\ndo   = [\"{instruction}\"]\n\n", object.kind);
    Some(one(start..start, text))
}
