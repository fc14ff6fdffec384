//! Where something stands, and where something could be written, in the table of a place.

use std::ops::Range;

use super::super::file::EditorFile;
use super::super::outline::{KeyPair, OutlineValue, TableHeader};

/// The innermost pair around a place.
pub(super) fn pair_at<'f>(file: &'f EditorFile, span: &Range<usize>) -> Option<&'f KeyPair> {
    let around = file.outline.pairs.iter().filter(|pair| {
        let extent = pair.extent();
        extent.start <= span.start && span.end <= extent.end
    });
    around.min_by_key(|pair| pair.extent().len())
}

/// The value around a place.
pub(super) fn value_at<'f>(file: &'f EditorFile, span: &Range<usize>) -> Option<&'f OutlineValue> {
    let values = &file.outline.values;
    let behind = values.partition_point(|value| value.span.start <= span.start);
    let near = behind.checked_sub(1).map(|last| &values[last]);
    near.filter(|value| span.end <= value.span.end)
}

/// The object that a place lies in.
pub(super) fn object_at(file: &EditorFile, span: &Range<usize>) -> usize {
    if let Some(pair) = pair_at(file, span) {
        return pair.object;
    }
    let objects = file.outline.objects.iter().enumerate().rev();
    let mut around = objects
        .filter(|(_, object)| object.extent.start <= span.start && span.end <= object.extent.end);
    around.next().map_or(0, |(at, _)| at)
}

/// The header that a place stands under, or in.
pub(super) fn header_at(file: &EditorFile, at: usize) -> Option<&TableHeader> {
    file.outline.headers.iter().rev().find(|header| header.span.start <= at)
}

/// Where a further line of the table that a place is in can stand: behind its last pair.
pub(super) fn end_of_table(file: &EditorFile, at: usize) -> usize {
    let headers = &file.outline.headers;
    let next = headers.iter().map(|header| header.span.start).find(|start| *start > at);
    let next = next.unwrap_or(file.text.len());
    let header = header_at(file, at);
    let begin = header.map_or(0, |header| header.span.start);
    let pairs = file.outline.pairs.iter().map(KeyPair::extent);
    let own = pairs.filter(|extent| begin <= extent.start && extent.end <= next);
    let last = own.map(|extent| extent.end).max();
    let end = last.unwrap_or_else(|| header.map_or(0, |header| header.span.end));
    file.line(end).end
}

/// Whether an object is an inline table.
pub(super) fn is_inline(file: &EditorFile, object: usize) -> bool {
    let extent = &file.outline.objects[object].extent;
    object != 0 && file.text.as_bytes().get(extent.start) == Some(&b'{')
}

/// Where a further key of the braces that end there can stand: behind the last value.
pub(super) fn end_in_braces(file: &EditorFile, braces: &Range<usize>) -> Option<usize> {
    let inner = file.slice(braces.clone()).strip_suffix('}')?;
    Some(braces.start + inner.trim_end().len())
}

/// The whole lines of a stretch, with the end of the last one.
pub(super) fn lines(file: &EditorFile, span: &Range<usize>) -> Range<usize> {
    let start = file.line(span.start).start;
    let end = file.line(span.end).end;
    let rest = &file.text[end..];
    let length = if rest.starts_with("\r\n") { 2 } else { usize::from(rest.starts_with('\n')) };
    start..end + length
}

/// The word of an instruction or step that a place lies in.
pub(super) fn word_around(
    file: &EditorFile,
    within: &Range<usize>,
    span: &Range<usize>,
) -> Range<usize> {
    let before = file.slice(within.start..span.start).rfind(' ').map_or(0, |at| at + 1);
    let behind = file.slice(span.end..within.end).find(' ');
    within.start + before..behind.map_or(within.end, |at| span.end + at)
}
