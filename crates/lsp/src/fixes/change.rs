//! The changes of a text that a fix can mean, the most likely first, and the title of its action.
//! `verify` decides which are offered.

use std::ops::Range;

use super::super::file::EditorFile;
use super::super::outline::{KeyPair, TableHeader};
use super::edit::{
    ProposedChanges, added, as_pair, declared, one, same_key, with_comma, without_pair,
};
use super::places::{end_in_braces, is_inline, lines, object_at, pair_at, word_around};
use super::tables;
use rungd_language::source::fix::{Fix, FixEdit};

/// The maximum number of proposals for a fix.
const PROPOSALS_MAX: usize = 8;

/// The changes that a fix of a finding at a place can mean.
pub(super) fn proposed(file: &EditorFile, span: &Range<usize>, fix: &Fix) -> Vec<ProposedChanges> {
    let mut all: Vec<ProposedChanges> = vec![Vec::new()];
    for edit in &fix.edits {
        let parts = edited(file, span, edit);
        let with = |whole: &ProposedChanges| {
            parts.iter().map(|part| [whole.as_slice(), part].concat()).collect::<Vec<_>>()
        };
        all = all.iter().flat_map(with).collect();
    }
    let mut known: Vec<ProposedChanges> = Vec::new();
    all.retain(|proposal| {
        let is_new = !known.contains(proposal) && is_change(file, proposal);
        known.push(proposal.clone());
        is_new
    });
    all.truncate(PROPOSALS_MAX);
    all
}

/// The change of a fix exactly at its place: a text, or the pair there with the same key. Nothing
/// around the place is replaced.
pub(super) fn exact(file: &EditorFile, span: &Range<usize>, fix: &Fix) -> Option<ProposedChanges> {
    let change = match &fix.edits[..] {
        [FixEdit::Write(None, text)] => one(span.clone(), text),
        [FixEdit::Write(Some(place), text)] => one(place.start as usize..place.end as usize, text),
        [FixEdit::Pair(text)] => {
            let at = pair_at(file, span)?;
            let keys: Vec<String> =
                at.keys[at.outer..].iter().map(|key| key.text.clone()).collect();
            (keys == as_pair(text)?).then(|| one(at.extent(), text))?
        }
        _ => return None,
    };
    Some(vec![change]).filter(|changes| is_change(file, changes))
}

fn is_change(file: &EditorFile, proposal: &ProposedChanges) -> bool {
    proposal.iter().any(|change| file.slice(change.range.clone()) != change.text)
}

/// The changes that a part of a fix can mean.
fn edited(file: &EditorFile, span: &Range<usize>, edit: &FixEdit) -> Vec<ProposedChanges> {
    let only = |change| Vec::from_iter(change).into_iter().map(|change| vec![change]).collect();
    match edit {
        FixEdit::Write(Some(place), text) => {
            written(file, &(place.start as usize..place.end as usize), text)
        }
        FixEdit::Write(None, text) => written(file, span, text),
        FixEdit::Pair(text) => match as_pair(text) {
            Some(keys) => as_key(file, span, &keys, text),
            None => Vec::new(),
        },
        FixEdit::InTag { tag, pair } => into_tag(file, tag, pair),
        FixEdit::InField { record, field, pair } => into_field(file, [record, field], pair),
        FixEdit::Word { old, new } => only(tables::word(file, span, old, new)),
        FixEdit::Declare(text) => vec![declared(file, text)],
        FixEdit::Lines { lines, instead } => {
            let lines: Vec<String> = lines.lines().map(|line| line.trim().to_owned()).collect();
            of_lines(file, span, &lines, *instead)
        }
        FixEdit::Delete => deleted(file, span),
        FixEdit::Omit => omitted(file, span),
        FixEdit::DeleteRow => without_table(file, span),
        FixEdit::Row(row) => tables::row(file, span, row),
        FixEdit::Element { key, element } => only(tables::in_list(file, span, key, element)),
        FixEdit::Under { table, pair } => tables::under(file, span, table, pair),
        FixEdit::Table { header, line } => tables::table(file, span, header, line),
        FixEdit::Remove(key) => tables::removed(file, span, key),
        FixEdit::Before(instruction) => only(tables::rung_before(file, span, instruction)),
    }
}

/// The title of the action of a fix; `changed`: the place that it changes.
pub(super) fn title(file: &EditorFile, fix: &Fix, changed: Range<usize>) -> String {
    if let ([FixEdit::Declare(tag), ..], Some(last)) = (&fix.edits[..], fix.edits.get(1..)) {
        return match last.last() {
            Some(edit) => format!("Declare `{tag}` and write `{}`", edit.text()),
            None => format!("Declare `{tag}` under [tags]"),
        };
    }
    match fix.edits.last() {
        Some(FixEdit::Delete | FixEdit::Omit | FixEdit::DeleteRow) | None => {
            let text = file.slice(changed).trim().lines().next().unwrap_or_default();
            format!("Delete `{}`", text.chars().take(40).collect::<String>())
        }
        Some(FixEdit::Write(_, text)) if text.is_empty() => {
            format!("Take `{}` away", file.slice(changed))
        }
        Some(FixEdit::InTag { tag, pair }) => format!("Write `{pair}` in tag `{tag}`"),
        Some(FixEdit::InField { record, field, pair }) => {
            format!("Write `{pair}` in field `{field}` of record `{record}`")
        }
        Some(FixEdit::Lines { lines, .. }) => format!("Write `{}`", lines.replace('\n', "`, `")),
        Some(FixEdit::Row(row)) => format!("Add the row `{row}`"),
        Some(FixEdit::Under { table, pair }) => format!("Write `{pair}` under `[{table}]`"),
        Some(FixEdit::Table { header, line }) => format!("Add `{header}` with `{line}`"),
        Some(FixEdit::Remove(key)) => format!("Take `{key}` away"),
        Some(FixEdit::Element { key, element }) => format!("Add `{element}` to `{key}`"),
        Some(edit) => format!("Write `{}`", edit.text().trim_start()),
    }
}

/// The changes that write a text at a place: exactly there, in the whole value or word around it,
/// or in the whole header.
fn written(file: &EditorFile, span: &Range<usize>, text: &str) -> Vec<ProposedChanges> {
    let mut places = vec![span.clone()];
    let value = file.outline.value_at(span);
    let string = value.filter(|value| value.is_string).map(|value| &value.inner);
    if let Some(value) = value.filter(|_| text.starts_with(['"', '['])) {
        places.insert(0, value.span.clone());
    }
    match string {
        Some(_) if text.contains(['"', '\\', '\n']) => places.truncate(places.len() - 1),
        Some(inner) => {
            let is_inner = inner.start <= span.start && span.end <= inner.end;
            places.extend(is_inner.then(|| word_around(file, inner, span)));
            // The contacts of a step, the expression of a MATH.
            for sign in [": ", " = "] {
                let at = file.slice(inner.clone()).find(sign);
                places.extend(at.map(|at| inner.start + at + sign.len()..inner.end));
            }
            places.push(inner.clone());
        }
        None => {
            let pair = pair_at(file, span).filter(|pair| !pair.value.is_empty());
            places.extend(pair.map(|pair| pair.value.clone()));
            places.extend(file.outline.header_at(span.start).map(|header| header.span.clone()));
        }
    }
    places.into_iter().map(|place| vec![one(place, text)]).collect()
}

/// The proposals that write a pair with these keys: replace the pair with the same keys, replace
/// the pair at the place, or add the pair.
fn as_key(
    file: &EditorFile,
    span: &Range<usize>,
    keys: &[String],
    text: &str,
) -> Vec<ProposedChanges> {
    let mut all = Vec::new();
    let at = pair_at(file, span);
    let object = object_at(file, span);
    if let Some(same) = same_key(file, object, at, keys) {
        all.extend(into_braces(file, same, text));
        all.push(vec![one(same.extent(), text)]);
    }
    if let Some(at) = at {
        all.push(vec![one(at.extent(), text)]);
        let braces = at.value.clone();
        if let Some(end) = end_in_braces(file, &braces).filter(|end| *end > braces.start + 1) {
            all.push(vec![one(end..end, format!(", {text}"))]);
        }
    }
    all.push(vec![added(file, span, text)]);
    all
}

/// Adds the pairs of an inline table to the inline table that is there.
fn into_braces(file: &EditorFile, same: &KeyPair, text: &str) -> Option<ProposedChanges> {
    let (_, inner) = text.split_once('{')?;
    let inner = inner.strip_suffix('}')?.trim();
    let end = end_in_braces(file, &same.value)?;
    let comma = if end > same.value.start + 1 { "," } else { "" };
    Some(vec![one(end..end, format!("{comma} {inner}"))])
}

/// Adds a key to a tag.
fn into_tag(file: &EditorFile, tag: &str, text: &str) -> Vec<ProposedChanges> {
    let declares = |pair: &&KeyPair| {
        pair.keys.len() == 2 && pair.keys[0].text == "tags" && pair.keys[1].text == tag
    };
    at_end_of(file, file.outline.pairs.iter().find(declares), text)
}

/// The changes that add a pair to the declaration of a field; `names`: those of the record and of
/// the field.
fn into_field(file: &EditorFile, names: [&str; 2], text: &str) -> Vec<ProposedChanges> {
    let pairs = &file.outline.pairs;
    let is_name = |pair: &&KeyPair| {
        let is_key = pair.keys.len() == 1 && pair.keys[0].text == "name";
        is_key && file.slice(pair.value.clone()).trim_matches('"') == names[0]
    };
    let objects = pairs.iter().filter(is_name).map(|pair| pair.object);
    let objects = objects.filter(|at| file.outline.objects[*at].kind == "record");
    let declares = |object: usize| {
        let keys = ["fields", names[1]];
        pairs.iter().find(move |pair| {
            let is_field = pair.keys.iter().map(|key| key.text.as_str()).eq(keys);
            pair.object == object && is_field
        })
    };
    at_end_of(file, objects.filter_map(declares).next(), text)
}

/// The changes that add a pair to a table in braces.
fn at_end_of(file: &EditorFile, table: Option<&KeyPair>, text: &str) -> Vec<ProposedChanges> {
    let end = table.and_then(|pair| end_in_braces(file, &pair.value));
    end.map(|end| vec![one(end..end, format!(", {text}"))]).into_iter().collect()
}

/// Writes lines: as a new table, or as keys of the table that contains a place. `instead`: a key of
/// that table that the lines replace.
fn of_lines(
    file: &EditorFile,
    span: &Range<usize>,
    all: &[String],
    instead: Option<&str>,
) -> Vec<ProposedChanges> {
    if all.first().is_some_and(|line| line.starts_with('[')) {
        let block = all.join("\n");
        let before = file
            .outline
            .header_at(span.start)
            .map_or(0, |found_header| file.line(found_header.span.start).start);
        let end = file.text.len();
        let at_end = if file.text.ends_with('\n') { "\n" } else { "\n\n" };
        return vec![
            vec![one(before..before, format!("{block}\n\n"))],
            vec![one(end..end, format!("{at_end}{block}\n"))],
        ];
    }
    let object = object_at(file, span);
    let separator = if is_inline(file, object) { ", " } else { "\n" };
    let mut proposal = Vec::new();
    let mut fresh = Vec::new();
    for line in all {
        let Some(keys) = as_pair(line) else { return Vec::new() };
        let beside = pair_at(file, span);
        let same = same_key(file, object, beside, &keys);
        match same.or_else(|| same_key(file, object, None, &keys)) {
            Some(same) => proposal.push(one(same.extent(), line.as_str())),
            None => fresh.push(line.as_str()),
        }
    }
    let gone = instead.and_then(|key| same_key(file, object, None, &[key.to_owned()]));
    match gone {
        Some(gone) => proposal.push(one(gone.extent(), fresh.join(separator))),
        None if fresh.is_empty() => {}
        None => proposal.push(added(file, span, &fresh.join(separator))),
    }
    vec![proposal]
}

/// The proposals that delete: the place in its string, the element of its array, its pair, or its
/// table.
fn deleted(file: &EditorFile, span: &Range<usize>) -> Vec<ProposedChanges> {
    let mut all = Vec::new();
    if let Some(header) =
        file.outline.header_at(span.start).filter(|found_header| found_header.path == "template")
    {
        // A template goes with the tables below it.
        let is_next = |found_header: &&TableHeader| {
            found_header.span.start > header.span.start
                && !found_header.path.starts_with("template.")
        };
        let next = file.outline.headers.iter().find(is_next);
        let end =
            next.map_or(file.text.len(), |found_header| file.line(found_header.span.start).start);
        // A file with nothing else would be no ladder.
        let is_all = file.outline.headers.iter().all(|header| header.path.starts_with("template"));
        if is_all {
            return Vec::new();
        }
        all.push(vec![one(file.line(header.span.start).start..end, "")]);
    }
    all.extend(omitted(file, span));
    all.extend(without_table(file, span));
    all
}

/// The proposals that delete the place in its string, the element of its array, or its pair.
fn omitted(file: &EditorFile, span: &Range<usize>) -> Vec<ProposedChanges> {
    let mut all = Vec::new();
    if let Some(value) = file.outline.value_at(span) {
        let inner = &value.inner;
        let is_part = inner.start <= span.start && span.end <= inner.end && inner != span;
        if value.is_string && is_part {
            let behind = file.slice(span.end..inner.end);
            let spaces = behind.len() - behind.trim_start().len();
            let before = file.slice(inner.start..span.start).trim_end().len();
            let is_last = spaces == behind.len();
            let start = if is_last { inner.start + before } else { span.start };
            all.push(vec![one(start..span.end + spaces, "")]);
        }
        all.push(vec![one(with_comma(file, &value.span), "")]);
    }
    if let Some(pair) = pair_at(file, span) {
        all.push(vec![without_pair(file, pair)]);
    }
    all
}

/// The proposal that deletes the table of a place.
fn without_table(file: &EditorFile, span: &Range<usize>) -> Vec<ProposedChanges> {
    let object = object_at(file, span);
    let extent = file.outline.objects[object].extent.clone();
    match object {
        0 => Vec::new(),
        _ if is_inline(file, object) => vec![vec![one(with_comma(file, &extent), "")]],
        _ => vec![vec![one(lines(file, &extent), "")]],
    }
}
