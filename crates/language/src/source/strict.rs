//! Strict TOML 1.0: the parser reads TOML 1.1, and this module refuses the additions of 1.1, so
//! that every TOML tool reads a file in the same way.
//!
//! Also makes the findings for a text that is not TOML. Called by the reader, once per file.
// `_` matches the values that TOML allows and a ladder does not; the enum is the parser's.
#![allow(clippy::wildcard_enum_match_arm)]

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue, Error};

use super::doc::Doc;
use super::finding::{Code, Finding};
use super::fix::certain;
use super::headers;
use super::toml_slips::{slip, unquoted};

/// Makes findings from the parser's errors, at most one per line: the parser continues after an
/// error, and later errors of the line usually follow from the first.
pub(super) fn report_syntax(doc: Doc<'_>, errors: &[Error]) {
    let mut places: Vec<(Range<usize>, &Error)> =
        errors.iter().map(|error| (error.span().unwrap_or(0..0), error)).collect();
    places.sort_by_key(|(range, _)| range.start);
    let mut last: Option<(usize, &str)> = None;
    // The end of the line of the last error. A line of a megabyte may have an error at each byte.
    let mut line_end = None;
    for (range, error) in places {
        let known = line_end.filter(|end| range.start <= *end);
        let line_end = *line_end.insert(known.unwrap_or_else(|| {
            let rest = doc.slice(range.start..doc.len());
            range.start + rest.find('\n').unwrap_or(rest.len())
        }));
        // Whether the error follows from an earlier one: it is on the same line, or is the same
        // error further down.
        let echo = last.is_some_and(|(end, message)| {
            range.start <= end || (message == error.message() && message.contains("missing"))
        });
        last = Some((line_end, error.message()));
        if echo {
            continue;
        }
        let behind = doc.slice(range.start..line_end);
        let finding = Finding::new(Code::TomlSyntax, doc.span(range.clone()), error.message());
        let is_unquoted = ["string values must be quoted", "invalid boolean"]
            .iter()
            .any(|words| error.message().contains(words));
        let slip =
            slip(doc, range.start).or_else(|| unquoted(doc, range.start).filter(|_| is_unquoted));
        if let Some(finding) = slip {
            doc.find(finding);
            continue;
        }
        if error.message().starts_with("duplicate key")
            && let Some(finding) = headers::doubled(doc, range)
        {
            doc.find(finding);
            // Errors of all keys up to the next header follow from it.
            let rest = doc.slice(line_end..doc.len());
            last = Some((line_end + rest.find("\n[").unwrap_or(rest.len()), error.message()));
            continue;
        }
        doc.find(match help(error.message(), behind) {
            Some(words) => finding.help(words),
            None => finding,
        });
    }
}

/// The help for an error; `rest` is the line from the error's place on.
fn help(message: &str, rest: &str) -> Option<&'static str> {
    if message.contains("unquoted key") && rest.starts_with(|c: char| !c.is_ascii()) {
        return Some("names are of the letters A to Z and a to z, digits and `_`: `groesse`");
    }
    if message.starts_with("duplicate key") {
        return Some("a key or a table's header is written once; `[[…]]` headers may repeat");
    }
    if message.contains("missing comma between") {
        return Some("a comma is missing, or the `]` or `}` of something further up");
    }
    if message.contains("carriage return must be followed") {
        return Some("save the file with Unix or Windows line ends");
    }
    if message.contains("string values must be quoted") {
        return Some("texts stand in quotes: `\"…\"`");
    }
    None
}

/// Visits all values and refuses those that are not TOML 1.0.
pub(super) fn check(doc: Doc<'_>, table: &DeTable<'_>) {
    for (key, value) in table {
        escapes(doc, key.span());
        check_value(doc, value);
    }
}

fn check_value(doc: Doc<'_>, value: &Spanned<DeValue<'_>>) {
    match value.get_ref() {
        DeValue::String(_) => escapes(doc, value.span()),
        DeValue::Integer(_) | DeValue::Float(_) => number(doc, value.span()),
        DeValue::Array(array) => array.iter().for_each(|item| check_value(doc, item)),
        DeValue::Table(table) => {
            if doc.slice(value.span()).starts_with('{') {
                inline_table(doc, table, value.span());
            }
            check(doc, table);
        }
        _ => {}
    }
}

/// Refuses a number with a text behind it, such as `1_000"R1"`: the parser reads it as a number.
fn number(doc: Doc<'_>, range: Range<usize>) {
    let raw = doc.slice(range.clone());
    if raw.contains(['"', '\'']) {
        let place = doc.span(range);
        let finding = Finding::new(Code::TomlSyntax, place, "a quote within a number");
        doc.find(finding.help("a number has no quotes; a text has one before and one behind it"));
    }
}

/// Refuses a line end between the braces of an inline table (except inside a value), and a comma
/// after its last pair.
fn inline_table(doc: Doc<'_>, table: &DeTable<'_>, whole: Range<usize>) {
    let mut leaves = Vec::new();
    collect_leaves(doc, table, &mut leaves);
    leaves.sort_by_key(|range| range.start);
    let mut at = whole.start;
    let ends = leaves.iter().map(|leaf| leaf.start).chain([whole.end]);
    let behind = leaves.iter().map(|leaf| leaf.end).chain([whole.end]);
    for (end, next) in ends.zip(behind) {
        let gap = doc.slice(at..end);
        if let Some(newline) = gap.find('\n') {
            let place = doc.span(whole.start..at + newline);
            doc.find(
                Finding::new(Code::TomlSyntax, place, "an inline table goes over several lines")
                    .label("TOML 1.0 wants it on one line")
                    .help("write it on one line, or as a table under a `[header]` of its own"),
            );
            return;
        }
        at = next.max(at);
    }
    let tail = leaves.last().map_or(whole.start, |leaf| leaf.end);
    if let Some(comma) = doc.slice(tail..whole.end).find(',') {
        let place = doc.span(tail + comma..tail + comma + 1);
        doc.find(
            Finding::new(Code::TomlSyntax, place, "a comma after the last key of an inline table")
                .label("TOML 1.0 allows none here")
                .help("remove the comma")
                .fix(certain("")),
        );
    }
}

/// The places of all keys and values between the braces; a dotted key's parts count one by one.
fn collect_leaves(doc: Doc<'_>, table: &DeTable<'_>, leaves: &mut Vec<Range<usize>>) {
    for (key, value) in table {
        leaves.push(key.span());
        match value.get_ref() {
            DeValue::Table(below) if !doc.slice(value.span()).starts_with('{') => {
                collect_leaves(doc, below, leaves);
            }
            _ => leaves.push(value.span()),
        }
    }
}

/// Refuses `\e` and `\xHH`, which TOML 1.1 added.
fn escapes(doc: Doc<'_>, range: Range<usize>) {
    let raw = doc.slice(range.clone());
    if !raw.starts_with('"') {
        return;
    }
    let bytes = raw.as_bytes();
    let mut at = 0;
    while at + 1 < bytes.len() {
        if bytes[at] != b'\\' {
            at += 1;
            continue;
        }
        if matches!(bytes[at + 1], b'e' | b'x') {
            let place = doc.span(range.start + at..range.start + at + 2);
            doc.find(
                Finding::new(Code::TomlSyntax, place, "an escape that TOML 1.0 does not know")
                    .help("write `\\u00…` with the character's number"),
            );
        }
        at += 2;
    }
}
