//! The explanation of a key, from the reader of its file.

use std::ops::Range;

use super::super::workspace::Cursor;

/// The explanation of the key at the cursor, also in a header.
pub(super) fn at(cursor: &Cursor) -> Option<(Range<usize>, String)> {
    let (file, at) = (cursor.file(), cursor.offset);
    let outline = &file.outline;
    let in_header = outline.header_at(at).filter(|header| header.span.contains(&at));
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
    let path: Vec<&str> = path.split('.').collect();
    let (key, _) = file.kind.shape().entry(&path)?;
    Some((range, format!("**{}**: {}\n", path.last()?, key.doc)))
}
