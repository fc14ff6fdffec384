//! The explanation of a key, from the reader of its file.

use std::ops::Range;

use super::super::slots::FileKind;
use super::super::workspace::Cursor;
use rungd_config::controller;
use rungd_lab::testing;
use rungd_language::source::ladder;
use rungd_language::source::shape::Shape;

/// The explanation of the key at the cursor, also in a header.
pub(super) fn at(cursor: &Cursor) -> Option<(Range<usize>, String)> {
    let (file, at) = (cursor.file(), cursor.offset);
    let outline = &file.outline;
    let in_header = outline.headers.iter().find(|header| header.span.contains(&at));
    let (path, range) = match in_header {
        Some(header) => {
            let behind = file.slice(at..header.span.end);
            let end = behind.find(['.', ']', '"', ' ']).map_or(header.span.end, |end| at + end);
            let path = file.slice(header.span.start..end).trim_start_matches('[');
            (path.replace(['"', ' '], ""), header.span.clone())
        }
        None => {
            let pair = outline.pairs.iter().find(|pair| {
                let own = &pair.keys[pair.outer.min(pair.keys.len())..];
                own.iter().any(|key| key.span.contains(&at))
            })?;
            let number = pair.keys.iter().position(|key| key.span.contains(&at))?;
            let keys = pair.keys[..=number].iter().map(|key| key.text.as_str());
            let object = outline.objects[pair.object].kind.as_str();
            let path: Vec<&str> = object.split('.').filter(|part| !part.is_empty()).collect();
            let path: Vec<&str> = path.into_iter().chain(keys).collect();
            (path.join("."), pair.keys[number].span.clone())
        }
    };
    let shape = match file.kind {
        FileKind::Ladder => ladder::shape(),
        FileKind::Controller => controller::shape(),
        FileKind::Test => testing::shape(),
    };
    let path: Vec<&str> = path.split('.').collect();
    let (name, doc) = (path.last()?.to_string(), doc(&shape, &path)?);
    Some((range, format!("**{name}**: {doc}\n")))
}

/// The explanation of the key with a path below a table.
fn doc(shape: &Shape, path: &[&str]) -> Option<&'static str> {
    let (first, rest) = path.split_first()?;
    let noted = shape.noted();
    let known = noted.keys.iter().find(|(key, _)| key.name == *first);
    let (key, form) = known.or(noted.others.as_ref())?;
    if rest.is_empty() {
        return Some(key.doc);
    }
    doc(form.below()?, rest)
}
