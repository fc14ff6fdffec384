//! The pair or table at a place, and the places where something can be added.

use std::ops::Range;

use super::super::file::EditorFile;
use super::super::outline::KeyPair;

/// The innermost pair around a place.
pub(super) fn pair_at<'f>(file: &'f EditorFile, span: &Range<usize>) -> Option<&'f KeyPair> {
    let around = file.outline.pairs.iter().filter(|pair| {
        let extent = pair.extent();
        extent.start <= span.start && span.end <= extent.end
    });
    around.min_by_key(|pair| pair.extent().len())
}

/// The object that contains a place.
pub(super) fn object_at(file: &EditorFile, span: &Range<usize>) -> usize {
    if let Some(pair) = pair_at(file, span) {
        return row_at(file, pair, span).unwrap_or(pair.object);
    }
    let objects = file.outline.objects.iter().enumerate().rev();
    let mut around = objects
        .filter(|(_, object)| object.extent.start <= span.start && span.end <= object.extent.end);
    around.next().map_or(0, |(at, _)| at)
}

/// The table in the array of a pair that is at a place as a whole.
fn row_at(file: &EditorFile, pair: &KeyPair, span: &Range<usize>) -> Option<usize> {
    let is_in_array = file.slice(pair.value.clone()).starts_with('[');
    file.outline.objects.iter().position(|object| is_in_array && object.extent == *span)
}

/// The byte where a line can be added to the table that contains a place: after its last pair.
pub(super) fn end_of_table(file: &EditorFile, at: usize) -> usize {
    let headers = &file.outline.headers;
    let next = headers.iter().map(|header| header.span.start).find(|start| *start > at);
    let next = next.unwrap_or(file.text.len());
    let header = file.outline.header_at(at);
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

/// The byte where a key can be added in braces: after the last value. `None` if they are not
/// closed.
pub(super) fn end_in_braces(file: &EditorFile, braces: &Range<usize>) -> Option<usize> {
    let inner = file.slice(braces.clone()).strip_suffix('}')?;
    Some(braces.start + inner.trim_end().len())
}

/// The whole lines of a part of the text, with the line end of the last line.
pub(super) fn lines(file: &EditorFile, span: &Range<usize>) -> Range<usize> {
    let start = file.line(span.start).start;
    let end = file.line(span.end).end;
    let rest = &file.text[end..];
    let length = if rest.starts_with("\r\n") { 2 } else { usize::from(rest.starts_with('\n')) };
    start..end + length
}

/// The word of an instruction or step that contains a place.
pub(super) fn word_around(
    file: &EditorFile,
    within: &Range<usize>,
    span: &Range<usize>,
) -> Range<usize> {
    let before = file.slice(within.start..span.start).rfind(' ').map_or(0, |at| at + 1);
    let behind = file.slice(span.end..within.end).find(' ');
    within.start + before..behind.map_or(within.end, |at| span.end + at)
}
