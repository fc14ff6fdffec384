//! `out-of-place`: a header must follow its parent. Called by the reader, once per file.
//!
//! TOML adds `[[program.stage.rung]]` to the last `[[program.stage]]` of the last `[[program]]`,
//! even if there are other headers between them. A person reads a ladder from top to bottom.
//! Therefore each header of a ladder closes all tables except its own parents; a header whose
//! parent is closed is a finding.
//!
//! The parser sorts tables by name; their places restore the order of the file.
// `_` matches the values that TOML allows and a ladder does not; the enum is the parser's.
#![allow(clippy::wildcard_enum_match_arm)]

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::doc::Doc;
use super::finding::{Code, Finding};
use super::fix::{Fix, FixEdit, Help, advise, propose, proposed, write};
use super::span::Span;

/// A header, or the place at which a header is missing.
struct Header<'a> {
    path: Vec<&'a str>,
    span: Span,
    /// Length of the leading part of the path that ends with a table of an array; a header can
    /// close such tables.
    arrays: usize,
    /// Length of the leading part of the path that should be an array of tables but has no header.
    headless: Option<usize>,
}

/// The parents that a header's last part may have, for the help.
const PARENTS: [(&str, &[&str]); 3] = [
    ("branch", &["rung"]),
    ("rung", &["program", "stage", "task", "subroutine", "template"]),
    ("stage", &["program", "template"]),
];

/// The keys that are always arrays of tables.
const ARRAYS: [&str; 7] = ["program", "task", "subroutine", "template", "stage", "rung", "branch"];

/// Checks the order of all headers of a file.
pub(super) fn check(doc: Doc<'_>, root: &DeTable<'_>) {
    let mut headers = Vec::new();
    collect(doc, root, &Header::root(doc), &mut headers);
    headers.sort_by_key(|header| header.span.start);
    for at in 0..headers.len() {
        let header = &headers[at];
        let before = at.checked_sub(1).map(|at| &headers[at]);
        if let Some(length) = header.headless {
            doc.find(headless(header, length));
        } else if let Some(before) = before
            && !is_parent_open(header, before)
        {
            doc.find(out_of_place(header, before));
        }
    }
}

/// The finding for a header that the parser reports as a duplicate key: `[[program]]` after a
/// `[[program.rung]]` that already made `program` a table, or `[program.rung]` instead of `[[…]]`.
pub(super) fn doubled(doc: Doc<'_>, place: Range<usize>) -> Option<Finding> {
    let text = doc.slice(0..doc.len());
    let start = text.get(..place.start)?.rfind('\n').map_or(0, |at| at + 1);
    let line = text[start..].lines().next()?.trim();
    let name = header_name(line)?;
    let last = name.rsplit('.').next()?;
    if !ARRAYS.contains(&last) {
        return None;
    }
    if !line.starts_with("[[") {
        let message = format!("`[{name}]` again: blocks, stages, rungs and branches are lists");
        let finding = Finding::new(Code::OutOfPlace, doc.span(place), message);
        return Some(finding.help(write(format!("[[{name}]]")).and(", each time")));
    }
    let mut at = 0;
    let mut single = None;
    let mut before = "";
    for line in text[..start].split_inclusive('\n') {
        let trimmed = line.trim();
        let span = doc.span(at + line.len() - line.trim_start().len()..at + line.trim_end().len());
        at += line.len();
        let Some(other) = header_name(trimmed) else { continue };
        if other == name {
            single.get_or_insert(span);
        } else if other.strip_prefix(name).is_some_and(|rest| rest.starts_with('.')) {
            let message = format!("`[[{other}]]` stands before any `[[{name}]]`");
            let finding = Finding::new(Code::OutOfPlace, span, message);
            return Some(
                finding
                    .label("out of place")
                    .related(doc.span(place), "this is its parent, or the parent of another header")
                    .help(move_help(other, name, before)),
            );
        }
        before = other;
    }
    let finding =
        Finding::new(Code::OutOfPlace, single?, format!("`[{name}]`, and `[[{name}]]` below"));
    Some(finding.help(write(format!("[[{name}]]")).and(", each time")))
}

/// The help for a header above its parent: where the header belongs.
fn move_help(header: &str, parent: &str, before: &str) -> Help {
    let below = format!("move it below the header of its parent: `[[{parent}]]`");
    let last = |name: &str| name.rsplit('.').next().unwrap_or_default().to_owned();
    let (own, open) = (last(header), last(before));
    let stands = |(part, parents): &(&str, &[&str])| *part == own && parents.contains(&&*open);
    if !PARENTS.iter().any(stands) {
        return below.into();
    }
    propose(format!("[[{before}.{own}]]"))
        .and(&format!(" to continue in the table above, or {below}"))
}

/// The name in a line, if the line is a header.
fn header_name(line: &str) -> Option<&str> {
    let line = line.split('#').next()?.trim();
    let name = line.strip_prefix('[')?.strip_suffix(']')?;
    let name = name.strip_prefix('[').and_then(|n| n.strip_suffix(']')).unwrap_or(name).trim();
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
    (!name.is_empty() && name.chars().all(plain)).then_some(name)
}

/// Whether a table has no header of its own, and exists only because of a header below it.
pub(super) fn is_implicit(doc: Doc<'_>, value: &Spanned<DeValue<'_>>) -> bool {
    !doc.slice(value.span()).starts_with(['[', '{'])
}

impl Header<'_> {
    fn root(doc: Doc<'_>) -> Self {
        Header { path: Vec::new(), span: doc.span(0..0), arrays: 0, headless: None }
    }
}

fn collect<'a>(
    doc: Doc<'_>,
    table: &'a DeTable<'_>,
    parent: &Header<'a>,
    headers: &mut Vec<Header<'a>>,
) {
    for (key, value) in table {
        // Most keys are not tables, and need no path.
        let path = || parent.path.iter().copied().chain([&**key.get_ref()]).collect::<Vec<_>>();
        match value.get_ref() {
            DeValue::Table(below) => {
                let path = path();
                let missing = ARRAYS.contains(&&**key.get_ref()) && is_implicit(doc, value);
                let headless = parent.headless.or(missing.then_some(path.len()));
                let span = doc.span(value.span());
                let header = Header { path, span, arrays: parent.arrays, headless };
                visit(doc, below, header, headers);
            }
            DeValue::Array(array) => {
                for item in array {
                    let DeValue::Table(below) = item.get_ref() else { continue };
                    let (path, span) = (path(), doc.span(item.span()));
                    let arrays = path.len();
                    let header = Header { path, span, arrays, headless: parent.headless };
                    visit(doc, below, header, headers);
                }
            }
            _ => {}
        }
    }
}

fn visit<'a>(
    doc: Doc<'_>,
    table: &'a DeTable<'_>,
    header: Header<'a>,
    headers: &mut Vec<Header<'a>>,
) {
    collect(doc, table, &header, headers);
    let range = header.span.start as usize..header.span.end as usize;
    if doc.slice(range).starts_with('[') {
        headers.push(header);
    }
}

/// Whether a header's parent is still open after the previous header.
fn is_parent_open(header: &Header<'_>, before: &Header<'_>) -> bool {
    let parents = header.arrays.min(header.path.len() - 1);
    before.path.starts_with(&header.path[..parents])
}

fn headless(header: &Header<'_>, length: usize) -> Finding {
    let (text, parent) = (header.path.join("."), header.path[..length].join("."));
    let message = format!("`[[{text}]]` stands before any `[[{parent}]]`");
    let part = header.path[length - 1];
    let name = match part {
        "program" => "Main",
        "task" => "Housekeeping",
        "template" => "Pump",
        "stage" => "Open",
        _ => "",
    };
    let help = match name {
        "" => {
            advise(&format!("begin the {part} first: `{{}}`"), [proposed(format!("[[{parent}]]"))])
        }
        _ => {
            let lines = format!("[[{parent}]]\nname = \"{name}\"");
            let words = format!("begin the {part} first:\n{{}}");
            advise(&words, [Fix::from(FixEdit::Lines { lines, instead: None })])
        }
    };
    Finding::new(Code::OutOfPlace, header.span, message).help(help)
}

fn out_of_place(header: &Header<'_>, before: &Header<'_>) -> Finding {
    let text = header.path.join(".");
    let parent = header.path[..header.path.len() - 1].join(".");
    let message =
        format!("`[[{text}]]` would silently join a `[[{parent}]]` further up, which was closed");
    let closer = format!("this header closed `[[{parent}]]`");
    let finding = Finding::new(Code::OutOfPlace, header.span, message)
        .label("out of place")
        .related(before.span, closer);
    match meant(header, before) {
        Some(meant) => finding.help(
            propose(format!("[[{meant}]]"))
                .and(&format!(" to continue in the table above, or a new `[[{parent}]]` first")),
        ),
        None => finding.help(format!("move it up to its `[[{parent}]]`, or begin a new one")),
    }
}

/// The deepest open table that may contain the last part of the header.
fn meant(header: &Header<'_>, before: &Header<'_>) -> Option<String> {
    let last = *header.path.last()?;
    let (_, parents) = PARENTS.iter().find(|(name, _)| *name == last)?;
    let depth = (1..=before.path.len()).rev().find(|n| parents.contains(&before.path[n - 1]))?;
    Some(format!("{}.{last}", before.path[..depth].join(".")))
}
