//! The changes of a text that an advice can mean, the most likely first. `verify` decides which are
//! offered.

use std::ops::Range;

use super::super::file::EditorFile;
use super::super::outline::{KeyPair, TableHeader};
use super::advice::Advice;
use super::edit::{Proposal, added, as_pair, declared, one, same_key, with_comma, without_pair};
use super::places::{
    end_in_braces, header_at, is_inline, lines, object_at, pair_at, value_at, word_around,
};
use super::tables;
use rungd_engine::isa::address_text::reads_as_address;

/// The maximum number of proposals for an advice.
const PROPOSALS_MAX: usize = 8;
/// The longest string that is compared with spaces ignored.
const SPACED_MAX: usize = 1000;

/// The changes that an advice about a place can mean.
pub(super) fn proposed(file: &EditorFile, span: &Range<usize>, advice: &Advice) -> Vec<Proposal> {
    let mut all = match advice {
        Advice::Write { text, .. } if names_others(file, span, text) => Vec::new(),
        Advice::Write { text, tag: Some(tag), .. } => into_tag(file, tag, text),
        Advice::Write { text, tag: None, .. } => written(file, span, text),
        Advice::Declare(text) => vec![declared(file, text)],
        Advice::Lines { lines, instead } => of_lines(file, span, (lines, instead.as_deref())),
        Advice::Delete => deleted(file, span),
        Advice::Drop(sign) => {
            let rest = file.slice(span.clone()).replacen(sign.as_str(), "", 1);
            vec![vec![one(span.clone(), rest)]]
        }
        Advice::Row(row) => tables::row(file, span, row),
        Advice::Under { table, text } => tables::under(file, span, (table, text)),
        Advice::Table { header, line } => tables::table(file, span, (header, line)),
        Advice::Remove(key) => tables::removed(file, span, key),
        Advice::Here { declare, before, text } => {
            tables::here(file, span, (declare, before.as_deref(), text))
        }
    };
    let mut known: Vec<Proposal> = Vec::new();
    all.retain(|proposal| {
        let is_new = !known.contains(proposal) && is_change(file, proposal);
        known.push(proposal.clone());
        is_new
    });
    all.truncate(PROPOSALS_MAX);
    all
}

fn is_change(file: &EditorFile, proposal: &Proposal) -> bool {
    proposal.iter().any(|change| file.slice(change.range.clone()) != change.text)
}

/// Whether a text contains addresses that the lines of the place do not contain; such a text is an
/// example. A single name may be a different spelling of the address there, as `Y7` of `%Q0.7`.
fn names_others(file: &EditorFile, span: &Range<usize>, text: &str) -> bool {
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let own = file.slice(lines(file, span)).to_ascii_lowercase();
    let words: Vec<&str> = own.split(|c| !is_letter(c)).collect();
    let is_name = !text.contains([' ', '"', '=']);
    text.split(|c| !is_letter(c)).filter(|word| reads_as_address(word)).any(|word| {
        let digits = word.trim_start_matches(|c: char| c.is_ascii_alphabetic());
        let is_spelt = is_name && own.contains(digits);
        !is_spelt && !words.contains(&word.to_ascii_lowercase().as_str())
    })
}

/// The proposals that replace something at a place with a text.
fn written(file: &EditorFile, span: &Range<usize>, text: &str) -> Vec<Proposal> {
    if text.starts_with('[') && !text.starts_with("[\"") && text.ends_with(']') {
        let header = header_at(file, span.start).filter(|of| span.start < of.span.end);
        if let Some(header) = header {
            let before = file.line(header.span.start).start;
            let whole = vec![one(header.span.clone(), text)];
            return vec![whole, vec![one(before..before, format!("{text}\n"))]];
        }
    }
    let mut all = Vec::new();
    if let Some(keys) = as_pair(text) {
        all.extend(as_key(file, span, (&keys, text)));
    }
    let value = value_at(file, span);
    if let Some(value) = value.filter(|_| text.starts_with(['"', '['])) {
        all.push(vec![one(value.span.clone(), text)]);
    }
    let string = value.filter(|value| value.is_string);
    let Some(string) = string else {
        all.push(vec![one(span.clone(), text)]);
        let pair = pair_at(file, span).filter(|pair| !pair.value.is_empty());
        all.extend(pair.map(|pair| vec![one(pair.value.clone(), text)]));
        return all;
    };
    if text.contains(['"', '\\', '\n']) {
        return all;
    }
    if span.start >= string.inner.start && span.end <= string.inner.end {
        all.push(vec![one(span.clone(), text)]);
        all.push(vec![one(word_around(file, &string.inner, span), text)]);
    }
    let parts = parts(file, &string.inner, (span, text));
    all.extend(parts.into_iter().map(|place| vec![one(place, text)]));
    all.push(vec![one(string.inner.clone(), text)]);
    all
}

/// The parts of a string that a text can replace: a part that differs only in spaces; the place
/// with the word before it, if the text repeats that word; the contacts of a step; the expression
/// of a MATH.
fn parts(
    file: &EditorFile,
    inner: &Range<usize>,
    (span, text): (&Range<usize>, &str),
) -> Vec<Range<usize>> {
    let whole = file.slice(inner.clone());
    let own = |part: Range<usize>| inner.start + part.start..inner.start + part.end;
    let mut parts: Vec<Range<usize>> = spaced_otherwise(whole, text).into_iter().map(own).collect();
    let first = text.split(' ').next().unwrap_or_default();
    if first.len() < text.len() && inner.start <= span.start && span.end <= inner.end {
        let word = word_around(file, inner, span);
        let before = file.slice(inner.start..word.start).trim_end();
        parts.extend(before.ends_with(first).then(|| {
            let start = inner.start + before.len() - first.len();
            start..word.end
        }));
    }
    for sign in [": ", " = "] {
        let at = whole.find(sign).map(|at| at + sign.len()..whole.len());
        parts.extend(at.map(own));
    }
    parts
}

/// The part of a string that equals a text if spaces are ignored.
fn spaced_otherwise(whole: &str, text: &str) -> Option<Range<usize>> {
    if whole.len() > SPACED_MAX {
        return None;
    }
    let plain = |text: &str| -> Vec<(usize, char)> {
        text.char_indices().filter(|(_, c)| *c != ' ').collect()
    };
    let (all, wanted) = (plain(whole), plain(text));
    let same = |at: &usize| all[*at..].iter().zip(&wanted).all(|(own, of)| own.1 == of.1);
    let last = all.len().checked_sub(wanted.len().max(1))?;
    let at = (0..=last).find(same)?;
    let (end, c) = all[at + wanted.len() - 1];
    Some(all[at].0..end + c.len_utf8())
}

/// The proposals that write a pair: replace the pair with the same key, replace the pair at the
/// place, or add the pair.
fn as_key(file: &EditorFile, span: &Range<usize>, pair: (&[String], &str)) -> Vec<Proposal> {
    let (keys, text) = pair;
    let mut all = Vec::new();
    let at = pair_at(file, span);
    let object = object_at(file, span);
    if let Some(same) = same_key(file, object, (at, keys)) {
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
fn into_braces(file: &EditorFile, same: &KeyPair, text: &str) -> Option<Proposal> {
    let (_, inner) = text.split_once('{')?;
    let inner = inner.strip_suffix('}')?.trim();
    let end = end_in_braces(file, &same.value)?;
    let comma = if end > same.value.start + 1 { "," } else { "" };
    Some(vec![one(end..end, format!("{comma} {inner}"))])
}

/// Adds a key to a tag.
fn into_tag(file: &EditorFile, tag: &str, text: &str) -> Vec<Proposal> {
    let declares = |pair: &&KeyPair| {
        pair.keys.len() == 2 && pair.keys[0].text == "tags" && pair.keys[1].text == tag
    };
    let pair = file.outline.pairs.iter().find(declares);
    let end = pair.and_then(|pair| end_in_braces(file, &pair.value));
    end.map(|end| vec![one(end..end, format!(", {text}"))]).into_iter().collect()
}

/// Writes lines: as a new table, or as keys of the table that contains a place.
fn of_lines(
    file: &EditorFile,
    span: &Range<usize>,
    (all, instead): (&[String], Option<&str>),
) -> Vec<Proposal> {
    if all.first().is_some_and(|line| line.starts_with('[')) {
        let block = all.join("\n");
        let before = header_at(file, span.start).map_or(0, |of| file.line(of.span.start).start);
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
        let same = same_key(file, object, (beside, &keys));
        match same.or_else(|| same_key(file, object, (None, &keys))) {
            Some(same) => proposal.push(one(same.extent(), line.as_str())),
            None => fresh.push(line.as_str()),
        }
    }
    let gone = instead.and_then(|key| same_key(file, object, (None, &[key.to_owned()])));
    match gone {
        Some(gone) => proposal.push(one(gone.extent(), fresh.join(separator))),
        None if fresh.is_empty() => {}
        None => proposal.push(added(file, span, &fresh.join(separator))),
    }
    vec![proposal]
}

/// The proposals that delete: the place in its string, the element of its array, its pair, or its
/// table.
fn deleted(file: &EditorFile, span: &Range<usize>) -> Vec<Proposal> {
    let mut all = Vec::new();
    if let Some(header) = header_at(file, span.start).filter(|of| of.path == "template") {
        // A template goes with the tables below it.
        let is_next = |of: &&TableHeader| {
            of.span.start > header.span.start && !of.path.starts_with("template.")
        };
        let next = file.outline.headers.iter().find(is_next);
        let end = next.map_or(file.text.len(), |of| file.line(of.span.start).start);
        all.push(vec![one(file.line(header.span.start).start..end, "")]);
    }
    if let Some(value) = value_at(file, span) {
        let inner = &value.inner;
        if value.is_string && inner.start <= span.start && span.end <= inner.end {
            let behind = file.slice(span.end..inner.end);
            let spaces = behind.len() - behind.trim_start().len();
            all.push(vec![one(span.start..span.end + spaces, "")]);
        }
        all.push(vec![one(with_comma(file, &value.span), "")]);
    }
    if let Some(pair) = pair_at(file, span) {
        all.push(vec![without_pair(file, pair)]);
    }
    let object = object_at(file, span);
    let extent = file.outline.objects[object].extent.clone();
    if object != 0 && !is_inline(file, object) {
        all.push(vec![one(lines(file, &extent), "")]);
    } else if object != 0 {
        all.push(vec![one(with_comma(file, &extent), "")]);
    }
    all
}
