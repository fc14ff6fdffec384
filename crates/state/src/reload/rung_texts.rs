//! What changed in a rung, in the author's own words.
//!
//! Made by `rungs`, told by `report`, which gets the texts of both programs' files. Only the parts
//! that differ are told.

use rungd_language::lower::identity::{RungPartText, RungText};

/// The maximum number of characters of a part.
const PART_MAX: usize = 300;

/// A rung that differs between two programs.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum RungDifference {
    /// The rung as it was, and as it is.
    Edited(RungText, RungText),
    New(RungText),
    Gone(RungText),
}

/// The texts of the files of two programs, by the numbers of the files. Without them a report has
/// no texts of rungs.
#[derive(Clone, Copy, Debug, Default)]
pub struct FileTexts<'a> {
    /// The files of the old program.
    pub old: &'a [&'a str],
    /// The files of the new program.
    pub new: &'a [&'a str],
}

impl RungDifference {
    /// The difference as one line; `None` without texts.
    pub(super) fn line(&self, texts: FileTexts<'_>) -> Option<String> {
        if texts.old.is_empty() || texts.new.is_empty() {
            return None;
        }
        Some(match self {
            RungDifference::Edited(old, new) => edited(old, new, texts),
            RungDifference::New(rung) => {
                format!("{} is new: {}", rung.said, whole(rung, texts.new))
            }
            RungDifference::Gone(rung) => {
                format!("{} is gone: {}", rung.said, whole(rung, texts.old))
            }
        })
    }
}

fn edited(old: &RungText, new: &RungText, texts: FileTexts<'_>) -> String {
    let said = match old.said == new.said {
        true => new.said.to_string(),
        false => format!("{} is {} now", old.said, new.said),
    };
    let text_of = |rung: &RungText, key: &str, files: &[&str]| {
        rung.parts.iter().find(|part| part.key == key).map(|part| text(part, files))
    };
    let is_old = |key: &str| old.parts.iter().any(|part| part.key == key);
    let added = new.parts.iter().filter(|part| !is_old(&part.key));
    let mut changes = Vec::new();
    for key in old.parts.iter().chain(added).map(|part| &*part.key) {
        let (was, is) = (text_of(old, key, texts.old), text_of(new, key, texts.new));
        if was != is {
            let or_none = |text: Option<String>| text.unwrap_or_else(|| "none".to_owned());
            changes.push(format!("{key} {} → {}", or_none(was), or_none(is)));
        }
    }
    if changes.is_empty() {
        let why = match old.whole == new.whole {
            true => "its text is the same",
            false => "its text is the same; a constant, an address or an argument in it is not",
        };
        return format!("{said}: {why}");
    }
    format!("{said}: {}", changes.join("; "))
}

fn whole(rung: &RungText, files: &[&str]) -> String {
    let filled = rung.parts.iter().filter(|part| !part.texts.is_empty());
    let parts = filled.map(|part| format!("{} {}", part.key, text(part, files)));
    parts.collect::<Vec<_>>().join("; ")
}

/// The contacts or instructions of a part on one line.
fn text(part: &RungPartText, files: &[&str]) -> String {
    let texts = part.texts.iter().map(|span| {
        let text = files.get(span.file.0 as usize);
        text.and_then(|text| text.get(span.start as usize..span.end as usize)).unwrap_or("?")
    });
    let whole = texts.collect::<Vec<_>>().join(", ");
    match whole.char_indices().nth(PART_MAX) {
        Some((end, _)) => format!("{}…", &whole[..end]),
        None if whole.is_empty() => "none".to_owned(),
        None => whole,
    }
}
