//! Moves the index of a record's field behind the record: `recipe.target[3]` becomes
//! `recipe[3].target`. Both load; the second is the common form.
//!
//! Called by [`super::formatted`] before the layout. It changes only strings of a ladder, and only
//! the names of arrays of records that the same file declares.

use std::collections::HashSet;
use std::ops::Range;

use crate::source::atom::is_name_letter;
use crate::source::ladder::{self, WrittenTag};
use crate::source::room::LoadRoom;
use crate::source::span::FileId;
use crate::source::tag::TYPE_NAMES;

/// The text with the index of each field behind its record.
pub(super) fn moved(text: &str) -> Option<String> {
    if !text.contains("[[record]]") && !text.contains("count") {
        return None;
    }
    let (ladder, _) = ladder::read(&mut LoadRoom::default(), text, FileId(0));
    let ladder = ladder?;
    let own = ladder.templates.iter().flat_map(|template| &template.tags);
    let records = ladder.tags.iter().chain(own).filter(|tag| is_array_of_records(tag));
    let records: HashSet<&str> = records.map(|tag| tag.name.text.as_str()).collect();
    if records.is_empty() {
        return None;
    }
    let mut moved = String::with_capacity(text.len());
    let mut at = 0;
    for string in strings(text) {
        moved.push_str(&text[at..string.start]);
        at = string.end;
        push_moved(&text[string], &records, &mut moved);
    }
    moved.push_str(&text[at..]);
    (moved != text).then_some(moved)
}

/// Adds a string with the index of each field behind its record.
fn push_moved(mut rest: &str, records: &HashSet<&str>, into: &mut String) {
    while let Some(open) = rest.find('[') {
        let start = open - trailing_name(&rest[..open]).len();
        let element = element(&rest[start..], open - start, records);
        let end = element.as_ref().map_or(open + 1, |(_, length)| start + length);
        match element {
            Some((element, _)) => {
                into.push_str(&rest[..start]);
                into.push_str(&element);
            }
            None => into.push_str(&rest[..end]),
        }
        rest = &rest[end..];
    }
    into.push_str(rest);
}

/// The places of the strings of one line, without their quotes. Names stand in no other strings.
fn strings(text: &str) -> Vec<Range<usize>> {
    let (bytes, mut found) = (text.as_bytes(), Vec::new());
    let mut at = 0;
    while at < bytes.len() {
        let quote = bytes[at];
        let until = |end: usize, marks: &[u8]| {
            let rest = bytes.get(end..).unwrap_or_default();
            end + rest.iter().position(|b| marks.contains(b)).unwrap_or(rest.len())
        };
        at = match quote {
            b'#' => until(at, b"\n"),
            b'"' | b'\'' if bytes[at..].starts_with(&[quote; 3]) => {
                let closing = text[at + 3..].find(&text[at..at + 3]);
                closing.map_or(text.len(), |end| at + 3 + end + 3)
            }
            b'"' | b'\'' => {
                let end = until(at + 1, &[quote, b'\n']);
                found.push(at + 1..end);
                end + 1
            }
            _ => at + 1,
        };
    }
    found
}

fn is_array_of_records(tag: &WrittenTag) -> bool {
    let is_type = |kind: &str| TYPE_NAMES.contains(&kind);
    tag.count.is_some() && tag.kind.as_ref().is_some_and(|kind| !is_type(&kind.text))
}

/// The name with dots that a text ends with.
fn trailing_name(text: &str) -> &str {
    let rest = text.trim_end_matches(|c| is_name_letter(c) || c == '.');
    &text[rest.len()..]
}

/// The element in the common form and the length of the old form; `text` begins with a name of
/// `name` bytes and its index.
fn element(text: &str, name: usize, records: &HashSet<&str>) -> Option<(String, usize)> {
    let (record, field) = text[..name].split_once('.')?;
    if !records.contains(record) || field.is_empty() || field.contains('.') {
        return None;
    }
    let index = index(&text[name..])?;
    Some((format!("{record}{index}.{field}"), name + index.len()))
}

/// The index at the beginning of a text, with its brackets; all on one line.
fn index(text: &str) -> Option<&str> {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        match c {
            '[' => depth += 1,
            ']' if depth == 1 => return Some(&text[..=at]),
            ']' => depth -= 1,
            '"' | '\'' | '\n' => return None,
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_index_of_a_field_moves_behind_its_record() {
        let ladder = |names: &str| {
            format!(
                "[tags]\nrecipe = {{ type = \"Step\", count = 8 }}\nlist = {{ type = \"int\", \
                 count = 3 }}\nr = [{names}] # recipe.target[1]\n"
            )
        };
        let check = |before: &str, after: Option<&str>| {
            assert_eq!(moved(&ladder(before)), after.map(ladder), "{before}");
        };
        let (old, new) = ("\"!recipe.target[i + a[2]] & x\"", "\"!recipe[i + a[2]].target & x\"");
        check(old, Some(new));
        check("\"list[3]\", \"recipe[2].target\"", None);
        check("\"COPY recipe.a[0..2] to=list\"", Some("\"COPY recipe[0..2].a to=list\""));
        check("\"p1.recipe.target[3]\", \"other.target[3]\"", None);
    }
}
